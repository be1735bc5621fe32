"""The whole node: what it shows, what it remembers, and that nothing on the wire breaks it."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nodes.sac import KIND, SacNode, SacSettings
from sacbus.kernel import MS, SECOND, LineRate, Ns
from sacbus.node import Heard, Node, NodeKind, Report, ReportKind
from sacbus.wire import GENERAL_CALL, MOTHER, ack
from tests.bus.strategies import ADDRESSES, bursts, traffic
from tests.nodes.sac.bench import EVEN, LOAD_ACC, NODE, Bench, packet

AT: Ns = 20 * MS


def node(
    settings: SacSettings | None = None,
    told: list[Report] | None = None,
    memory: Mapping[str, object] | None = None,
) -> SacNode:
    reports = [] if told is None else told
    return KIND.create(10, settings or SacSettings(), LineRate(), reports.append, memory)


# ---- the contract -------------------------------------------------------------------------------


def test_the_kind_and_its_nodes_keep_the_contract() -> None:
    kind: NodeKind = KIND
    made: Node = node()
    assert (kind.name, kind.protocol.name, made.address) == ("sac", "sac", 10)
    assert kind.summary


def test_a_new_node_is_idle_and_wants_nothing() -> None:
    made = node()
    assert (made.wake_at(), made.receiving, made.wake(SECOND)) == (None, False, None)
    snapshot = made.snapshot(0)
    assert (snapshot.address, snapshot.kind, snapshot.state) == (10, "sac", "STANDBY")
    assert (snapshot.position_steps, snapshot.position_pulses, snapshot.rpm) == (0, 0, 0)
    assert (snapshot.current, snapshot.pending) == ("", ())
    assert snapshot.counters == {"packets": 0, "ack": 0, "nak": 0}


def test_a_snapshot_shows_what_runs_and_what_waits() -> None:
    bench = Bench(settings=SacSettings(ustep=1))
    bench.hears("m-100v10", at=AT)
    bench.hears("m20v60a2d3l1p", at=AT + 20 * MS)
    snapshot = bench.snapshot(AT + LOAD_ACC + 30 * MS)
    # Two pulses a step: the third one is out.
    assert (snapshot.position_pulses, snapshot.position_steps, snapshot.rpm) == (-3, -1.5, -10)
    assert snapshot.state == "CRUISE"
    assert (snapshot.current, snapshot.pending) == (
        "m-100v10a1d1",
        ("m20v60a2d3l1p",),
    )
    assert snapshot.counters == {"packets": 2, "ack": 2, "nak": 0}


def test_the_state_alone_is_that_of_the_snapshot() -> None:
    bench = Bench()
    assert bench.node.state(0) == bench.snapshot(0).state == "STANDBY"
    bench.hears("m200v60a2d2", at=AT)
    bench.hears("m20v60a2d2s1", at=AT + 20 * MS)
    states: set[str] = set()
    for at in range(AT, 3 * SECOND, 7 * MS):
        snapshot = bench.snapshot(at)
        assert bench.node.state(at) == snapshot.state
        states.add(snapshot.state)
    assert states >= {"ACCEL", "CRUISE", "DECEL", "SYNC"}


def test_looking_changes_nothing() -> None:
    looked, unlooked = Bench(), Bench()
    for each in (looked, unlooked):
        each.hears("m200v100a1d1", at=AT)
    for at in range(AT, 2 * SECOND, 7 * MS):
        looked.node.snapshot(at)
        looked.node.state(at)
        looked.node.persist()
        looked.node.wake_at()
    for each in (looked, unlooked):
        each.run()
    assert looked.transcript() == unlooked.transcript()


# ---- memory -------------------------------------------------------------------------------------


def test_what_is_persisted_makes_the_same_node_again() -> None:
    first = node(SacSettings(ustep=3, soft_ops=True, ack=False))
    told: list[Report] = []
    second = node(told=told, memory=first.persist())
    assert second.persist() == first.persist()
    assert told == []


def test_a_stored_address_wins_over_the_configured_one_and_is_warned_of() -> None:
    told: list[Report] = []
    made = node(told=told, memory={"d_id": 33})
    assert made.address == 33
    (report,) = told
    assert report.kind is ReportKind.WARNING
    assert "33" in report.text
    assert "wins over the configured" in report.text


def test_odd_values_are_reported_and_the_node_starts_all_the_same() -> None:
    told: list[Report] = []
    made = node(told=told, memory={"ustep": 99, "colour": 1, "sprf": 0})
    assert [report.kind for report in told] == [ReportKind.WARNING] * 3
    assert made.address == 10
    assert made.persist()["sprf"] == 200


def test_what_is_restored_is_obeyed() -> None:
    bench = Bench(memory={"ustep": 2, "cw": 0, "dir": 1, "cycle": 30_000})
    bench.hears("m5", at=AT)
    bench.run()
    assert bench.kernel.now == AT + LOAD_ACC + 5 * 30 * MS
    assert bench.position(bench.kernel.now) == -20
    bench = Bench(memory={**bench.node.persist(), "ack": 0})
    bench.hears("m5", at=AT)
    bench.run()
    assert bench.heard == []


# ---- anything may come over a wire --------------------------------------------------------------

SETTINGS = st.sampled_from(
    (
        SacSettings(),
        SacSettings(soft_ops=True),
        SacSettings(ustep=7, linear=True),
        SacSettings(receiver="robust", soft_ops=True),
        SacSettings(turnaround=False, deaf_time=False, crc=False),
        SacSettings(ack=False, slow=255, cycle=1, sprf=65_535),
    )
)


def still_works(bench: Bench) -> None:
    """After a while of silence every node answers, stops, and moves as it should."""
    bench.kernel.run_until(bench.kernel.now + 100 * SECOND)
    for number, address in enumerate(bench.nodes):
        made = bench.nodes[address]
        at = bench.kernel.now + SECOND
        count = made.snapshot(0).counters["packets"]
        bench.hears("S", at=at, to=address)
        there = bench.position(at + MS, address)
        assert bench.snapshot(at + MS, address).state == "STANDBY"
        bench.hears(f"m{number + 3}v10l0f", at=at + SECOND, to=address)
        bench.kernel.run_until(at + 300 * SECOND)
        steps = (number + 3) * 2**made.board.eeprom.ustep
        assert bench.position(bench.kernel.now, address) == there + steps
        assert made.snapshot(0).counters["packets"] == count + 2
        assert not made.receiving or made.board.settings.receiver == "robust"
        if made.board.settings.ack:
            assert bench.answers.count(ack(MOTHER, address)) >= 2


@pytest.mark.slow
@settings(max_examples=120)
@given(SETTINGS, st.sampled_from((1, 2)), traffic())
def test_no_input_raises_and_the_node_works_afterwards(
    setup: SacSettings, lanes: int, talk: list[tuple[Ns, bytes]]
) -> None:
    bench = Bench(*ADDRESSES, lanes=lanes, settings=setup)
    end = 0
    for pause, data in talk:
        end = bench.sends(data, at=end + pause).end
    still_works(bench)


@pytest.mark.slow
@settings(max_examples=120)
@given(
    SETTINGS,
    st.lists(st.tuples(st.integers(0, 30 * MS), bursts), min_size=2, max_size=8),
    st.integers(0, 2**16),
)
def test_no_collision_raises_and_the_node_works_afterwards(
    setup: SacSettings, talk: list[tuple[Ns, bytes]], seed: int
) -> None:
    bench = Bench(*ADDRESSES, settings=setup, seed=seed)
    for number, (at, data) in enumerate(sorted(talk)):
        bench.sends(data, at=at, sender=f"talker {number}")
    still_works(bench)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.binary(min_size=1, max_size=300), st.lists(st.integers(1, 299)), st.booleans())
def test_however_bytes_are_split_a_node_says_the_same_at_the_same_times(
    data: bytes, stops: list[int], meant: bool
) -> None:
    if meant:
        data = packet(data[:40]) + packet(data[:9], GENERAL_CALL) + data
    runs = []
    for bounds in ([0, len(data)], sorted({0, *(s for s in stops if s < len(data)), len(data)})):
        bench = Bench(lanes=2, rate=EVEN)
        for first, last in pairwise(bounds):
            bench.sends(data[first:last], at=bench.span(first))
        bench.kernel.run_until(100 * SECOND)
        runs.append((bench.heard, bench.told(), bench.node.snapshot(bench.kernel.now)))
    assert runs[0] == runs[1]


PIECES = st.lists(
    st.tuples(st.integers(-2 * MS, 40 * MS), bursts, st.integers(0, 300), st.binary(max_size=3)),
    max_size=8,
)


@pytest.mark.slow
@settings(max_examples=60)
@given(SETTINGS, PIECES)
@example(SacSettings(), [(0, packet("m5v10"), 0, b""), (-2 * MS, packet("S"), 0, b"")])
def test_a_node_that_is_called_out_of_turn_does_not_break(
    setup: SacSettings, pieces: list[tuple[Ns, bytes, int, bytes]]
) -> None:
    made = KIND.create(NODE, setup, LineRate(), lambda report: None)
    now = SECOND
    for off, data, first, following in pieces:
        heard = Heard(data, now + off, first, LineRate(), following)
        now = max(now, heard.ends(len(data) - 1))
        made.hear(heard, now)
        made.snapshot(now)
        due = made.wake_at()
        if due is not None and off % 2:
            now = max(now, due)
            made.wake(now)
    assert made.address == NODE


@pytest.mark.slow
@settings(max_examples=40)
@given(SETTINGS, traffic(5))
def test_the_same_input_twice_gives_the_same_transcript(
    setup: SacSettings, talk: list[tuple[Ns, bytes]]
) -> None:
    def run() -> list[object]:
        bench = Bench(*ADDRESSES, settings=setup, seed=9)
        end = 0
        for pause, data in talk:
            end = bench.sends(data, at=end + pause).end
        bench.kernel.run_until(end + 50 * SECOND)
        return bench.transcript()

    assert run() == run()
