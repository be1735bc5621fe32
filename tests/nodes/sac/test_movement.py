"""Motion as a SAC tells of it, and read back: the same at every instant."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nodes.sac import KIND, SacNode, SacSettings
from sacbus.bus import Bus, Port
from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from sacbus.mother import safe_body
from sacbus.trace.records import NodeOf
from sacbus.trace.track import Track
from sacbus.wire import MOTHER, encode

NODE = 10


class Floor:
    """One node on a bus, alone with mother; with ``track`` what it tells is read back."""

    def __init__(self, settings: SacSettings | None = None, *, told: bool = True) -> None:
        self.kernel = Kernel()
        self.bus = Bus(self.kernel, KIND.protocol)
        self.node: SacNode = KIND.create(
            NODE, settings or SacSettings(), self.bus.rate, self.bus.tell
        )
        self.bus.add(self.node)
        self.port = Port(self.bus.medium, lambda _heard, _now: None, latency=0)
        self.stalls = bool(settings and settings.pull_in)
        self.track = Track(NodeOf(0, NODE, "sac", {}))
        self.lines: list[tuple[Ns, str, str]] = []
        if told:
            self.node.movement.watch(self._told, 0)

    def _told(self, now: Ns, shape: str, values: str) -> None:
        self.lines.append((now, shape, values))
        stored: Any = json.loads("{" + shape + "}")
        self.track.segments.append(
            KIND.segment(now, KIND.shape(stored), json.loads(f"{{{values}}}"))
        )

    def do(self, deed: str, at: Ns) -> None:
        """A line of mother's, or a deed at the node's pins and switch, in a word and a level."""
        self.kernel.run_until(at)
        node, now = self.node, self.kernel.now
        match deed.partition("=")[::2]:
            case "power", on:
                node.power(on=on == "1", now=now)
            case ("sync" | "estop" | "xclk" | "enA" | "enB") as pin, level:
                node.pins.drive(pin, int(level), now)
            case _:
                self.port.talk(encode(NODE, MOTHER, safe_body(deed.encode())))
                return
        self.bus.touch(node)

    def look(self, at: Ns) -> tuple[object, ...]:
        """All that can be seen of the node at an instant."""
        self.kernel.run_until(at)
        seen = self.node.snapshot(at)
        pins = self.node.pins
        levels = {name: pins.level(name, at) for name in pins.told}
        return (
            seen.position_pulses,
            seen.position_steps,
            seen.rotor_steps,
            seen.state,
            seen.rpm,
            levels,
        )

    def recorded(self, at: Ns) -> tuple[object, ...]:
        """The same, from what it told."""
        track = self.track
        assert track.state(at) in KIND.states
        return (
            track.position(at),
            track.steps(at),
            track.rotor(at) if self.stalls else None,
            track.state(at),
            track.rpm(at),
            dict(track.levels(at)),
        )


speeds = st.integers(1, 400) | st.integers(1, 4_000)
qualifiers = st.tuples(
    st.sampled_from(["", "v{}"]),
    st.sampled_from(["", "a", "a1", "a10", "a.5", "a999"]),
    st.sampled_from(["", "d", "d1", "d10", "d.5", "d999"]),
    st.sampled_from(["", "l1", "l0"]),
    st.sampled_from(["", "", "p"]),
    st.sampled_from(["", "", "u7"]),
    st.sampled_from(["", "", "t30000"]),
    st.sampled_from(["", "", "", "s"]),
)
moves = st.builds(
    lambda minus, steps, parts, rpm: f"m{minus}{steps}{''.join(parts).format(rpm)}",
    st.sampled_from(["", "-"]),
    st.sampled_from([""]) | st.integers(1, 3_000).map(str),
    qualifiers,
    speeds,
)
cuts = st.sampled_from(["s", "S", "n", "N", "y", "l", "+", "-+-", "g", "x1", "$R", "$n"])
deeds = st.one_of(
    moves,
    moves,
    moves.map(lambda move: "x" + move),
    st.builds("v{}".format, speeds),
    cuts,
    st.sampled_from(
        [
            *("sync=0", "sync=1", "estop=0", "estop=1", "power=0", "power=1"),
            *("enA=0", "enB=0", "enA=1", "enB=1", "$n", "xclk=900000", "xclk=0"),
        ]
    ),
)
waits = st.integers(0, 400 * MS)
#: Among them endless motion that is given a new velocity again and again.
plays = st.one_of(
    st.lists(st.tuples(waits, deeds), min_size=4, max_size=14),
    st.lists(
        st.tuples(
            waits,
            st.one_of(
                st.builds("v{}".format, speeds),
                st.builds("v{}".format, speeds),
                st.sampled_from(["m", "m", "a10", "s", "xclk=1000000", "xclk=250000", "$n"]),
            ),
        ),
        min_size=9,
        max_size=24,
    ).map(lambda rest: [(0, "m"), *rest]),
)
boards = st.builds(
    SacSettings,
    ustep=st.integers(0, 4),
    ppm=st.sampled_from([0, 0, 37, -100]),
    clock=st.sampled_from([True, True, False]),
    xclk_hz=st.sampled_from([1_000_000, 333_333]),
    auto_micro=st.sampled_from([False, False, True]),
    pull_in=st.sampled_from([0, 0, 90]),
    cw=st.booleans(),
    ops=st.sampled_from([1, 1, 0]),
)


@given(board=boards, play=plays, spots=st.lists(st.integers(0, 4 * SECOND), max_size=12))
@example(
    board=SacSettings(ustep=2, ppm=-100),
    play=[(0, "m"), *((90 * MS, f"v{50 + 7 * number}") for number in range(20)), (MS, "s")],
    spots=[SECOND, 2 * SECOND],
)
@settings(max_examples=100)
@pytest.mark.slow
def test_what_a_node_tells_is_what_it_does_at_every_instant(
    board: SacSettings, play: list[tuple[Ns, str]], spots: list[Ns]
) -> None:
    recorded = Floor(board)
    at, times = 0, []
    for wait, deed in play:
        at += wait
        times.append(at)
        recorded.do(deed, at)
    over = at + 2 * SECOND
    recorded.kernel.run_until(over)
    track = recorded.track
    pulses = track.pulses(0, over)
    assert np.all(pulses[1:] >= pulses[:-1])

    # Where something happens, and an instant before; some pulses of all; and anywhere.
    some = [int(one) for one in pulses[:: max(1, pulses.size // 40)]]
    edges = [one.since for one in track.segments] + some
    edges += [one for part in track.segments for one in (part.started, part.end) if one is not None]
    instants = {one - early for one in edges for early in (0, 1)} | set(spots)
    for when, seen in asked(board, list(zip(times, play, strict=True)), instants, over):
        assert recorded.recorded(when) == seen, when

    anew = {one.since for one in track.segments if one.anew}
    for when in set(some) - anew:
        jump = int(track.directions(when, when + 1).sum())
        assert jump == track.position(when) - track.position(when - 1)


def asked(
    board: SacSettings,
    play: list[tuple[Ns, tuple[Ns, str]]],
    instants: set[Ns],
    over: Ns,
) -> Iterator[tuple[Ns, tuple[object, ...]]]:
    """The same play again, with a node that is looked at; what is seen at some instants."""
    floor = Floor(board, told=False)
    deeds = [(when, 0, deed) for when, (_, deed) in play]
    looks = [(when, 1, "") for when in instants if 0 <= when < over]
    # Deeds of one instant keep their order; what is seen then is seen after them.
    for when, look, deed in sorted(deeds + looks, key=lambda one: one[:2]):
        if look:
            yield when, floor.look(when)
        else:
            floor.do(deed, when)


@given(board=boards, play=plays)
@settings(max_examples=60)
@pytest.mark.slow
def test_pulses_add_up_to_positions(board: SacSettings, play: list[tuple[Ns, str]]) -> None:
    floor = Floor(board)
    at = 0
    for wait, deed in play:
        at += wait
        floor.do(deed, at)
    over = at + 2 * SECOND
    floor.kernel.run_until(over)
    track = floor.track
    since, began = 0, 0
    marks = [one.since for one in track.segments if one.anew][1:]
    for until in (*marks, over):
        # Up to the instant before what is counted anew.
        counted = int(track.directions(since + 1, until).sum())
        assert began + counted == track.position(until - 1)
        since, began = until, 0
    for instant in range(0, over, over // 7):
        low, high = instant, instant + over // 7
        parts = [track.pulses(low, low + 1_000), track.pulses(low + 1_000, high)]
        assert np.array_equal(np.concatenate(parts), track.pulses(low, high))


def test_states_of_a_track_are_those_of_the_node() -> None:
    floor = Floor()
    floor.do("m400v120a1d1", 0)
    floor.do("m-200v60s", 10 * MS)
    floor.do("y", 6 * SECOND)
    floor.kernel.run_until(20 * SECOND)
    found = [state for _, state in floor.track.states()]
    assert found == [
        "STANDBY",
        "STOP",
        "ACCEL",
        "CRUISE",
        "DECEL",
        "SYNC",
        "ACCEL",
        "CRUISE",
        "DECEL",
        "STANDBY",
    ]
    changes = list(floor.track.states())
    times = {when - early for when, _ in changes for early in (0, 1)}
    play = [(0, (0, "m400v120a1d1")), (10 * MS, (0, "m-200v60s")), (6 * SECOND, (0, "y"))]
    seen = {when: look[3] for when, look in asked(SacSettings(), play, times, 20 * SECOND)}
    for when, state in changes[1:]:
        assert seen[when] == state != seen[when - 1]


def test_a_segment_tells_its_command_and_when_its_pulses_fall() -> None:
    floor = Floor(SacSettings(pulse=25))
    floor.do("m10v60", 0)
    floor.kernel.run_until(2 * SECOND)
    segment = next(one for one in floor.track.segments if one.started is not None)
    assert segment.command == "m10v60a1d1"
    rises, falls = segment.pulse_times(0, SECOND), segment.pulse_ends(0, SECOND)
    assert rises.size == 10
    assert np.all(falls - rises == 25 * US)
    assert segment.end is not None
    assert floor.track.state(segment.end) == "STANDBY"


def test_a_node_that_nobody_watches_any_more_tells_nothing() -> None:
    floor = Floor()
    told = len(floor.lines)
    floor.node.movement.watch(None, 0)
    floor.do("m400", 0)
    floor.kernel.run_until(SECOND)
    assert len(floor.lines) == told


def test_a_command_of_a_loop_is_told_of_once() -> None:
    floor = Floor()
    for _ in range(2):
        floor.do("m100v200d", floor.kernel.now + 20 * MS)
    floor.kernel.run_until(4 * SECOND)
    floor.do("la", 4 * SECOND)
    before = len(floor.lines)
    floor.kernel.run_until(4 * SECOND + 400 * MS)
    assert 1 <= len(floor.lines) - before <= 3


@pytest.mark.parametrize(
    "values", [{}, {"rest": [0]}, {"rest": [0, 0, 0], "sign": 1, "anchor": 0, "tick": 0}]
)
def test_what_no_node_tells_is_refused(values: dict[str, object]) -> None:
    floor = Floor()
    floor.do("m10v60", 0)
    floor.kernel.run_until(SECOND)
    shape = KIND.shape(json.loads("{" + floor.lines[1][1] + "}"))
    with pytest.raises((LookupError, TypeError, ValueError)):
        KIND.segment(0, shape, values)
