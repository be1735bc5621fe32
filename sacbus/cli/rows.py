"""A queue file as an argument: read whole before anything is done, of any length.

Owns how its mistakes are told (one line, with file, line and column), and the bar that shows how
many of its rows are done.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sacbus.cli.options import STANDARD, WrongInput

if TYPE_CHECKING:
    from sacbus.language import Defaults
    from sacbus.language.queue_file import QueueRow, ReadRow
    from sacbus.plan.entries import Spool

__all__ = ["Rows", "opened_rows", "positions", "shown_progress"]


class Rows:
    """The rows of a file, which can be walked again and again. All of them are rows."""

    def __init__(self, spool: Spool, defaults: Defaults) -> None:
        """Read it once: WrongInput at the first line that is no row; remarks are printed."""
        self._spool = spool
        self._defaults = defaults
        #: How many there are.
        self.count = 0
        for read in self._read():
            self.count += 1
            for remark in read.remarks:
                place = f"{spool.name} line {read.line} column {remark.column}"
                told = f"expected {remark.expected}, got {remark.got}, {remark.text}"
                click.echo(f"warning: {place}: {told}", err=True)
        if not self.count:
            raise WrongInput(
                f"there is no row, {spool.name}, write one a line as the companion does"
            )

    def __iter__(self) -> Iterator[QueueRow]:
        return (read.row for read in self._read())

    def where(self, row: int) -> str:
        """Where a row stands, which counts from 1: ``queue.csv line 7``."""
        line = next(islice((read.line for read in self._read()), row - 1, None), row)
        return f"{self._spool.name} line {line}"

    def _read(self) -> Iterator[ReadRow]:
        from sacbus.language.queue_file import WrongRow, read_rows
        from sacbus.plan import PlanError

        try:
            yield from read_rows(self._spool, self._spool.name, self._defaults)
        except (WrongRow, PlanError) as fault:
            raise WrongInput(str(fault)) from fault


def positions(count: int) -> str:
    """So many positions of a queue, in words."""
    return f"{count} position" if count == 1 else f"{count} positions"


@contextmanager
def opened_rows(file: str, defaults: Defaults) -> Iterator[Rows]:
    """The rows of a file, or of standard input for ``-``; WrongInput when it cannot be read."""
    from sacbus.plan import Spool

    if file == STANDARD:
        spool = Spool(sys.stdin.buffer, "standard input")
    else:
        try:
            with Path(file).open("rb") as stream:
                spool = Spool(stream, file)
        except OSError as fault:
            raise WrongInput(
                f"the queue file cannot be read ({fault.strerror or fault}), {file}, check the path"
            ) from fault
    with spool:
        yield Rows(spool, defaults)


@contextmanager
def shown_progress(what: str, length: int) -> Iterator[Callable[[int], object]]:
    """A bar on standard error if that is a terminal; it is told how many of ``length`` are done."""
    if not sys.stderr.isatty():
        yield lambda _done: None
        return
    with click.progressbar(length=length, label=what, file=sys.stderr) as bar:
        yield lambda done: bar.update(done - bar.pos)
