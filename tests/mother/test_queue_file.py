"""Queue files are changed, compared, and put into nodes, field by field."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from sacbus import Mother
from sacbus.language import Defaults, Motion
from sacbus.language.queue_file import Form, QueueRow, WrongRow, read_rows
from sacbus.language.queue_screen import QueueScreen
from sacbus.mother import BadRequest, NoAnswer
from sacbus.mother.queue_file import QueueFile, RowRefused, differences, put_queue
from sacbus.testing import VirtualBus

DATA = Path(__file__).parents[1] / "data"


def companion() -> tuple[QueueRow, ...]:
    lines = (DATA / "companion-queue.txt").read_text().splitlines()
    return tuple(one.row for one in read_rows(lines))


def shown(bus: VirtualBus, node: int) -> tuple[QueueRow, ...]:
    screen = QueueScreen.read(bus.node(node).type("q\r"))
    assert screen is not None
    return screen.rows


MOTION = Motion(400, cw=True, rpm=100, cycle_us=3000, acc100=100, dec100=100, linear=False)

# ----------------------------------------------------------------------------------- put


def rows_of_all_sorts() -> tuple[QueueRow, ...]:
    """Thirty rows, no two alike, with every field at work."""
    return tuple(
        QueueRow(
            position,
            Motion(
                None if position == 17 else position * 97,
                cw=position % 2 == 0,
                rpm=300_000 // (500 * position),
                cycle_us=500 * position,
                acc100=position * 33,
                dec100=99_900 if position % 5 == 0 else position * 7,
                linear=position % 3 == 0,
                extra_pulses=position * 8,
                wait_us=position * 1_000_003,
                sync=position % 4 == 0,
                pulses=position % 6 == 0,
            ),
        )
        for position in range(1, 31)
    )


@pytest.mark.asyncio
@pytest.mark.parametrize("rows", [companion(), rows_of_all_sorts()])
async def test_thirty_rows_are_in_the_node_as_they_are_in_the_file(
    bus: VirtualBus, mother: Mother, rows: tuple[QueueRow, ...]
) -> None:
    told: list[int] = []
    edits = await put_queue(mother, 10, rows, progress=told.append)
    assert list(differences(shown(bus, 10), rows)) == []
    assert shown(bus, 10)[: len(rows)] == rows
    assert told == list(range(1, len(rows) + 1))
    assert mother.statistics[10].sent == edits
    # Nothing runs by it, and nothing waits.
    assert bus.node(10).state == "STANDBY"
    assert bus.node(10).pulses == 0


@pytest.mark.asyncio
async def test_what_a_file_does_not_name_stays_and_it_is_saved_if_that_is_asked(
    bus: VirtualBus, mother: Mother
) -> None:
    await mother.send(10, "q7m77")
    await put_queue(mother, 10, [QueueRow(6, MOTION), QueueRow(8, MOTION)], save=True)
    assert [row.motion.steps for row in shown(bus, 10)[5:8]] == [400, 77, 400]
    bus.node(10).power(on=False)
    bus.node(10).power(on=True)
    await bus.expected(node=10, state="STANDBY", within="5 s")
    assert [row.motion.steps for row in shown(bus, 10)[5:8]] == [400, 77, 400]


@pytest.mark.asyncio
@pytest.mark.sacbus(nodes={10: {"dir": True, "sprf": 400}})
async def test_the_nodes_own_default_direction_and_sprf_are_allowed_for(
    bus: VirtualBus, mother: Mother
) -> None:
    defaults = Defaults(cw=True, sprf=400)
    first = replace(MOTION, cycle_us=1_500)
    assert defaults.cycle_of(100) == 1_500
    await put_queue(mother, 10, [QueueRow(1, first)], defaults=defaults)
    assert not shown(bus, 10)[0].motion.cw
    await put_queue(mother, 10, [QueueRow(1, first)], defaults=replace(defaults, cw=False))
    assert shown(bus, 10)[0].motion == first


@pytest.mark.asyncio
@pytest.mark.parametrize(
    ("rows", "told"),
    [
        (
            [QueueRow(1, MOTION), QueueRow(31, MOTION)],
            "a node has no queue position 31, only 1 to 30, row 2, give it another, or stream",
        ),
        (
            [QueueRow(4, MOTION), QueueRow(5, MOTION), QueueRow(4, MOTION)],
            "queue position 4 is there twice, row 3, give each row a position of its own",
        ),
        (
            [QueueRow(4, replace(MOTION, acc100=0))],
            "expected an acceleration of 0.01 to 999, .*, row 1, change it",
        ),
    ],
)
async def test_what_no_queue_can_hold_is_refused_before_anything_is_sent(
    mother: Mother, rows: list[QueueRow], told: str
) -> None:
    with pytest.raises(RowRefused, match=told):
        await put_queue(mother, 10, rows)
    assert not mother.statistics


@pytest.mark.asyncio
async def test_a_put_to_nobody_fails(mother: Mother) -> None:
    with pytest.raises(NoAnswer, match="node 99"):
        await put_queue(mother, 99, [QueueRow(4, MOTION)])


# ------------------------------------------------------------------------------- compared


def test_a_queue_that_is_as_it_should_be_differs_in_nothing() -> None:
    rows = rows_of_all_sorts()
    assert list(differences(rows, rows)) == []
    assert list(differences(rows, rows[3:7])) == []


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("steps", None, "position 9: steps 0, expected 400"),
        ("cw", False, "position 9: direction CCW, expected CW"),
        ("pulses", True, "position 9: steps in pulses, expected full steps"),
        ("rpm", 99, "position 9: RPM 99, expected 100"),
        ("cycle_us", 3001, "position 9: cycle 3001, expected 3000"),
        ("linear", True, "position 9: ramp linear, expected harmonic"),
        ("acc100", 150, "position 9: acc 1.5, expected 1"),
        ("dec100", 99_900, "position 9: dec 999, expected 1"),
        ("extra_pulses", 5, "position 9: extra pulses 5, expected 0"),
        ("sync", True, "position 9: sync on, expected off"),
        ("wait_us", 20, "position 9: start wait 20, expected 0"),
    ],
)
def test_every_field_that_differs_is_told(field: str, value: object, told: str) -> None:
    changed: dict[str, object] = {field: value}
    got = replace(MOTION, **changed)  # type: ignore[arg-type]  # fields by name, of any type
    assert [str(one) for one in differences([QueueRow(9, got)], [QueueRow(9, MOTION)])] == [told]


def test_a_position_that_is_not_there_is_told() -> None:
    (one,) = differences([], [QueueRow(9, MOTION)])
    assert str(one) == "position 9: row none, expected one"


# -------------------------------------------------------------------------------- changed


@pytest.mark.parametrize("name", ["companion-queue.txt", "companion-queue-14-fields.txt"])
def test_a_file_is_read_and_written_one_to_one(name: str) -> None:
    content = (DATA / name).read_bytes().decode()
    form = Form.OLDER if "14" in name else Form.PRESENT
    file = QueueFile.read(content.splitlines(), name)
    assert len(file) == len(file.rows) > 2
    assert list(file.lines(form)) == content.splitlines(keepends=True)


def test_rows_are_changed_added_and_taken_out() -> None:
    file = QueueFile(companion())
    before, count = file[1], len(file)
    assert file.edit(1, "m-2000vc1500a.5") == replace(
        before, steps=2000, cw=False, rpm=200, cycle_us=1500, acc100=50
    )
    file[31] = file[1]
    del file[2]
    assert len(file) == count
    assert 2 not in [row.position for row in file.rows]
    assert file.rows[-1] == QueueRow(31, file[1])
    again = QueueFile.read(list(file.lines()))
    assert again.rows == file.rows
    with pytest.raises(KeyError):
        file[2]


def test_a_position_that_is_new_is_edited_as_that_of_a_new_node() -> None:
    file = QueueFile(defaults=Defaults(sprf=400))
    motion = file.edit(50, "v60s")
    assert (motion.steps, motion.rpm, motion.cycle_us, motion.sync) == (400, 60, 2_500, True)


@pytest.mark.parametrize("edit", ["", "q", "nonsense", "m400v0", "a99999", "5m400"])
def test_an_edit_that_a_node_would_not_take_as_it_stands_is_refused(edit: str) -> None:
    file = QueueFile(companion())
    before = file.rows
    with pytest.raises(BadRequest, match="queue position 9: expected an edit such as m400v120"):
        file.edit(9, edit)
    assert file.rows == before


def test_positions_that_are_none_or_twice_are_refused() -> None:
    with pytest.raises(BadRequest, match="queue position 0: expected 1 or more"):
        QueueFile()[0] = MOTION
    with pytest.raises(RowRefused, match="queue position 4 is there twice, row 2"):
        QueueFile([QueueRow(4, MOTION)] * 2)


def test_what_is_no_row_is_told_by_line_and_column() -> None:
    with pytest.raises(WrongRow, match=r"queue\.csv line 2 column"):
        QueueFile.read(
            [" 1 , 800 , 0 , 1 , 100 , 3000 , 0 , 1 , 1 , 0 , 0 , 0 ", "nonsense"], "queue.csv"
        )
