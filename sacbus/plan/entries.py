"""What is to be planned: commands of a command line, of a list, or of a queue file.

Owns where each command comes from, so that a wrong one can be named, and the reading of inputs of
any length. A plan looks at its entries more than once (it is checked as a whole before anything is
said, and loops), so every source here can be walked again and again; an input is kept in a file.
"""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from tempfile import SpooledTemporaryFile
from typing import BinaryIO, Final, Protocol, Self

from sacbus.language import Defaults, Motion, Remark
from sacbus.language.queue_file import WrongRow, read_rows

__all__ = ["Commands", "Entry", "ListFile", "PlanError", "QueueFile", "Source", "Spool"]

LONGEST_LINE: Final = 1_000
"""Characters; a queue row has some 60, a command 40 at most on the device."""

IN_MEMORY: Final = 1 << 20
"""Bytes of an input that are kept in memory; a longer one lies in a temporary file."""


class PlanError(ValueError):
    """Something that cannot be planned or written: what, where, what to do."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One command and where it stands.

    text: the line, without blanks around it; of a queue row the command that means the same.
    motion: of a queue row, None for a line that is yet to be understood. skipped: characters of
    the line before the text, so that columns can be told.
    """

    text: str
    where: str
    motion: Motion | None = None
    remarks: tuple[Remark, ...] = ()
    skipped: int = 0


class Source(Protocol):
    """Entries, in order; each walk begins at the first one. PlanError for a line that is wrong."""

    def __iter__(self) -> Iterator[Entry]: ...


class Commands:
    """Commands given one by one, and lists among them; counted all through."""

    def __init__(self, parts: Iterable[str | Source]) -> None:
        self._parts: Final = tuple(parts)

    def __iter__(self) -> Iterator[Entry]:
        for number, part in enumerate(self._parts, start=1):
            if isinstance(part, str):
                yield Entry(part, f"command {number}")
            else:
                yield from part


class Spool:
    """An input kept in a file, so that it can be read again. Close it when done.

    It takes from ``stream`` all there is; ``lines`` says how much that was.
    """

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self.name: Final = name
        self.lines = 0
        # Closed by `close`; it has no name and leaves nothing behind whatever happens.
        self._kept: Final = SpooledTemporaryFile(IN_MEMORY)  # noqa: SIM115
        while piece := stream.read(1 << 16):
            self.lines += piece.count(b"\n")
            self._kept.write(piece)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_failure: object) -> None:
        self.close()

    def close(self) -> None:
        """Give back the memory, or the file."""
        self._kept.close()

    def __iter__(self) -> Iterator[str]:
        """The lines, without their ends; PlanError for one that is far too long."""
        self._kept.seek(0)
        # Whatever is no UTF-8 will not be understood as a command either, and is shown there.
        text = io.TextIOWrapper(self._kept, "utf-8-sig", errors="replace")
        try:
            number = 0
            while line := text.readline(LONGEST_LINE + 1):
                number += 1
                if len(line) > LONGEST_LINE and not line.endswith("\n"):
                    raise PlanError(
                        f"the line is too long, {self.name} line {number}, "
                        f"expected at most {LONGEST_LINE} characters"
                    )
                yield line.rstrip("\n")
        finally:
            # Who stops in the middle may close the file before this walk is cleared away.
            if not self._kept.closed:
                text.detach()


class ListFile:
    """A list of commands, a line each, as the companion keeps its one-shots.

    Blank lines, and those that begin with ``#``, which begins no command, are not commands.
    """

    def __init__(self, spool: Spool) -> None:
        self._spool: Final = spool

    def __iter__(self) -> Iterator[Entry]:
        for number, line in enumerate(self._spool, start=1):
            text = line.strip()
            if text and not text.startswith("#"):
                where = f"{self._spool.name} line {number}"
                yield Entry(text, where, skipped=line.index(text))


class QueueFile:
    """A queue file of the companion's, either form; the defaults' sprf relates RPM and cycle."""

    def __init__(self, spool: Spool, defaults: Defaults) -> None:
        self._spool: Final = spool
        self._defaults: Final = defaults

    def __iter__(self) -> Iterator[Entry]:
        name, defaults = self._spool.name, self._defaults
        try:
            for read in read_rows(self._spool, name, defaults):
                yield Entry(
                    read.row.move(defaults).text(),
                    f"{name} line {read.line}",
                    read.row.motion,
                    read.remarks,
                )
        except WrongRow as fault:
            raise PlanError(str(fault)) from fault
