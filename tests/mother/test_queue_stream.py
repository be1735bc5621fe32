"""Rows without number run in order and without a stop, through thirty positions of a queue."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from sacbus import Mother
from sacbus.bus import Transmission
from sacbus.kernel import MS, SECOND
from sacbus.language import Motion, Session, parse
from sacbus.language.commands import Move
from sacbus.mother import LineLost, NoAnswer, Stopped
from sacbus.mother.queue_file import RowRefused
from sacbus.mother.queue_stream import LostTrack, QueueStream
from sacbus.motion import REST, Drive, Left, begin, plan
from sacbus.node import Report, ReportKind
from sacbus.testing import VirtualBus

pytestmark = pytest.mark.asyncio


def motion(line: str) -> Motion:
    command = parse(line).command
    assert isinstance(command, Move)
    return Session().resolve(command)[0]


def seamless(count: int, steps: int = 40) -> list[Motion]:
    """Rows that leave their velocity to the next, all different, and the last one stops."""
    rows = [motion(f"m{steps + n % 7}v{60 + n * 7 % 50}a2d999") for n in range(count - 1)]
    return [*rows, motion("m200v60a2d2")]


def mixed(count: int) -> list[Motion]:
    """Rows of all sorts: back and forth, waits, linear ramps, pulses, stops between them."""
    lines = (
        "m50v120",
        "m-40v90a3d3",
        "m30v60t20000",
        "m80v150l1a20d20",
        "m33v40u5",
        "m20v300a9d9p",
    )
    return [motion(lines[n % len(lines)]) for n in range(count)]


def planned(rows: list[Motion], drive: Drive | None = None) -> tuple[np.ndarray, int]:
    """All pulses, ns from the first one, and when the last period is over."""
    drive = drive or Drive()
    left, end, parts = REST, 0, []
    for row in rows:
        beginning = begin(row, left, end)
        profile = plan(row, drive, beginning.start_rpm)
        assert profile.duration is not None
        parts.append(beginning.start + profile.pulse_times(0, profile.duration))
        left, end = Left.by(profile), beginning.start + profile.duration
    pulses = np.concatenate(parts)
    return (pulses - pulses[0]) * 500, (end - int(pulses[0])) * 500


async def streamed(
    bus: VirtualBus, mother: Mother, rows: list[Motion], drive: Drive | None = None
) -> tuple[QueueStream, np.ndarray]:
    """Stream them into node 10: the stream, and the node's pulses, ns from the first one."""
    stream = QueueStream(mother, 10, drive=drive)
    await stream.run(rows)
    pulses = bus.track(10).pulses(0, bus.now)
    return stream, pulses - pulses[0]


@pytest.mark.parametrize("kind", [seamless, mixed])
async def test_two_hundred_rows_run_as_they_are_planned(
    bus: VirtualBus, mother: Mother, kind: type
) -> None:
    rows = kind(200)
    reports: list[Report] = []
    bus.hosted.bus.report_watchers.append(reports.append)
    stream, pulses = await streamed(bus, mother, rows)
    expected, _end = planned(rows)
    # To the half microsecond: seamless where they should be, never idle, none lost, none twice.
    assert pulses.tolist() == expected.tolist()
    assert (stream.written, stream.done, stream.row, stream.pauses) == (200, 200, 200, 0)
    assert bus.node(10).state == "STANDBY"
    assert bus.counts["timeouts"] == 0
    # What may be reported is that ramps are short, and turns quick: no overrun, nothing ignored.
    assert {one.kind for one in reports} <= {ReportKind.WARNING}


@pytest.mark.parametrize("count", [1, 2, 28, 29, 30, 31, 37, 38, 59, 60, 61])
async def test_any_number_of_rows_comes_to_its_end(
    bus: VirtualBus, mother: Mother, count: int
) -> None:
    rows = mixed(count)
    stream, pulses = await streamed(bus, mother, rows)
    assert pulses.tolist() == planned(rows)[0].tolist()
    assert stream.done == count
    # Behind the end nothing waits: what is released, or told to run, finds nothing.
    await mother.send(10, "y")
    await mother.send(10, "n")
    await asyncio.sleep(60)
    assert bus.node(10).state == "STANDBY"
    assert bus.track(10).pulses(0, bus.now).size == pulses.size


async def test_no_rows_move_nothing(bus: VirtualBus, mother: Mother) -> None:
    stream = QueueStream(mother, 10)
    await stream.run([])
    assert (stream.written, stream.done, stream.row) == (0, 0, 0)
    assert bus.node(10).pulses == 0


async def test_long_rows_are_split_into_several_edits(bus: VirtualBus, mother: Mother) -> None:
    long = replace(
        motion("m20v3000t3000000l1a10.47d10.47u255p"), cycle_us=123_457, rpm=2, steps=1_000
    )
    rows = [
        replace(
            long,
            steps=1_000 + n,
            cycle_us=123_400 + n,
            acc100=1_001 + n,
            dec100=2_099 - n,
            linear=n // 30 % 2 == 0,
            extra_pulses=100 + n,
            wait_us=1_000_000 + n,
            pulses=True,
        )
        for n in range(65)
    ]
    _stream, pulses = await streamed(bus, mother, rows)
    assert pulses.tolist() == planned(rows)[0].tolist()


@pytest.mark.sacbus(nodes={10: {"ustep": 3, "sprf": 400, "slow": 30, "ihd": 20}})
async def test_the_pace_is_that_of_the_nodes_settings(bus: VirtualBus, mother: Mother) -> None:
    drive = Drive(ustep=3, sprf=400, slow_rpm=30, ihd=20)
    rows = [replace(motion(f"m40v{60 + n}d999"), cycle_us=150_000 // (60 + n)) for n in range(70)]
    stream, pulses = await streamed(bus, mother, rows, drive)
    assert pulses.tolist() == planned(rows, drive)[0].tolist()
    assert stream.pauses == 0


@pytest.mark.sacbus(nodes={10: {"ppm": -450}, 11: {"ppm": 450}})
@pytest.mark.parametrize(("node", "ppm"), [(10, -450), (11, 450)])
async def test_a_clock_that_is_off_is_allowed_for(
    bus: VirtualBus, mother: Mother, node: int, ppm: int
) -> None:
    rows = [motion(f"m{50 + n % 7}v60a999d999") for n in range(300)]
    stream = QueueStream(mother, node)
    await stream.run(rows)
    pulses = bus.track(node).pulses(0, bus.now)
    expected = planned(rows)[0] / (1 + ppm / 1e6)
    assert pulses.size == expected.size
    # Each pulse's time is a whole number of ns, and each command's begins with one.
    assert np.abs(pulses - pulses[0] - expected).max() < 500
    assert stream.pauses == 0


@pytest.mark.sacbus(nodes={10: {"ppm": 400}})
async def test_when_nobody_can_tell_any_more_where_the_node_is_it_pauses(
    bus: VirtualBus, mother: Mother
) -> None:
    # 29 rows of 20 ms are 0.6 s ahead; with a clock that may be off by 1 % that is lost in a
    # minute, and found again where the node stands.
    rows = [motion("m4v60a999d999")] * 4_000
    stream = QueueStream(mother, 10, drift_ppm=10_000)
    await stream.run(rows)
    assert bus.node(10).position == 16_000
    assert 1 <= stream.pauses < 20


# ------------------------------------------------------------------- lines that are too slow


async def test_rows_that_are_quicker_than_the_line_pause_and_none_is_lost(
    bus: VirtualBus, mother: Mother
) -> None:
    # 3 to 9 ms each, for which a packet of its own and its ACK take 6 ms, and a 9th another.
    rows = [motion(f"m{1 + n % 3}v{100 + n}a999d999u{n % 200}t{n % 3}") for n in range(120)]
    rows = [replace(row, extra_pulses=0) for row in rows]
    stream, pulses = await streamed(bus, mother, rows)
    assert stream.pauses > 0
    assert pulses.size == sum(row.steps or 0 for row in rows)
    assert bus.node(10).position == pulses.size
    # It stood still, and then went on: as many times as it is told.
    gaps = np.diff(pulses)
    assert int((gaps > 10 * MS).sum()) == stream.pauses
    assert stream.done == 120


async def test_a_line_with_errors_is_made_up_for(bus: VirtualBus, mother: Mother) -> None:
    rows = mixed(100)
    with bus.fault(bit_errors=2e-4):
        stream, pulses = await streamed(bus, mother, rows)
    assert mother.statistics[10].retries > 0
    assert pulses.tolist() == planned(rows)[0].tolist()
    assert stream.pauses == 0


async def test_a_row_that_others_on_the_line_hold_up_stops_the_node_where_it_is(
    bus: VirtualBus, mother: Mother
) -> None:
    rows = [motion(f"m{8 + n}v100a999d999") for n in range(120)]
    sent = itertools.count(1)
    others: list[asyncio.Task[object]] = []

    def crowd(heard: Transmission) -> None:
        # S, $O0, the barrier, 29 rows, LS, LF; the next barrier, and 7 of its 8 rows: the last one
        # of them opens the barrier before, and finds a second of others' packets ahead of it.
        if heard.data[1:3] == b"\x0a\x01" and next(sent) == 34 + 8:
            others.extend(asyncio.ensure_future(mother.send(11, "n")) for _ in range(600))

    bus.hosted.bus.medium.watchers.append(crowd)
    stream = QueueStream(mother, 10)
    with pytest.raises(LostTrack, match="node 10: row 30 was sent, and acknowledged too") as lost:
        await stream.run(rows)
    assert (lost.value.row, stream.written) == (29, 29)
    await asyncio.gather(*others)
    assert bus.node(10).state == "STANDBY"


# --------------------------------------------------------------------------- ended early


async def test_cancelled_it_stops_the_node_and_knows_where(bus: VirtualBus, mother: Mother) -> None:
    rows = [motion("m100v300a999d999")] * 200  # a tenth of a second each
    stream = QueueStream(mother, 10)
    call = asyncio.create_task(stream.run(rows))
    await bus.reached(lambda: bus.node(10).position >= 4_250, within="60 s")
    assert stream.row == 43
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call
    assert stream.stopped
    assert bus.node(10).state == "STANDBY"
    assert bus.node(10).position == pytest.approx(4_250, abs=2)
    await asyncio.sleep(60)
    assert stream.row == 43
    assert bus.node(10).position == pytest.approx(4_250, abs=2)


async def test_a_mother_that_dies_leaves_a_node_that_stands_at_the_end_of_what_it_has(
    bus: VirtualBus, mother: Mother
) -> None:
    rows = [motion(f"m{10 + n}v60a999d999") for n in range(200)]
    stream = QueueStream(mother, 10)
    call = asyncio.create_task(stream.run(rows))
    await bus.reached(lambda: stream.row > 60, within="90 s")
    mother.lose("unplugged")
    with pytest.raises(LineLost):
        await call
    await asyncio.sleep(120)
    assert bus.node(10).state == "SYNC"
    assert bus.node(10).position == sum(row.steps or 0 for row in rows[: stream.written])


@pytest.mark.parametrize("packets", range(36, 60, 3))
async def test_killed_at_any_moment_the_node_never_runs_into_old_rows(
    bus: VirtualBus, packets: int
) -> None:
    rows = [motion(f"m{10 + n}v120a999d999") for n in range(80)]
    mother = bus.hosted.mother()
    sent = itertools.count(1)

    def kill(heard: Transmission) -> None:
        if heard.data[2] == 1 and next(sent) == packets:
            mother.lose("killed")

    bus.hosted.bus.medium.watchers.append(kill)
    with pytest.raises(LineLost, match="killed"):
        await QueueStream(mother, 10).run(rows)
    await asyncio.sleep(120)
    assert bus.node(10).state == "SYNC"
    # Whole rows, beginning with the first, and never less than were there in the beginning.
    wholes = np.cumsum([row.steps or 0 for row in rows]).tolist()
    assert wholes.index(bus.node(10).position) >= 28


async def test_a_node_that_dies_is_told(bus: VirtualBus, mother: Mother) -> None:
    rows = [motion("m100v300a999d999")] * 200
    stream = QueueStream(mother, 10)
    call = asyncio.create_task(stream.run(rows))
    await bus.reached(lambda: stream.row > 40, within="90 s")
    bus.node(10).power(on=False)
    with pytest.raises(NoAnswer, match="node 10"):
        await call
    assert 40 < stream.row < 55


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (
            motion("m"),
            "a continuous command cannot be streamed: it never ends, row 41, give it steps",
        ),
        (motion("m1s"), "a command that is held for sync cannot be streamed: .*, row 41, take"),
        (replace(motion("m1"), wait_us=2**32), "expected a start wait of 0 to .*, row 41"),
    ],
)
async def test_a_row_that_cannot_be_streamed_ends_it(
    bus: VirtualBus, mother: Mother, wrong: Motion, told: str
) -> None:
    rows = [motion("m20v60a999d999")] * 200
    rows[40] = wrong
    with pytest.raises(RowRefused, match=told):
        await QueueStream(mother, 10).run(rows)
    assert bus.node(10).state == "STANDBY"


# ------------------------------------------------------------------------------ the rest


async def test_rows_are_taken_as_they_are_needed(bus: VirtualBus, mother: Mother) -> None:
    taken = 0

    def endless() -> Iterator[Motion]:
        nonlocal taken
        for _ in range(10_000):
            taken += 1
            yield motion("m20v60a999d999")

    stream = QueueStream(mother, 10)
    call = asyncio.create_task(stream.run(endless()))
    await bus.reached(lambda: stream.row == 100, within="60 s")
    assert 100 < taken <= 100 + 38
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call


async def test_who_looks_on_is_told_the_rows_that_are_over(bus: VirtualBus, mother: Mother) -> None:
    told: list[int] = []
    await QueueStream(mother, 10).run(mixed(60), progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 60
    assert max(later - earlier for earlier, later in pairwise(told)) < 10


async def test_what_the_node_did_before_is_stopped_and_its_soft_ops_are_off(
    bus: VirtualBus, mother: Mother
) -> None:
    await mother.send(10, "$O1")
    await mother.send(10, "m20000")
    await mother.send(10, "m20000")
    await asyncio.sleep(1)
    stood = bus.node(10).position
    await QueueStream(mother, 10).run(seamless(40, steps=20))
    assert bus.node(10).position - stood < 2_000
    assert "soft_ops       0" in bus.node(10).type("cf\r")
    assert bus.now < 60 * SECOND


async def test_an_emergency_stop_ends_it_and_nothing_goes_on(
    bus: VirtualBus, mother: Mother
) -> None:
    stream = QueueStream(mother, 10)
    call = asyncio.create_task(stream.run([motion("m100v300a999d999")] * 200))
    await bus.reached(lambda: bus.node(10).position >= 4_250, within="60 s")
    await mother.estop()
    with pytest.raises(Stopped, match="an emergency stop"):
        await call
    stood = bus.node(10).position
    await asyncio.sleep(60)
    assert bus.node(10).position == stood
    assert stream.row == 43
