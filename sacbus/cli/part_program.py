"""The text of a part program, from a file or standard input, for as many readings as are wanted."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from io import TextIOWrapper
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, BinaryIO, TextIO

from sacbus.cli.options import STANDARD, WrongInput, shortened

if TYPE_CHECKING:
    from sacbus.toolpath import Machine, PathItem

__all__ = ["PartProgram"]


class PartProgram:
    """The text of a program, which is read twice; what cannot be is copied first."""

    def __init__(self, name: str, text: TextIO) -> None:
        self.name = name
        self._text = text

    @classmethod
    @contextmanager
    def opened(cls, file: str) -> Iterator[PartProgram]:
        """WrongInput for what cannot be read."""
        name = "standard input" if file == STANDARD else file
        with ExitStack() as stack:
            source = sys.stdin.buffer if file == STANDARD else stack.enter_context(_opened(file))
            if file == STANDARD or not Path(file).is_file():
                copy = stack.enter_context(TemporaryFile("w+b"))
                shutil.copyfileobj(source, copy)
                source = copy
            # Comments may be in any encoding; what is not UTF-8 is no word of G-code.
            text = TextIOWrapper(source, encoding="utf-8", errors="replace")
            stack.callback(text.detach)  # the file is closed by whoever opened it
            yield cls(name, text)

    def lines(self) -> Iterator[str]:
        """All lines, from the first on."""
        self._text.seek(0)
        return iter(self._text)

    def items(self, machine: Machine) -> Iterator[PathItem]:
        """What it makes the machine do."""
        from sacbus.gcode import read_program

        return read_program(self.lines(), machine, self.name)


def _opened(file: str) -> BinaryIO:
    try:
        return Path(file).open("rb")
    except (OSError, ValueError) as fault:  # the latter for a NUL in its name
        why = fault.strerror if isinstance(fault, OSError) else fault
        raise WrongInput(f"{shortened(file)}: {why}, name a part program") from fault
