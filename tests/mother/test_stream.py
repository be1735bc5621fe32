"""Blocks run in the nodes as they were planned, one after the other, whatever the line does."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterable, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from itertools import pairwise
from random import Random
from typing import Any

import pytest

from sacbus import Mother, open_bus
from sacbus.bus import Port
from sacbus.configuration import NodeAt
from sacbus.daemon import Configuration, HostedBus
from sacbus.host import run_virtual
from sacbus.kernel import MS, SECOND, Kernel
from sacbus.mother import NoAnswer, Stream, StreamBroken, Streamed
from sacbus.mother.stream import AHEAD
from sacbus.node import Heard, Report, ReportKind
from sacbus.toolpath import Block
from sacbus.trace import Recorder, Recording
from sacbus.wire import MOTHER, encode
from tests.mother.blocks import Commands, block, machine, totals

NODES = (10, 11, 12)
Play = Callable[[HostedBus, Mother], Coroutine[Any, Any, None]]


@dataclass
class Scene:
    """A bus in virtual time that is recorded."""

    ppm: dict[int, int] = field(default_factory=dict)
    reports: list[Report] = field(default_factory=list)
    recording: Recording | None = None

    def play(self, play: Play) -> Scene:
        sink = BytesIO()

        async def scene() -> None:
            nodes = tuple(NodeAt(node, "sac", {"ppm": self.ppm.get(node, 0)}) for node in NODES)
            async with open_bus(Configuration(nodes=nodes)) as bus:
                bus.bus.report_watchers.append(self.reports.append)
                with Recorder(bus, sink):
                    await play(bus, bus.mother())

        run_virtual(Kernel(), scene())
        self.recording = Recording(sink)
        return self

    def commands(self, node: int) -> list[tuple[int, int, str]]:
        """What a node ran: when each began and ended, and which it was."""
        assert self.recording is not None
        found: list[tuple[int, int, str]] = []
        for segment in self.recording.track(node).segments:
            if segment.started is not None:
                assert segment.end is not None
                found.append((segment.started, segment.end, segment.command))
        return found

    def releases(self) -> list[int]:
        """When each y took effect: with its CRC, a byte before its end."""
        assert self.recording is not None
        return [
            one.end - 260_416 for one in self.recording.packets() if b"\x00\x01y" in one.sent.data
        ]


def some_blocks(count: int, seed: int, *, whole: bool = False) -> list[Block]:
    """Blocks of one to 29 commands for each axis, or for some."""
    random = Random(seed)
    made = []
    for number in range(count):
        commands: dict[int, Commands] = {
            axis: [
                (random.choice((1, 1, -1)) * random.randint(5, 20), random.randint(2_500, 6_000))
                for _ in range(random.choice((1, 2, 5, 14, 29)))
            ]
            for axis in range(len(NODES))
            if whole or random.random() < 0.7
        }
        made.append(block(commands, lines=(number + 1, number + 1)))
    return made


def positions(bus: HostedBus) -> list[float]:
    return [one.position_steps for one in bus.snapshots()]


def check_that_all_ran_as_planned(
    scene: Scene, blocks: Iterable[Block], *, ppm: bool = False
) -> None:
    """Every command, in order, and at its time after the release of its block."""
    ran = {axis: iter(scene.commands(node)) for axis, node in enumerate(NODES)}
    for planned, released in zip(
        [one for one in blocks if one.runs], scene.releases(), strict=True
    ):
        for run in planned.runs:
            node = NODES[run.axis]
            slower = 1 / (1 + scene.ppm.get(node, 0) * 1e-6)
            for motion, start in zip(run.motions, run.starts, strict=True):
                began, _, command = next(ran[run.axis])
                sign = "" if motion.cw else "-"
                assert command.startswith(f"m{sign}{motion.steps}v")
                # To the ns, but for the rounding of a clock that is off.
                assert began - released == pytest.approx(
                    start * 500 * slower, abs=1000 if ppm else 0
                )
    assert [list(rest) for rest in ran.values()] == [[], [], []]


@pytest.mark.parametrize("seed", range(4))
def test_every_command_runs_at_its_time_however_often_the_queues_go_round(seed: int) -> None:
    blocks = some_blocks(12, seed)
    came_to: list[Streamed] = []

    async def play(bus: HostedBus, mother: Mother) -> None:
        stream = Stream(mother, machine(*NODES), progress=came_to.append)
        streamed = await stream.run(blocks)
        assert positions(bus) == totals(blocks, 3)
        assert list(streamed.positions.values()) == totals(blocks, 3)
        assert [one.state for one in bus.snapshots()] == ["STANDBY"] * 3
        assert (streamed.blocks, streamed.over) == (len(blocks), True)
        assert streamed.commands == sum(len(run.motions) for one in blocks for run in one.runs)
        assert streamed.moving == sum(one.duration for one in blocks) * 500

    scene = Scene().play(play)
    check_that_all_ran_as_planned(scene, blocks)
    assert {one.kind for one in scene.reports} <= {ReportKind.WARNING}
    assert {one.text.split(" from ")[0] for one in scene.reports} <= {"turns at once"}
    assert [one.blocks for one in came_to] == list(range(1, len(blocks) + 1))


def test_clocks_that_are_off_put_nobody_out_of_step() -> None:
    # Twenty seconds, in which they part by 9 ms; and shorter ones, which would go wrong then.
    long = block({axis: [(40, 20_000)] * 25 for axis in range(3)})
    blocks = [long, *some_blocks(6, 7, whole=True), long, *some_blocks(3, 8, whole=True)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        await mother.run(blocks, machine(*NODES))
        assert positions(bus) == totals(blocks, 3)

    scene = Scene({10: 450, 12: -450}).play(play)
    check_that_all_ran_as_planned(scene, blocks, ppm=True)


def test_an_axis_runs_on_from_command_to_command_without_a_rest() -> None:
    commands = [(40, 3000), (30, 4000), (40, 3000)] * 9
    blocks = [block({0: commands, 1: commands}) for _ in range(4)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        streamed = await Stream(mother, machine(*NODES)).run(blocks)
        assert streamed.late == 0
        assert 3 * 5 * MS < streamed.barriers < 3 * 15 * MS
        assert streamed.deepest == 30

    scene = Scene().play(play)
    assert scene.recording is not None
    states = [state for _, state in scene.recording.track(10).states()]
    assert states == ["STANDBY", *["SYNC", "CRUISE"] * 4, "SYNC", "STANDBY"]
    # Within a block each command begins in the very instant in which the one before ends.
    ran = scene.commands(11)
    joints = [here[1] == there[0] for here, there in pairwise(ran)]
    assert joints.count(False) == 3


def test_blocks_that_are_shorter_than_what_the_line_carries_wait_and_are_counted() -> None:
    blocks = [block({0: [(1, 500)] * 20, 1: [(2, 500)] * 20}) for _ in range(3)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        streamed = await Stream(mother, machine(*NODES)).run(blocks)
        assert positions(bus) == [60, 120, 0]
        assert streamed.late == 2
        assert streamed.late_by > 2 * 100 * MS

    check_that_all_ran_as_planned(Scene().play(play), blocks)


def test_the_plan_is_taken_as_far_ahead_as_there_is_use_for_it() -> None:
    taken = 0

    def planned() -> Iterator[Block]:
        nonlocal taken
        for _ in range(60):
            taken += 1
            yield block({0: [(10, 3000)]})

    async def play(bus: HostedBus, mother: Mother) -> None:
        ahead: list[int] = []
        stream = Stream(
            mother, machine(*NODES), progress=lambda come: ahead.append(taken - come.blocks)
        )
        await stream.run(planned())
        assert 1 <= max(ahead) <= AHEAD
        assert positions(bus) == [600, 0, 0]

    Scene().play(play)


def test_dwells_and_halts_are_kept_between_the_blocks_they_stand_between() -> None:
    told: list[tuple[str, bool, float, list[float]]] = []
    blocks = [
        block({}, halts=(("spindle on", False),)),
        block({0: [(100, 3000)]}, dwell=2.5),
        block({0: [(100, 3000)]}, halts=(("turn it over", True),)),
        block({0: [(-100, 3000)], 1: [(50, 3000)]}),
    ]

    async def play(bus: HostedBus, mother: Mother) -> None:
        async def halt(text: str, waits: bool) -> None:
            now = asyncio.get_running_loop().time()
            told.append((text, waits, now, positions(bus)))
            if waits:
                await asyncio.sleep(30)

        streamed = await Stream(mother, machine(*NODES), halt=halt).run(blocks)
        assert positions(bus) == [100, 50, 0]
        assert streamed.dwelling == 2_500 * MS
        assert 30 * SECOND <= streamed.halted <= 30 * SECOND + MS

    scene = Scene().play(play)
    assert [(text, waits, at) for text, waits, _, at in told] == [
        ("spindle on", False, [0, 0, 0]),
        ("turn it over", True, [200, 0, 0]),
    ]
    check_that_all_ran_as_planned(scene, blocks)
    first, second, third = scene.releases()
    assert 2.8 * SECOND <= second - first <= 2.82 * SECOND
    assert third - second >= 30 * SECOND


def test_a_node_that_dies_stops_all_at_the_end_of_the_block() -> None:
    blocks = some_blocks(12, 5, whole=True)

    async def play(bus: HostedBus, mother: Mother) -> None:
        def watch(come: Streamed) -> None:
            if come.blocks == 4:
                bus.panel(12).power(on=False)

        stream = Stream(mother, machine(*NODES), progress=watch)
        with pytest.raises(StreamBroken, match=r"node 12: .* may still wait for a y") as broken:
            await stream.run(blocks)
        streamed = broken.value.streamed
        assert isinstance(broken.value.cause, NoAnswer)
        assert broken.value.unsure == (12,)
        assert (streamed.blocks, streamed.over, streamed.lines) == (4, True, (4, 4))
        assert positions(bus)[:2] == totals(blocks[:4], 3)[:2]
        assert [streamed.positions[name] for name in "XY"] == totals(blocks[:4], 3)[:2]
        # Nothing is left that a y could start.
        await mother.broadcast("y")
        await asyncio.sleep(10)
        assert positions(bus)[:2] == totals(blocks[:4], 3)[:2]

    Scene().play(play)


def test_a_stream_that_is_cancelled_stops_the_machine_at_once() -> None:
    blocks = [block({0: [(100, 3000)] * 20, 1: [(200, 1500)] * 20}, lines=(3, 9))]

    async def play(bus: HostedBus, mother: Mother) -> None:
        stream = Stream(mother, machine(*NODES))
        running = asyncio.create_task(stream.run(blocks))
        await asyncio.sleep(3)
        running.cancel()
        with pytest.raises(asyncio.CancelledError):
            await running
        assert [one.state for one in bus.snapshots()] == ["STANDBY"] * 3
        assert 0 < positions(bus)[0] < 2000
        assert "lines 3 to 9, on the way to X 2000, Y 4000, Z 0 steps" in stream.streamed.where()

    Scene().play(play)


def test_a_plan_that_fails_is_run_as_far_as_it_was_made() -> None:
    blocks = some_blocks(4, 2, whole=True)

    def planned() -> Iterator[Block]:
        yield from blocks
        raise RuntimeError("no further")

    async def play(bus: HostedBus, mother: Mother) -> None:
        stream = Stream(mother, machine(*NODES))
        with pytest.raises(RuntimeError, match="no further"):
            await stream.run(planned())
        come = stream.streamed
        assert come.over
        assert positions(bus) == totals(blocks[: come.blocks], 3)
        assert [one.state for one in bus.snapshots()] == ["STANDBY"] * 3

    Scene().play(play)


def test_a_block_that_no_queue_holds_is_refused() -> None:
    async def play(bus: HostedBus, mother: Mother) -> None:
        with pytest.raises(ValueError, match="expected at most 29 commands for an axis, got 30"):
            await Stream(mother, machine(*NODES)).run([block({0: [(1, 3000)] * 30})])
        assert positions(bus) == [0, 0, 0]

    Scene().play(play)


def far_mother(
    bus: HostedBus, late: int, sent: Callable[[bytes], object] = lambda _: None
) -> Mother:
    """Mother at the far end of a link that is late both ways; ``sent`` is told what she says."""
    kernel = bus.host.kernel

    def hear(heard: Heard, _now: int) -> None:
        kernel.at(kernel.now + late, mother.caller.hear, heard.data)

    def send(data: bytes) -> None:
        kernel.at(kernel.now + late, port.talk, data)
        sent(data)

    port = Port(bus.bus.medium, hear, latency=0, name="far")
    mother = Mother(kernel, send, slack=10 * MS + 2 * late, arrive=bus.host.arrive)
    return mother


def test_a_link_that_is_late_both_ways_puts_nobody_out_of_step() -> None:
    blocks = some_blocks(8, 11)

    async def play(bus: HostedBus, _: Mother) -> None:
        await Stream(far_mother(bus, 40 * MS), machine(*NODES)).run(blocks)
        assert positions(bus) == totals(blocks, 3)

    check_that_all_ran_as_planned(Scene().play(play), blocks)


def test_a_release_that_a_link_holds_up_puts_nobody_out_of_step() -> None:
    # Too short to be told twice.
    blocks = [block({axis: [(20, 7000)] * 2 for axis in range(2)}) for _ in range(6)]

    async def play(bus: HostedBus, _: Mother) -> None:
        kernel = bus.host.kernel
        free_at = released = 0

        def send(data: bytes) -> None:
            nonlocal free_at, released
            if data[1] == 0:
                released += 1
                if released % 2:
                    free_at = kernel.now + 50 * MS
            # What follows right behind a broadcast would meet nodes that are deaf.
            free_at = max(free_at + 4 * MS, kernel.now)
            kernel.at(free_at, port.talk, data)

        port = Port(
            bus.bus.medium, lambda heard, _: mother.caller.hear(heard.data), latency=0, name="far"
        )
        mother = Mother(kernel, send, slack=100 * MS, arrive=bus.host.arrive)
        await Stream(mother, machine(*NODES)).run(blocks)
        assert positions(bus) == totals(blocks, 3)

    check_that_all_ran_as_planned(Scene().play(play), blocks)


def test_a_line_that_loses_packets_and_answers_changes_nothing_but_time() -> None:
    blocks = some_blocks(8, 13, whole=True)

    async def play(bus: HostedBus, _: Mother) -> None:
        random = Random(1)
        kernel = bus.host.kernel

        def disturb(data: bytes) -> None:
            # The packet or its answer. A y that is lost cannot be found out: the line is good then.
            if data[1] and random.random() < 0.06:
                over = mother.rate.span(len(data)) + 1 * MS
                kernel.at(
                    kernel.now + random.randrange(over),
                    bus.bus.medium.transmit,
                    "stranger",
                    b"\x55",
                    0,
                )

        mother = far_mother(bus, 0, disturb)
        await Stream(mother, machine(*NODES)).run(blocks)
        assert positions(bus) == totals(blocks, 3)
        assert sum(one.retries for one in mother.statistics.values()) > 5

    check_that_all_ran_as_planned(Scene().play(play), blocks)


def test_an_axis_that_has_not_heard_the_release_starts_late_and_is_in_step_afterwards() -> None:
    blocks = [block({axis: [(40, 3000)] * 10 for axis in range(3)}) for _ in range(6)]
    sent = 0

    async def play(bus: HostedBus, _: Mother) -> None:
        kernel = bus.host.kernel

        def disturb(data: bytes) -> None:
            nonlocal sent
            if data[1] == 0:
                sent += 1
                if sent % 2:
                    kernel.at(kernel.now + 1 * MS, bus.bus.medium.transmit, "stranger", b"\x55", 0)

        await Stream(far_mother(bus, 0, disturb), machine(*NODES)).run(blocks)
        assert positions(bus) == [2400, 2400, 2400]

    scene = Scene().play(play)
    assert sent == 6
    began = [[at for at, _, _ in scene.commands(node)][::10] for node in NODES]
    skews = [max(times) - min(times) for times in zip(*began, strict=True)]
    assert [0 < skew < 20 * MS for skew in skews] == [True, False] * 3
    assert skews[1::2] == [0, 0, 0]


def test_a_node_that_answers_what_was_not_for_it_ends_the_stream_at_the_end_of_the_block() -> None:
    # No CRC protects an address: a packet may be obeyed by another node than the one it was for.
    blocks = [block({axis: [(40, 3000)] * 10 for axis in range(3)}, dwell=1.0) for _ in range(4)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        strayed = encode(11, MOTHER, b"q9m7")

        def stray(come: Streamed) -> None:
            if come.blocks == 2:
                at = bus.host.kernel.now + 1500 * MS
                bus.host.kernel.at(at, bus.bus.medium.transmit, "stranger", strayed, 0)

        stream = Stream(mother, machine(*NODES), progress=stray)
        with pytest.raises(StreamBroken, match="node 11 has answered what was not sent to it"):
            await stream.run(blocks)
        assert stream.streamed.blocks == 2
        assert positions(bus) == [800, 800, 800]
        assert mother.caller.stray_watchers == []

    Scene().play(play)


@pytest.mark.parametrize("after", [0.3, 1.4, 2.0, 2.3])
def test_an_emergency_stop_ends_the_stream_wherever_it_is(after: float) -> None:
    blocks = [block({axis: [(40, 3000)] * 10 for axis in range(3)}) for _ in range(6)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        running = asyncio.create_task(Stream(mother, machine(*NODES)).run(blocks))
        await asyncio.sleep(after)
        await mother.estop()
        stood = positions(bus)
        with pytest.raises(StreamBroken, match="an emergency stop came") as broken:
            await running
        assert not broken.value.streamed.over or not any(stood)
        await asyncio.sleep(30)
        assert positions(bus) == stood
        assert [one.state for one in bus.snapshots()] == ["STANDBY"] * 3

    Scene().play(play)


@pytest.mark.slow
def test_an_emergency_stop_at_any_time_is_the_last_thing_that_happens() -> None:
    blocks = [block({axis: [(40, 3000)] * 10 for axis in range(3)}) for _ in range(3)]

    async def play(bus: HostedBus, mother: Mother) -> None:
        kernel = bus.host.kernel
        for number in range(30):
            running = asyncio.create_task(Stream(mother, machine(*NODES)).run(blocks))
            await mother.until(kernel.now + 400 * MS + number * 700_000)
            sent = mother.statistics[0].sent
            await mother.estop()
            with pytest.raises(StreamBroken, match="an emergency stop came"):
                await running
            assert mother.statistics[0].sent - sent <= 3
            assert [one.state for one in bus.snapshots()] == ["STANDBY"] * 3
            await asyncio.sleep(1)

    Scene().play(play)
