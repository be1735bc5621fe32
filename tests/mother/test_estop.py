"""The emergency stop in kernel time, against real nodes and whatever else is on the line."""

from __future__ import annotations

import asyncio
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus import Mother, open_bus
from sacbus.bus import Port
from sacbus.daemon import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import MS, SECOND, Kernel
from sacbus.mother import (
    Acknowledged,
    Caller,
    LineLost,
    NoAnswer,
    Refused,
    Sent,
    Stopped,
    UnknownOutcome,
)
from tests.mother.rig import Outcome, Rig, Weather, answer_lost, body_spoilt, packet_lost

STOP = bytes.fromhex("02 00 01 53 03 39 00")
#: Seven bytes at 38 400 baud, and the gap of 1 ms (spec, wire).
SLOT = 1_822_916 + 1 * MS


def stopped(rig: Rig) -> list[Outcome]:
    """Stop; the list will hold what came of it."""
    outcomes: list[Outcome] = []
    rig.caller.estop(outcomes.append)
    return outcomes


def stops(rig: Rig) -> list[int]:
    """When each S began."""
    return [one.start for one in rig.line if one.data == STOP]


def moving(rig: Rig) -> set[int]:
    now = rig.kernel.now
    return {node.address for node in rig.bus.nodes if node.state(now) != "STANDBY"}


def test_an_idle_line_carries_s_at_once_and_twice_more_a_millisecond_apart() -> None:
    rig = Rig(10)
    outcomes = stopped(rig)
    assert rig.sent == [STOP]
    rig.kernel.run()
    assert stops(rig) == [0, SLOT, 2 * SLOT]
    assert outcomes == [Sent()]
    assert rig.caller.statistics[0].sent == 3


def test_it_is_over_a_gap_after_the_third() -> None:
    rig = Rig(10)
    outcomes = stopped(rig)
    rig.kernel.run_until(3 * SLOT - 1)
    assert outcomes == []
    rig.kernel.run_until(3 * SLOT)
    assert outcomes == [Sent()]


def test_every_node_stops_that_was_moving() -> None:
    addresses = range(6, 40)
    rig = Rig(*addresses)
    rig.caller.broadcast(b"M", lambda _: None)
    rig.kernel.run_until(SECOND)
    assert moving(rig) == set(addresses)
    stopped(rig)
    rig.kernel.run_until(SECOND + 2 * MS)
    assert moving(rig) == set()


def test_what_waits_is_never_sent_and_is_told_so() -> None:
    rig = Rig(10)
    first = rig.call(10, b"V100")
    waiting = [rig.call(10, b"m400"), rig.call(11, b"m1")]
    broadcast: list[Outcome] = []
    rig.caller.broadcast(b"m400", broadcast.append)
    rig.kernel.run_until(1 * MS)
    stopped(rig)
    for outcomes, node, line in zip(
        [*waiting, broadcast], (10, 11, 0), ("m400", "m1", "m400"), strict=True
    ):
        (outcome,) = outcomes
        assert isinstance(outcome, Stopped)
        assert (outcome.node, outcome.line) == (node, line)
    rig.kernel.run()
    assert rig.steps(10) == 0
    assert [packet[3:5] for packet in rig.sent] == [b"V1", b"S\x03", b"S\x03", b"S\x03"]
    # It was out when the stop came, and has been heard; but its ACK met the first S.
    assert isinstance(first[0], NoAnswer)


def test_an_ack_that_was_on_its_way_already_is_an_ack() -> None:
    rig = Rig()
    outcomes = rig.call(10, b"m400")
    rig.kernel.run_until(4 * MS)
    stopped(rig)
    # A link takes its time: what the node said before reaches mother now.
    rig.caller.hear(bytes.fromhex("02 01 0a 06"))
    rig.kernel.run()
    (outcome,) = outcomes
    assert isinstance(outcome, Acknowledged)
    assert rig.caller.statistics[10].acks == 1


def test_the_motion_that_was_on_its_way_is_stopped_too_though_its_node_is_deaf_to_the_first() -> (
    None
):
    rig = Rig(10)
    outcomes = rig.call(10, b"M")
    rig.kernel.run_until(1 * MS)
    stopped(rig)
    rig.kernel.run_until(100 * MS)
    first, second, _third = stops(rig)
    # Right behind the packet, into the answer: the second is the one that is heard.
    assert first == rig.rate.span(7)
    assert second == first + SLOT
    assert moving(rig) == set()
    # The answer met the first S.
    assert [type(one) for one in outcomes] == [UnknownOutcome]
    assert len([packet for packet in rig.sent if packet[3:4] == b"M"]) == 1


def test_what_is_out_is_not_sent_again_whatever_becomes_of_it() -> None:
    refused = Rig(10)
    refused.expect([body_spoilt])
    outcomes = refused.call(10, b"V100 and more")
    refused.kernel.run_until(refused.rate.span(22) + 1 * MS)
    stopped(refused)
    refused.kernel.run()
    (outcome,) = outcomes
    assert isinstance(outcome, Refused | NoAnswer)  # as the NAK got through or not
    assert outcome.attempts == 1
    silent = Rig()
    outcomes = silent.call(99, b"V100")
    silent.kernel.run_until(8 * MS)
    stopped(silent)
    silent.kernel.run()
    (outcome,) = outcomes
    assert isinstance(outcome, NoAnswer)
    assert outcome.attempts == 1


def test_what_waits_to_be_sent_again_ends_as_what_is_known_of_it() -> None:
    rig = Rig(10)
    rig.expect([body_spoilt])
    refused = rig.call(10, b"m400")
    # NAK has come, and the gap behind it is not over.
    while rig.caller.statistics[10].naks == 0:
        rig.kernel.run_next()
    stopped(rig)
    (outcome,) = refused
    assert isinstance(outcome, Refused)
    assert outcome.attempts == 1
    rig.kernel.run()
    assert rig.steps(10) == 0


def test_mother_works_on_afterwards_with_what_is_asked_meanwhile_in_its_turn() -> None:
    rig = Rig(10)
    outcomes = stopped(rig)
    later = rig.call(10, b"m400")
    rig.kernel.run()
    assert outcomes == [Sent()]
    assert isinstance(later[0], Acknowledged)
    assert rig.line[3].start == 3 * SLOT
    assert rig.steps(10) == 400


def test_who_is_told_that_it_was_stopped_may_ask_again_at_once() -> None:
    rig = Rig(10)
    rig.call(10, b"V100")
    outcomes: list[Outcome] = []

    def again(outcome: Outcome) -> None:
        outcomes.append(outcome)
        if isinstance(outcome, Stopped):
            rig.caller.call(10, b"m400", again)

    rig.caller.call(10, b"m100", again)
    stopped(rig)
    rig.kernel.run()
    assert [type(one) for one in outcomes] == [Stopped, Acknowledged]
    assert rig.steps(10) == 400


def test_a_second_stop_meanwhile_is_three_more_and_fails_what_was_asked_in_between() -> None:
    rig = Rig(10)
    first = stopped(rig)
    rig.kernel.run_until(SLOT + 1)
    between = rig.call(10, b"m400")
    second = stopped(rig)
    assert isinstance(between[0], Stopped)
    rig.kernel.run()
    assert stops(rig) == [number * SLOT for number in range(5)]
    assert first == second == [Sent()]


def test_a_stop_behind_a_broadcast_keeps_its_distances() -> None:
    rig = Rig(10)
    outcomes: list[Outcome] = []
    rig.caller.broadcast(b"M", outcomes.append)
    rig.kernel.run_until(500_000)
    stopped(rig)
    rig.kernel.run_until(SECOND)
    end = rig.rate.span(7)
    assert stops(rig) == [end, end + SLOT, end + 2 * SLOT]
    assert outcomes == [Sent()]
    assert moving(rig) == set()


def test_while_somebody_else_talks_the_stops_do_not_pile_up_behind_each_other() -> None:
    rig = Rig(10)
    heard: list[Outcome] = []
    port = Port(rig.bus.medium, lambda _heard, _now: None, latency=0)
    caller = Caller(rig.kernel, port.talk, unsent=lambda: port.unsent)
    rig.bus.medium.transmit("another talker", bytes(400), 0)
    caller.estop(heard.append)
    rig.kernel.run()
    assert heard == [Sent()]
    starts = stops(rig)
    assert starts[0] == rig.rate.span(400)
    assert all(later - before >= SLOT for before, later in pairwise(starts))
    assert len(starts) == 3


def test_a_lost_line_ends_it() -> None:
    rig = Rig(10)
    outcomes = stopped(rig)
    rig.kernel.run_until(SLOT + 1)
    rig.caller.lose("unplugged")
    rig.kernel.run()
    assert [type(one) for one in outcomes] == [LineLost]
    assert len(rig.sent) == 2
    assert [type(one) for one in stopped(rig)] == [LineLost]


_WEATHER: dict[str, Weather | None] = {
    "good": None,
    "NAK": body_spoilt,
    "packet lost": packet_lost,
    "answer lost": answer_lost,
}


@given(
    st.lists(st.sampled_from(sorted(_WEATHER)), max_size=6),
    st.lists(st.sampled_from(["M", "m400", "V100", "broadcast"]), max_size=6),
    st.lists(st.integers(0, 40 * MS), min_size=1, max_size=3),
)
def test_whenever_it_comes_all_calls_end_once_and_nothing_moves_on(
    weather: list[str], lines: list[str], instants: list[int]
) -> None:
    rig = Rig(10, 11)
    # The weather is that of the packets before the first stop.
    rig.expect(_WEATHER[one] for one in weather)
    everything: list[list[Outcome]] = []
    for line in lines:
        if line == "broadcast":
            outcomes: list[Outcome] = []
            rig.caller.broadcast(b"M", outcomes.append)
            everything.append(outcomes)
        else:
            everything.append(rig.call(10, line.encode()))
    for instant in sorted(instants):
        rig.kernel.run_until(instant)
        rig.weather.clear()
        everything.append(stopped(rig))
    rig.kernel.run_until(rig.kernel.now + SECOND)
    assert [len(outcomes) for outcomes in everything] == [1] * len(everything)
    assert moving(rig) == set()
    for outcomes, line in zip(everything, lines, strict=False):
        if isinstance(outcomes[0], Stopped) and line == "m400":
            assert outcomes[0].line == "m400"
    sent = sum(one.sent for address, one in rig.caller.statistics.items() if address)
    ended = sum(
        one.acks + one.naks + one.timeouts
        for address, one in rig.caller.statistics.items()
        if address
    )
    assert sent == ended


# ----------------------------------------------------------------------------- for coroutines


def test_calls_that_wait_raise_stopped_and_the_next_one_goes_through() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 11))) as bus:
            mother: Mother = bus.mother()
            await mother.send(10, "M")
            calls = [asyncio.create_task(mother.send(11, f"m{number}")) for number in range(1, 9)]
            await asyncio.sleep(0.02)
            before = bus.host.kernel.now
            await mother.estop()
            assert bus.host.kernel.now - before <= 3 * SLOT + 5 * MS
            assert {node.state for node in bus.snapshots()} == {"STANDBY"}
            outcomes = await asyncio.gather(*calls, return_exceptions=True)
            assert Stopped in {type(one) for one in outcomes}
            assert isinstance(await mother.send(11, "m400"), Acknowledged)

    run_virtual(Kernel(), scene())


def test_who_is_cancelled_has_stopped_everybody_all_the_same() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            mother: Mother = bus.mother()
            await mother.send(10, "M")
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.000_1):
                    await mother.estop()
            await asyncio.sleep(0.1)
            assert mother.statistics[0].sent == 3
            assert bus.snapshot(10).state == "STANDBY"

    run_virtual(Kernel(), scene())
