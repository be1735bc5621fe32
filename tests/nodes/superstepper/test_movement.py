"""What a module tells of its motion is read back as it was, recordings and pictures included."""

from __future__ import annotations

import io
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodes.superstepper import KIND
from nodes.superstepper.movement import Shape
from sacbus.configuration import Configuration
from sacbus.daemon import open_bus
from sacbus.host import VirtualLoop
from sacbus.kernel import MS, SECOND, Kernel, Ns
from sacbus.movement import Segment
from sacbus.trace import Recorder, Track, read
from sacbus.trace.records import NodeOf
from sacbus.trace.vcd import write_vcd
from sacbus.wire.superstepper import (
    ChangeSpeed,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Stop,
    encode,
)
from tests.nodes.superstepper.bench import Bench

_SPEEDS = st.integers(1_000, 40_000)
_COMMANDS = (
    st.builds(MoveAtSpeed, st.booleans(), _SPEEDS)
    | st.builds(MoveSteps, st.booleans(), _SPEEDS, st.integers(0, 60))
    | st.builds(ChangeSpeed, _SPEEDS)
    | st.builds(Stop, st.booleans(), st.booleans())
    | st.builds(Microsteps, st.integers(0, 3))
)


class Tape:
    """What a module tells, as JSON keeps it, and read back."""

    def __init__(self, bench: Bench) -> None:
        self.track = Track(NodeOf(0, 3, "ss-mst67", {}))
        bench.node.movement.watch(self.take, bench.now)

    def take(self, when: Ns, shape: str, values: str) -> None:
        made = KIND.shape(json.loads(f"{{{shape}}}"))
        self.track.segments.append(KIND.segment(when, made, json.loads(f"{{{values}}}")))

    @property
    def last(self) -> Segment:
        return self.track.segments[-1]


@given(st.lists(st.tuples(_COMMANDS, st.integers(0, 900 * MS)), min_size=1, max_size=6))
@settings(max_examples=60)
def test_what_is_told_answers_as_the_module_did(commands: list[tuple[Message, Ns]]) -> None:
    bench = Bench(3, rate=2_000)
    tape = Tape(bench)
    steps: list[Ns] = []
    for command, wait in commands:
        bench.execute(command)
        begin = bench.now
        for part in (0, 1, 3):
            bench.kernel.run_until(begin + wait * part // 3)
            now, seen = bench.now, bench.node.snapshot(bench.now)
            segment = tape.last
            assert segment.position(now) == seen.position_pulses
            assert segment.steps(now) == segment.rotor(now) == seen.position_steps
            assert segment.rpm(now) == seen.rpm
            assert segment.state(now) == seen.state == bench.node.state(now)
            assert seen.state in KIND.states
            levels = {pin: bench.node.pins.level(pin, now) for pin in bench.node.pins.told}
            assert segment.levels(now) == levels
    steps = tape.track.pulses(0, bench.now + 1).tolist()
    assert len(steps) == bench.node.commands.engine.steps(bench.now)
    rises, falls = tape.track.edges(0, bench.now + 1)
    assert rises.tolist() == steps
    assert all(rise < fall for rise, fall in zip(rises, falls, strict=True))
    way = tape.track.directions(0, bench.now + 1)
    assert way.sum() == bench.node.snapshot(bench.now).position_pulses


def test_segments_know_when_they_begin_and_end_and_their_states() -> None:
    bench = Bench(3)
    tape = Tape(bench)
    assert (tape.last.started, tape.last.end, tape.last.command) == (None, None, "")
    assert tape.last.states() == [(0, "STANDBY")]
    bench.execute(MoveSteps(True, 10_000, 400))
    segment = tape.last
    assert segment.command == "move 400 steps clockwise at speed 10000"
    assert segment.started == 8 * MS
    assert [state for _, state in segment.states()] == ["ACCEL", "CRUISE", "DECEL", "STANDBY"]
    end = segment.end
    assert end is not None
    assert segment.states()[-1] == (end, "STANDBY")
    assert bench.node.wake_at() == end
    assert segment.pulse_times(0, end).size == segment.pulse_ends(0, end).size == 400
    assert segment.pulse_times(5, 5).size == 0
    assert not segment.anew
    bench.run(10 * SECOND)
    assert len(tape.track.segments) == 3
    bench.node.power(on=False, now=bench.now)
    assert tape.last.anew
    assert tape.last.states() == [(bench.now, "OFF")]
    assert set(tape.last.levels(bench.now).values()) == {0}


def test_the_direction_is_told_when_it_changes() -> None:
    bench = Bench(3)
    tape = Tape(bench)
    bench.execute(MoveAtSpeed(True, 10_000, accelerate=False))
    bench.run(SECOND)
    bench.execute(MoveAtSpeed(False, 10_000))
    turns = bench.node.commands.engine.turns
    assert turns is not None
    bench.run(10 * SECOND)
    assert [one.since for one in tape.track.segments] == [0, 0, SECOND, turns]
    assert [one.levels(one.since)["dir"] for one in tape.track.segments] == [1, 1, 1, 0]
    assert bench.node.commands.engine.turns is None


RIGHT = {
    "command": "",
    "clock": [250, 1],
    "ms_decay": 0,
    "enabled": True,
    "steps_per_revolution": 200,
    "course": [["ACCEL", 1, 10_000, 1, 3, [32_000, 10_000, 256, 44_000, False]]],
}


@pytest.mark.parametrize(
    "wrong",
    [
        {"clock": [0, 1]},
        {"clock": 5},
        {"ms_decay": -1},
        {"steps_per_revolution": 0},
        {"course": [["STOP", 1, 100, 1, 3]]},
        {"course": [["CRUISE", 0, 100, 1, 3]]},
        {"course": [["CRUISE", 1, 0, 1, 3]]},
        {"course": [["CRUISE", 1, 100, 0, 3]]},
        {"course": [["CRUISE", 1, 100, 65, 3]]},
        {"course": [["CRUISE", 1, 100, 1, -3]]},
        {"course": [["CRUISE", 1, 100]]},
        {"course": [["ACCEL", 1, 100, 1, None, [32_000, 10_000, 256, 44_000, False]]]},
        {"course": [["ACCEL", 1, 100, 1, 9_999, [32_000, 10_000, 256, 44_000, False]]]},
        {"course": [["ACCEL", 1, 100, 1, 3, [32_000, 10_000, 256, 0, False]]]},
        {"course": [["ACCEL", 1, 100, 1, 3, [32_000, 10_000, 1, 1 << 60, False]]]},
        {"course": [["ACCEL", 1, 100, 1, 3, [32_000, 10_000, 256]]]},
    ],
)
def test_what_no_module_tells_is_refused(wrong: dict[str, object]) -> None:
    assert Shape(RIGHT).course is not None
    with pytest.raises((LookupError, TypeError, ValueError)):
        Shape({**RIGHT, **wrong})
    with pytest.raises((LookupError, TypeError, ValueError)):
        KIND.segment(0, Shape(RIGHT), {"rest": [0, 0], "sign": 1})


@pytest.mark.parametrize("wrong", [{"sign": 0}, {"sign": "x"}, {"rest": [0]}, {"anchor": -1}])
def test_a_place_in_a_motion_that_no_module_tells_is_refused(wrong: dict[str, object]) -> None:
    right: dict[str, object] = {"rest": [0, 0], "sign": 1, "anchor": 0}
    assert KIND.segment(0, Shape(RIGHT), right).started is not None
    with pytest.raises((LookupError, TypeError, ValueError)):
        KIND.segment(0, Shape(RIGHT), {**right, **wrong})


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_a_recorded_bus_becomes_a_picture_of_its_pins(*, nine: bool) -> None:
    tape = io.BytesIO()

    async def session() -> None:
        settings = {"jmp2": "closed"} if nine else {}
        setup = Configuration(nodes=(3, 4), kind="ss-mst67", settings=settings)
        async with open_bus(setup) as bus:
            with Recorder(bus, tape):
                port = bus.port(lambda _: None)
                for message in (MoveSteps(True, 10_000, 50, home=True), MoveSteps(True, 10_000, 9)):
                    data = encode(3, message)
                    port.talk(data, bytes((1, *bytes(len(data) - 1))))
                    bus.host.kernel.run_until(bus.now() + SECOND // 2)
                    bus.panel(3).drive("home", 0)
                    bus.host.kernel.run_until(bus.now() + 5 * SECOND)

    loop = VirtualLoop(Kernel())
    try:
        loop.run_until_complete(session())
    finally:
        loop.close()
    recording = read(tape)
    said = [packet.said.words for packet in recording.packets()]
    assert said == [
        "move 50 steps clockwise at speed 10000, or until home falls",
        "ACK",
        "move 9 steps clockwise at speed 10000",
        "ACK",
    ]
    picture = io.StringIO()
    assert write_vcd(recording, picture) > 50
    text = picture.getvalue()
    assert "wire 1 % ms1" in text
    assert " home $end" in text
    assert " sync $end" not in text
    track = recording.track(3)
    assert track.position(recording.end) == track.pulses(0, recording.end + 1).size
