"""Axes of a group start in the same instant, or not at all, and are over when planned."""

from __future__ import annotations

import asyncio
import itertools
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar, cast

import pytest

from sacbus import Mother, open_bus
from sacbus.bus.fault import FaultOn, Strike
from sacbus.bus.passage import Passage
from sacbus.daemon import Configuration
from sacbus.kernel import MS, SECOND, US
from sacbus.language import Motion
from sacbus.language.queue_screen import QueueScreen
from sacbus.links.places import PtyAt
from sacbus.mother import BadRequest, Member, MotherError, NoAnswer, NotStarted, Refused, Stopped
from sacbus.motion import Drive, plan
from sacbus.testing import VirtualBus

pytestmark = pytest.mark.asyncio


@dataclass(frozen=True)
class Spoilt:
    """Transmissions that begin so arrive with a bit wrong in their fourth byte; ``which`` says how
    many of them: 2, every other one, beginning with the first.
    """

    begins: bytes
    which: int = 1
    name: ClassVar[str] = "spoilt"

    def put_on(self, on: FaultOn) -> Strike:
        met = itertools.count()

        def strike(passage: Passage) -> None:
            if bytes(passage.values[:3]).startswith(self.begins) and not next(met) % self.which:
                passage.values[3] ^= 0x40
                on.acts(passage, 1)

        return strike


def starts(bus: VirtualBus, nodes: list[int]) -> list[int]:
    """When the first pulse of each node was issued, ns of bus time."""
    return [int(bus.track(node).pulses(0, bus.now + 1)[0]) for node in nodes]


def skew(bus: VirtualBus, nodes: list[int]) -> int:
    found = starts(bus, nodes)
    return max(found) - min(found)


# ------------------------------------------------------------------------------ starting


@pytest.mark.parametrize("count", [2, 6])
@pytest.mark.sacbus(nodes="10-15")
async def test_all_start_in_the_same_instant(bus: VirtualBus, mother: Mother, count: int) -> None:
    nodes = list(range(10, 10 + count))
    group = mother.group({f"n{node}": node for node in nodes})
    await group.move({f"n{node}": f"m{node * 10}v{node * 10}" for node in nodes})
    assert [bus.node(node).position for node in nodes] == [node * 10 for node in nodes]
    assert skew(bus, nodes) == 0
    assert mother.statistics[0].sent == 1  # the y


@pytest.mark.sacbus(nodes="10-209")
async def test_two_hundred_axes_start_in_the_same_instant(bus: VirtualBus, mother: Mother) -> None:
    nodes = list(range(10, 210))
    group = mother.group({str(node): node for node in nodes})
    run = await group.move({str(node): f"m20v{node}a2d2" for node in nodes})
    assert len(run.motions) == 200
    # Which reads the recording once, and not for every node.
    await bus.expected(node=tuple(nodes), position=20)
    await bus.expected(node=tuple(nodes), start_skew="0 ns")


@pytest.mark.sacbus(nodes={10: {"ppm": 200}, 11: {"ppm": -300}, 12: {}})
async def test_oscillators_part_what_starts_together_by_as_much_as_they_differ(
    bus: VirtualBus, mother: Mother
) -> None:
    nodes = [10, 11, 12]
    group = mother.group(x=10, y=11, z=12)
    run = await group.start(x="m200v60a999d999", y="m200v60a999d999", z="m200v60a999d999")
    begun = mother.now
    await run.wait()
    # A release is an instant of the line's, and starts no clock.
    assert skew(bus, nodes) == 0
    # The 200 periods of 5 ms take a second by each node's own oscillator.
    last = [int(bus.track(node).pulses(0, bus.now)[-1]) for node in nodes]
    passed = [end - start for end, start in zip(last, starts(bus, nodes), strict=True)]
    assert passed == pytest.approx([995 * MS / (1 + ppm / 1e6) for ppm in (200, -300, 0)], abs=1)

    # With a wait of a second before it the start itself is as far off.
    await group.move(x="m1t1000000", y="m1t1000000", z="m1t1000000")
    first = [int(bus.track(node).pulses(begun + 2 * SECOND, bus.now)[0]) for node in nodes]
    assert first[1] - first[0] == pytest.approx(500 * US, rel=1e-3)
    assert first[2] - first[0] == pytest.approx(200 * US, rel=1e-3)


async def test_staggered_starts_are_waits_from_one_instant(bus: VirtualBus, mother: Mother) -> None:
    run = await mother.group(x=10, y=11, z=12).move(x=40, y="m40t250000", z="m40t1000001")
    first, second, third = starts(bus, [10, 11, 12])
    assert (second - first, third - first) == (250 * MS, SECOND + 1 * US)
    assert run.motions["y"].start == 250 * MS
    assert run.motions["z"].start == SECOND + 1 * US


async def test_an_axis_that_is_not_named_stays_as_it_is(bus: VirtualBus, mother: Mother) -> None:
    group = mother.group(x=10, y=11)
    await group.move(y=-30)
    assert [bus.node(node).position for node in (10, 11)] == [0, -30]


async def test_a_group_may_go_on_from_where_it_stands(bus: VirtualBus, mother: Mother) -> None:
    group = mother.group(x=10, y=11)
    for _ in range(5):
        await group.move(x=400, y="m200v50")
    assert [bus.node(node).position for node in (10, 11)] == [2_000, 1_000]
    assert bus.counts["warnings"] == 0


# ------------------------------------------------------------------------- nobody starts


async def test_a_node_that_is_dead_keeps_all_from_starting(bus: VirtualBus, mother: Mother) -> None:
    bus.node(12).power(on=False)
    with pytest.raises(NotStarted, match=r"nothing was started: node 12: 'q30m400") as failed:
        await mother.group(x=10, y=11, z=12).start(x=400, y=400, z=400)
    assert failed.value.node == 12
    assert isinstance(failed.value.cause, NoAnswer)
    await asyncio.sleep(10)
    assert [node.state for node in bus.nodes.values()] == ["STANDBY", "STANDBY", "OFF"]
    assert [node.position for node in bus.nodes.values()] == [0, 0, 0]
    # Not even when somebody releases what is held.
    await mother.broadcast("y")
    await asyncio.sleep(10)
    assert [node.position for node in bus.nodes.values()] == [0, 0, 0]


async def test_a_node_that_dies_when_others_are_held_has_them_let_go(
    bus: VirtualBus, mother: Mother
) -> None:
    call = asyncio.create_task(mother.group(x=10, y=11, z=12).start(x=400, y=400, z=400))
    await bus.reached(lambda: bus.node(11).state == "SYNC", within="1 s")
    bus.node(12).power(on=False)
    with pytest.raises(NotStarted, match="node 12: 'x30' sent 3 times") as failed:
        await call
    # Whether it had heard the X nobody knows; a dead one holds nothing, but that is not known.
    assert failed.value.still_held == (12,)
    assert [bus.node(node).state for node in (10, 11)] == ["STANDBY", "STANDBY"]
    assert [bus.node(node).position for node in (10, 11)] == [0, 0]


async def test_a_node_that_says_nak_keeps_all_from_starting(
    bus: VirtualBus, mother: Mother
) -> None:
    group = mother.group(x=10, y=11, z=12)
    call = asyncio.create_task(group.start(x=400, y=400, z=400))
    await bus.reached(lambda: bus.node(11).state == "SYNC", within="1 s")
    # From now on every packet to node 12 arrives damaged.
    with bus.fault(Spoilt(b"\x02\x0c")):
        with pytest.raises(NotStarted, match="node 12: 'x30' sent 3 times, last answer NAK") as no:
            await call
        assert isinstance(no.value.cause, Refused)
        assert no.value.still_held == ()
    await mother.broadcast("y")
    await asyncio.sleep(5)
    assert [node.position for node in bus.nodes.values()] == [0, 0, 0]
    assert [node.state for node in bus.nodes.values()] == ["STANDBY"] * 3
    # Once the line is good all is well, with the same group.
    await group.move(x=400, y=400, z=400)
    assert [node.position for node in bus.nodes.values()] == [400] * 3


async def test_lost_acks_are_made_up_for_and_nobody_runs_twice(
    bus: VirtualBus, mother: Mother
) -> None:
    group = mother.group(x=10, y=11)
    with bus.fault(Spoilt(b"\x02\x01\x0a", which=2)):
        await group.move(x=400, y=400)
    assert mother.statistics[10].retries > 0
    assert [bus.node(node).position for node in (10, 11)] == [400, 400]
    assert skew(bus, [10, 11]) == 0


async def test_a_start_that_is_cancelled_leaves_nobody_held(
    bus: VirtualBus, mother: Mother
) -> None:
    call = asyncio.create_task(mother.group(x=10, y=11, z=12).start(x=400, y=400, z=400))
    await bus.reached(lambda: bus.node(11).state == "SYNC", within="1 s")
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call
    assert [node.state for node in bus.nodes.values()] == ["STANDBY"] * 3
    await mother.broadcast("y")
    await asyncio.sleep(5)
    assert [node.position for node in bus.nodes.values()] == [0] * 3


# ------------------------------------------------------------------------------- its end


async def test_a_move_returns_when_all_certainly_stand(bus: VirtualBus, mother: Mother) -> None:
    began = mother.now
    run = await mother.group(x=10, y=11).move(x="m400v120", y="m100v60")
    assert run.done
    assert mother.now == run.over_at
    assert [bus.node(node).state for node in (10, 11)] == ["STANDBY", "STANDBY"]
    # x takes 1.2 s; the line's share and the margin are small beside it.
    longest = run.motions["x"].end
    assert longest == run.motions["x"].profile.duration * 500  # type: ignore[operator]  # it ends
    assert longest < mother.now - began < longest + 100 * MS


@pytest.mark.sacbus(nodes={10: {"ppm": -499}})
async def test_a_slow_oscillator_is_waited_for(bus: VirtualBus, mother: Mother) -> None:
    await mother.group(x=10).move(x="m20000v120a999d999")
    assert (bus.node(10).state, bus.node(10).position) == ("STANDBY", 20_000)


async def test_a_start_returns_at_once_and_its_end_can_be_asked_and_waited_for(
    bus: VirtualBus, mother: Mother
) -> None:
    run = await mother.group(x=10).start(x=400)
    over = [run.done]
    assert bus.node(10).state != "STANDBY"
    waiting = asyncio.create_task(run.wait())
    await asyncio.sleep(0.1)
    waiting.cancel()
    await run.wait()
    assert [*over, run.done] == [False, True]
    assert bus.node(10).position == 400


async def test_a_move_that_is_cancelled_stops_its_axes(bus: VirtualBus, mother: Mother) -> None:
    await mother.send(12, "m")
    call = asyncio.create_task(mother.group(x=10, y=11, z=12).move(x=4_000, y=4_000))
    await asyncio.sleep(2)
    call.cancel()
    with pytest.raises(asyncio.CancelledError):
        await call
    assert [node.state for node in bus.nodes.values()] == ["STANDBY", "STANDBY", "CRUISE"]


async def test_a_group_can_be_stopped(bus: VirtualBus, mother: Mother) -> None:
    group = mother.group(x=10, y=11, z=12)
    await group.start(x=4_000, y=4_000)
    bus.node(11).power(on=False)
    with pytest.raises(NoAnswer, match="node 11: 'S'"):
        await group.stop()
    assert [node.state for node in bus.nodes.values()] == ["STANDBY", "OFF", "STANDBY"]


async def test_every_axis_that_does_not_acknowledge_its_stop_is_sent_it_once_more(
    bus: VirtualBus, mother: Mother
) -> None:
    group = mother.group(x=10, y=11, z=12)
    await group.start(x=4_000, y=4_000, z=4_000)
    for node in (10, 12):
        bus.node(node).power(on=False)
    with pytest.raises(NoAnswer, match="node 10: 'S'"):
        await group.stop()
    assert bus.node(11).state == "STANDBY"
    assert [mother.statistics[node].timeouts for node in (10, 11, 12)] == [6, 0, 6]


@pytest.mark.parametrize("moment", [0.001, 0.01, 0.02, 0.03, 0.034, 0.0365, 0.039])
async def test_an_emergency_stop_before_the_release_lets_nobody_start(
    bus: VirtualBus, mother: Mother, moment: float
) -> None:
    call = asyncio.create_task(mother.group(x=10, y=11, z=12).start(x=400, y=400, z=400))
    await asyncio.sleep(moment)
    await mother.estop()
    # What it tells is what became of the call that was out then: its ACK may have met the S.
    with pytest.raises(MotherError, match=r"nothing was started|an emergency stop came"):
        await call
    await mother.broadcast("y")
    await asyncio.sleep(10)
    assert [node.position for node in bus.nodes.values()] == [0, 0, 0]


@pytest.mark.parametrize("moment", [0.0001, 0.001, 0.0015, 0.0025])
async def test_an_emergency_stop_that_meets_the_release_is_told(
    bus: VirtualBus, mother: Mother, moment: float
) -> None:
    call = asyncio.create_task(mother.group(x=10, y=11).move(x=4_000, y=4_000))
    await bus.reached(lambda: mother.statistics[0].sent > 0, within="1 s")  # y
    await asyncio.sleep(moment)
    await mother.estop()
    with pytest.raises(Stopped, match="an emergency stop came first"):
        await call
    assert [bus.node(node).state for node in (10, 11)] == ["STANDBY", "STANDBY"]
    assert bus.node(10).position < 4_000


async def test_an_emergency_stop_ends_a_move(bus: VirtualBus, mother: Mother) -> None:
    run = await mother.group(x=10, y=11).start(x=4_000, y=4_000)
    waiting = asyncio.create_task(run.wait())
    await asyncio.sleep(1)
    await mother.estop()
    with pytest.raises(
        Stopped, match="an emergency stop came first: the motion is not over; begin again"
    ):
        await waiting
    with pytest.raises(Stopped):
        await run.wait()
    assert [bus.node(node).state for node in (10, 11)] == ["STANDBY", "STANDBY"]


@pytest.mark.sacbus(nodes={10: {"ustep": 3, "sprf": 400, "slow": 30, "ihd": 20}})
async def test_commands_are_planned_by_the_settings_of_the_node(
    bus: VirtualBus, mother: Mother
) -> None:
    drive = Drive(ustep=3, sprf=400, slow_rpm=30, ihd=20)
    run = await mother.group(x=Member(10, drive)).start(x="m400v60a1d1")
    until = run.release.earliest + 10 * SECOND
    await mother.until(until)
    pulses = bus.track(10).pulses(0, until)
    assert pulses.size == 3_200
    planned = run.motions["x"]
    assert planned.profile.duration == plan(planned.motion, drive).duration
    assert (pulses - pulses[0]).tolist() == [
        500 * ticks for ticks in planned.profile.pulse_times(0, planned.end // 500).tolist()
    ]


# ------------------------------------------------------------- other releases, other clocks


async def test_a_group_is_released_by_the_shared_sync_line(bus: VirtualBus, mother: Mother) -> None:
    line = bus.hosted.shared_line("sync", [10, 11])
    await mother.group(x=10, y=11).move(x=40, y="m40t250000", release=line.pull)
    first, second = starts(bus, [10, 11])
    assert second - first == 250 * MS
    assert mother.statistics[0].sent == 0  # no y


async def test_a_release_may_be_a_coroutine_function(bus: VirtualBus, mother: Mother) -> None:
    line = bus.hosted.shared_line("sync", [10, 11])

    async def pull() -> None:
        await asyncio.sleep(1)
        line.pull()

    await mother.group(x=10, y=11).move(x=40, y=40, release=pull)
    assert skew(bus, [10, 11]) == 0
    assert starts(bus, [10])[0] > SECOND


async def test_a_release_that_fails_leaves_nobody_held(bus: VirtualBus, mother: Mother) -> None:
    def broken() -> None:
        raise OSError("the output is gone")

    with pytest.raises(OSError, match="the output is gone"):
        await mother.group(x=10, y=11).move(x=40, y=40, release=broken)
    assert [bus.node(node).state for node in (10, 11)] == ["STANDBY", "STANDBY"]


@pytest.mark.sacbus(nodes={10: {"ppm": 200}, 11: {"ppm": -300}})
async def test_on_a_common_clock_they_stay_together(bus: VirtualBus, mother: Mother) -> None:
    clock = bus.hosted.shared_line("xclk", [10, 11])
    clock.drive(1_000_000)
    group = mother.group(x=10, y=11)
    await group.use_common_clock()
    run = await group.start(x="m200v60t1000000", y="m200v60t1000000")
    await run.wait()
    x, y = (bus.track(node).pulses(0, bus.now) for node in (10, 11))
    assert x.size == 200
    assert x.tolist() == y.tolist()
    await group.use_common_clock(on=False)
    later = bus.now
    await group.move(x="m200v60t1000000", y="m200v60t1000000")
    x, y = (bus.track(node).pulses(later, bus.now) for node in (10, 11))
    assert y[0] - x[0] == pytest.approx(500 * US, rel=1e-3)


# ------------------------------------------------------------------------- in real time


@pytest.mark.slow
async def test_over_a_pty_in_real_time_it_is_the_same(tmp_path: Path) -> None:
    nodes = (10, 11, 12)
    configuration = Configuration(nodes=nodes, links=(PtyAt(tmp_path / "line"),))
    async with open_bus(configuration) as hosted:
        begun: dict[int, int] = {}

        def note(node: int, pin: str, level: int, when: int) -> None:
            if (pin, level) == ("op_sa", 1):
                begun[node] = when

        for node in nodes:
            hosted.panel(node).watch(partial(note, node))
        async with Mother.connect(str(tmp_path / "line")) as mother:
            group = mother.group(x=10, y=11, z=12)
            run = await group.move(x="m20v120", y="m-20v120", z="m20v120t100000")
        assert [one.position_steps for one in hosted.snapshots()] == [20, -20, 20]
        assert [one.state for one in hosted.snapshots()] == ["STANDBY"] * 3
        assert begun[11] == begun[10]
        assert begun[12] - begun[10] == 100 * MS
        assert run.done


# ------------------------------------------------------------------- what cannot be asked


async def test_what_no_group_can_be_is_refused(mother: Mother) -> None:
    with pytest.raises(BadRequest, match="a group without axes"):
        mother.group()
    with pytest.raises(BadRequest, match="axes x and y: expected a node each, got node 10"):
        mother.group(x=10, y=Member(10))
    with pytest.raises(BadRequest, match="node 3: expected an address from 4 to 255"):
        mother.group(x=3)


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("v100", "axis x: expected a motion command such as m400v120, got 'v100'"),
        ("m400q", "axis x: expected a motion command such as m400v120, got 'm400q': "),
        ("85m400", "axis x: expected a motion command"),
        ("m400v0", "expected the velocity in RPM, at least 1"),
        ("m", "axis x: expected a motion with an end, got a continuous one"),
        (0, "axis x: expected steps other than 0; leave out an axis that is to stand"),
        (400.0, "axis x: expected a line, whole steps or a Motion, got 400.0, float"),
        (None, "axis x: expected a line, whole steps or a Motion, got None, NoneType"),
        (2**32, "queue position 30: expected steps of 0 to 4294967295"),
    ],
)
async def test_what_no_axis_can_do_is_refused_and_nothing_is_sent(
    mother: Mother, command: object, told: str
) -> None:
    with pytest.raises(BadRequest, match=told):
        await mother.group(x=10, y=11).start(y=400, x=cast("int", command))
    assert not mother.statistics


async def test_an_axis_that_is_not_in_the_group_is_refused(mother: Mother) -> None:
    with pytest.raises(BadRequest, match="axis z: expected one of this group, x, y"):
        await mother.group(x=10, y=11).start(z=400)
    with pytest.raises(BadRequest, match="a group that is told nothing"):
        await mother.group(x=10, y=11).start()


async def test_a_motion_with_every_value_is_taken_as_it_is(bus: VirtualBus, mother: Mother) -> None:
    motion = Motion(40, cw=False, rpm=99, cycle_us=3001, acc100=50, dec100=60, linear=True)
    run = await mother.group(x=10).move(x=motion)
    assert bus.node(10).position == -40
    assert run.motions["x"].motion.cycle_us == 3001
    screen = QueueScreen.read(bus.node(10).type("q\r"))
    assert screen is not None
    assert screen.rows[29].motion == run.motions["x"].motion == replace(motion, sync=True)
