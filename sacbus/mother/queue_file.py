"""Queue files in mother's hands: changed, compared, and put into the queue of a node.

Owns what a file's rows mean for a node's 30 positions. How a row reads in a file is
``sacbus.language``'s, and files themselves are the caller's: lines come in, lines go out. Rows that
are more than the queue holds are streamed (queue_stream.py). Getting a queue back is the business
of who has the node's terminal: a node answers no query on the line.
Source: spec, mother ("Queue files"); manual, "Queue", Appendix E.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

from sacbus.language import (
    QUEUE_LENGTH,
    Acceleration,
    Defaults,
    EditQueue,
    Motion,
    SaveQueue,
    edited,
    parse,
    seeded_row,
)
from sacbus.language.line import quoted
from sacbus.language.queue_file import Form, QueueRow, read_rows, write_rows
from sacbus.mother.edits import edit_lines
from sacbus.mother.errors import BadRequest

if TYPE_CHECKING:
    from sacbus.mother.mother import Mother

__all__ = ["Difference", "QueueFile", "RowRefused", "differences", "put_queue"]

_FACTORY: Final = Defaults()


class RowRefused(BadRequest):
    """A row that cannot go where it is to. row: from 1, in order; what, remedy: words."""

    def __init__(self, row: int, what: str, remedy: str) -> None:
        self.row, self.what, self.remedy = row, what, remedy
        super().__init__(f"{what}, row {row}, {remedy}")


class QueueFile:
    """The rows of a queue file, to be changed and written again.

    ::

        file = QueueFile.read(Path("queue.csv").read_text().splitlines(), "queue.csv")
        file.edit(9, "m-2000vc1500a1")      # as Q9 would at a node
        file[10] = file[9]
        del file[30]
        Path("queue.csv").write_text("".join(file.lines()), newline="")

    Rows are found by their positions, of which each is there once; they stay in their order.
    """

    def __init__(self, rows: Iterable[QueueRow] = (), *, defaults: Defaults = _FACTORY) -> None:
        """:class:`RowRefused` for a position that is there already."""
        self.defaults: Final = defaults
        self._motions: dict[int, Motion] = {}
        for number, row in enumerate(rows, start=1):
            if row.position in self._motions:
                raise _twice(number, row)
            self._motions[row.position] = row.motion

    @classmethod
    def read(
        cls, lines: Iterable[str], name: str = "the queue file", defaults: Defaults = _FACTORY
    ) -> Self:
        """From the lines of a file; ``WrongRow`` (a ValueError) tells line and column of a fault.

        What was cut or replaced in a row is silently as the device would have it; ``read_rows`` of
        ``sacbus.language.queue_file`` tells it.
        """
        return cls((one.row for one in read_rows(lines, name, defaults)), defaults=defaults)

    @property
    def rows(self) -> tuple[QueueRow, ...]:
        """All rows, in their order."""
        return tuple(QueueRow(*one) for one in self._motions.items())

    def lines(self, form: Form = Form.PRESENT) -> Iterator[str]:
        """The lines of the file, ended with CR LF: write them without translating newlines."""
        return write_rows(self.rows, form)

    def edit(self, position: int, edit: str) -> Motion:
        """Change what ``edit`` names in a position, by the rules of ``Qnn``; what it holds then.

        A position that is not there is added, as a new node has it. :class:`BadRequest` for an edit
        that a node would not take as it stands.
        """
        # The position itself may be beyond a node's 30, in a file that is streamed.
        parsed = parse(f"q1{edit}")
        command = parsed.command
        # Digits at its beginning would make another position of it.
        if not isinstance(command, EditQueue) or parsed.remarks or edit[0].isdigit():
            why = f": {parsed.remarks[0]}" if parsed.remarks else ""
            raise BadRequest(
                f"queue position {position}: expected an edit such as m400v120, got "
                f"{quoted(edit)}{why}"
            )
        before = self._motions.get(position) or seeded_row(self.defaults)
        self[position] = motion = edited(before, command.edit, self.defaults)
        return motion

    def __getitem__(self, position: int) -> Motion:
        """What a position holds; KeyError when it is not there."""
        return self._motions[position]

    def __setitem__(self, position: int, motion: Motion) -> None:
        if position < 1:
            raise BadRequest(f"queue position {position}: expected 1 or more")
        self._motions[position] = motion

    def __delitem__(self, position: int) -> None:
        del self._motions[position]

    def __len__(self) -> int:
        return len(self._motions)


async def put_queue(
    mother: Mother,
    node: int,
    rows: Iterable[QueueRow],
    *,
    defaults: Defaults = _FACTORY,
    save: bool = False,
    progress: Callable[[int], object] | None = None,
) -> int:
    """Write rows into the positions of a node's queue that they name; how many edits that took.

    Nothing runs by it, and positions that are not named stay. ``defaults`` are the node's: its
    default direction and its sprf. ``save``: have it save the whole queue to its EEPROM.
    ``progress`` is called with the number of rows that are written. All rows are looked at before
    the first is sent: :class:`RowRefused` for a position that a node does not have, or that is
    there twice. Else as :meth:`Mother.send`; a put that fails may be put again.
    """
    edits = _edits(rows, defaults)
    count = 0
    for number, lines in enumerate(edits, start=1):
        for line in lines:
            await mother.send(node, line)
            count += 1
        if progress is not None:
            progress(number)
    if save:
        await mother.send(node, SaveQueue().text())
    return count


def _edits(rows: Iterable[QueueRow], defaults: Defaults) -> list[list[str]]:
    edits: list[list[str]] = []
    there: set[int] = set()
    for number, row in enumerate(rows, start=1):
        if row.position > QUEUE_LENGTH:
            raise RowRefused(
                number,
                f"a node has no queue position {row.position}, only 1 to {QUEUE_LENGTH}",
                "give it another, or stream the rows",
            )
        if row.position in there:
            raise _twice(number, row)
        there.add(row.position)
        try:
            edits.append(edit_lines(row.position, row.motion, defaults))
        except BadRequest as fault:
            raise RowRefused(number, str(fault), "change it") from fault
    return edits


def _twice(number: int, row: QueueRow) -> RowRefused:
    what = f"queue position {row.position} is there twice"
    return RowRefused(number, what, "give each row a position of its own")


@dataclass(frozen=True, slots=True)
class Difference:
    """What is not as it should be in a position. field, got and wanted are words for people."""

    position: int
    field: str
    got: str
    wanted: str

    def __str__(self) -> str:
        return f"position {self.position}: {self.field} {self.got}, expected {self.wanted}"


def differences(got: Iterable[QueueRow], wanted: Iterable[QueueRow]) -> Iterator[Difference]:
    """Where a queue, as a node shows it, is not as a file has it; in the order of the file.

    Positions that the file does not name may hold anything.
    """
    shown = {row.position: _words(row.motion) for row in got}
    for row in wanted:
        there = shown.get(row.position)
        if there is None:
            yield Difference(row.position, "row", "none", "one")
            continue
        for field, value in _words(row.motion).items():
            if there[field] != value:
                yield Difference(row.position, field, there[field], value)


def _words(motion: Motion) -> Mapping[str, str]:
    """The fields of a row by their names in the file's order."""
    return {
        "steps": str(motion.steps or 0),
        "direction": "CW" if motion.cw else "CCW",
        "steps in": "pulses" if motion.pulses else "full steps",
        "RPM": str(motion.rpm),
        "cycle": str(motion.cycle_us),
        "ramp": "linear" if motion.linear else "harmonic",
        "acc": Acceleration(motion.acc100).text()[1:],
        "dec": Acceleration(motion.dec100).text()[1:],
        "extra pulses": str(motion.extra_pulses),
        "sync": "on" if motion.sync else "off",
        "start wait": str(motion.wait_us),
    }
