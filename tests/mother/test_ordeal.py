"""Ten thousand transactions on a line with bit errors: what mother says is what has happened.

Three accounts are compared: mother's outcomes, what the nodes say that they accepted, and what the
recording shows. What the protocol cannot protect (docs/protection.md) is listed from the recording,
and there is nothing else.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import ClassVar

import pytest

from sacbus.bus import BitErrors, Drop, FaultOn, Passage
from sacbus.bus.fault import Strike
from sacbus.mother import (
    Acknowledged,
    NoAnswer,
    Refused,
    Sent,
    UnknownOutcome,
    safe_body,
)
from sacbus.trace.records import Sent as OnTheLine
from sacbus.wire import Answer, PacketReceiver
from tests.mother.ordeal import ADDRESSES, DEAF, UNPOWERED, Asked, Ordeal

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Crossed:
    """The node's address is damaged in one bit, in packets and in answers, each with ``rate``.

    So it is now and then in both: then another node does it, and its ACK bears the right address.
    """

    rate: float
    name: ClassVar[str] = "crossed"

    def put_on(self, on: FaultOn) -> Strike:
        def strike(passage: Passage) -> None:
            if on.random.random() < self.rate:
                passage.values[1 if passage.node is None else 2] ^= 1
                on.acts(passage)

        return strike


ENDS = (Acknowledged, Refused, NoAnswer, UnknownOutcome)


@pytest.fixture(scope="module")
def bad() -> Ordeal:
    """The line of the issue: 10 000 requests, one bit in a thousand inverted, and bytes lost."""
    return Ordeal(10_000, [BitErrors(1e-3), Drop(1e-3)], seed=2)


@pytest.fixture(scope="module")
def worse() -> Ordeal:
    """One bit in a hundred: half of all packets are lost, and what is rare happens as well."""
    return Ordeal(1_500, [BitErrors(1e-2), Drop(1e-2)], seed=1)


@pytest.fixture(params=["bad", "worse"])
def ordeal(request: pytest.FixtureRequest) -> Ordeal:
    made = request.getfixturevalue(request.param)
    assert isinstance(made, Ordeal)
    return made


def accepted(ordeal: Ordeal) -> Counter[tuple[int, bytes]]:
    """How often each node says that it accepted what."""
    return Counter(one[1:] for one in ordeal.account)


def without_cause(ordeal: Ordeal) -> list[Asked]:
    """What is reported done, and its node does not say that it did it."""
    count = accepted(ordeal)
    return [
        one
        for one in ordeal.asked
        if isinstance(one.outcome, Acknowledged) and not count[one.node, safe_body(one.line)]
    ]


def test_every_one_ends_once_and_mother_is_ready_for_the_next(ordeal: Ordeal) -> None:
    assert ordeal.ended == len(ordeal.asked) in (1_500, 10_000)
    assert all(isinstance(one.outcome, ENDS if one.node else Sent) for one in ordeal.asked)
    errors, drops = ordeal.faults
    assert errors.count > 1_000
    assert drops.count > 100
    assert {type(one.outcome) for one in ordeal.asked} == {*ENDS, Sent}
    # Nothing is outstanding, and no appointment of hers stands.
    outcomes: list[object] = []
    ordeal.caller.broadcast(b"v100", outcomes.append)
    ordeal.kernel.run_until(ordeal.kernel.now + 10_000_000)
    assert outcomes == [Sent()]


def test_what_is_reported_done_its_node_has_done_but_for_what_is_listed(ordeal: Ordeal) -> None:
    for one in without_cause(ordeal):
        assert ordeal.falsely_acknowledged(one), one


def test_what_is_listed_is_rare_and_is_what_the_protocol_cannot_protect(
    bad: Ordeal, worse: Ordeal
) -> None:
    assert len(without_cause(bad)) <= 3
    crossed = Ordeal(300, [Crossed(0.2)], seed=1)
    for ordeal, kind in ((worse, "a damaged line"), (crossed, "another node")):
        listed = [how for one in without_cause(ordeal) for how in ordeal.falsely_acknowledged(one)]
        assert {how.partition(":")[0] for how in listed} == {kind}
        assert len(listed) == len(without_cause(ordeal))


def test_what_is_refused_its_node_has_not_done(ordeal: Ordeal) -> None:
    count = accepted(ordeal)
    refused = [one for one in ordeal.asked if isinstance(one.outcome, Refused)]
    assert refused
    assert not [one for one in refused if count[one.node, safe_body(one.line)]]


def test_no_motion_ran_twice_unreported(ordeal: Ordeal) -> None:
    count = accepted(ordeal)
    runs = Counter((run.node, run.command) for run in ordeal.runs if run.asked_for)
    twice = 0
    for one in ordeal.asked:
        if not one.node:
            continue
        times = count[one.node, safe_body(one.line)]
        if not one.moves:
            assert times <= 3
            continue
        assert runs[one.node, one.line.decode()] == times
        if not one.accept_duplicates:
            assert times <= 1, one
        elif times > 1:
            twice += 1
            assert isinstance(one.outcome, Acknowledged | NoAnswer | UnknownOutcome)
            assert one.outcome.attempts >= times
    # Where it was allowed it happens, and is told.
    assert twice


def test_silence_is_told_as_unknown_where_the_node_may_have_moved(ordeal: Ordeal) -> None:
    count = accepted(ordeal)
    unknown = [one for one in ordeal.asked if isinstance(one.outcome, UnknownOutcome)]
    did = {bool(count[one.node, safe_body(one.line)]) for one in unknown}
    assert did == {True, False}
    for one in ordeal.asked:
        if isinstance(one.outcome, NoAnswer):
            assert one.accept_duplicates or not one.moves
            assert one.outcome.attempts == 3


def test_every_run_by_a_wrong_node_is_listed_from_the_recording(ordeal: Ordeal) -> None:
    listed = [run for run in ordeal.runs if not run.asked_for]
    assert any(run.packet.data[1] != run.node for run in listed)
    said = {(when, node) for when, node, _ in ordeal.wrongly_accepted()}
    for run in listed:
        # The damage is seen in the recording, and the node's own account agrees.
        assert run.packet.arrived != run.packet.data, str(run)
        assert (run.when, run.node) in said, str(run)
    # And the other way round: whatever motion a node says that it took wrongly is on the list.
    runs = {(run.when, run.node) for run in listed}
    motions = {
        (when, node)
        for when, node, body in ordeal.wrongly_accepted()
        if body.rstrip() in {safe_body(one.line).rstrip() for one in ordeal.asked if one.moves}
    }
    assert motions
    assert motions <= runs


def test_a_node_that_is_dead_gets_no_ack_and_works_on_when_it_returns(bad: Ordeal) -> None:
    # A SAC boots for a second, in which mother asks for some hundred things.
    for node, first, last, boots in ((UNPOWERED, 100, 400, 200), (DEAF, 500, 800, 0)):
        for thousand in range(0, 10_000, 1_000):

            def outcomes(begin: int, end: int) -> set[type[object]]:
                some = bad.asked[thousand + begin : thousand + end]
                return {type(one.outcome) for one in some if one.node == node}

            assert outcomes(first, last) <= {NoAnswer, UnknownOutcome}
            assert Acknowledged in outcomes(last + boots, 1_000)


def test_statistics_add_up_and_agree_with_the_recording(ordeal: Ordeal) -> None:
    statistics = ordeal.statistics
    sent: Counter[int] = Counter(packet.data[1] for packet in ordeal.packets)
    asked: Counter[int] = Counter(one.node for one in ordeal.asked)
    for node in ADDRESSES:
        one = statistics[node]
        assert one.sent == sent[node]
        assert one.sent == one.acks + one.naks + one.timeouts
        assert one.retries == one.sent - asked[node]
        acknowledged = sum(
            isinstance(request.outcome, Acknowledged)
            for request in ordeal.asked
            if request.node == node
        )
        assert one.acks == acknowledged
        assert len(one.round_trips) == min(acknowledged, 1_000)
    assert statistics[0].sent == sent[0] == asked[0]
    assert set(statistics) == {0, *ADDRESSES}
    # Every answer that arrived, to whomever, was either waited for or a stray.
    receiver = PacketReceiver()
    answers = sum(
        isinstance(event, Answer)
        for record in ordeal.records
        if isinstance(record, OnTheLine) and isinstance(record.sender, int)
        for event in receiver.receive(record.arrived)
    )
    taken = sum(one.acks + one.naks for one in statistics.values())
    assert answers == taken + ordeal.strays
