"""Bits inverted, bytes lost, doubled and late, a reply that is another's: byte for byte."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.bus import (
    BitErrors,
    Bus,
    Delay,
    Drop,
    Duplicate,
    Fault,
    Medium,
    SwappedReply,
    Transmission,
)
from sacbus.kernel import MS, Kernel, LineRate, Ns
from sacbus.node import Heard
from sacbus.wire import MOTHER, ack, nak
from tests.nodes.sac.bench import Bench, packet

RATE = LineRate()
BYTE: Ns = RATE.span(1)


class Line:
    """A line without nodes under faults, and when each byte was heard to begin."""

    def __init__(self, *faults: Fault, rate: LineRate = RATE, seed: int = 0) -> None:
        self.kernel = Kernel()
        self.medium: Medium = Bus(self.kernel, KIND.protocol, rate=rate, seed=seed).medium
        self.on_line = [self.medium.add_fault(fault) for fault in faults]
        self.heard: list[tuple[Ns, int]] = []
        self.ninth = b""
        self.seen: list[Transmission] = []
        self.medium.listen(0, self, None)
        self.medium.watchers.append(self.seen.append)

    def hear(self, heard: Heard, now: Ns) -> None:
        assert now == heard.ends(len(heard.data) - 1)
        self.heard += [(heard.begins(index), byte) for index, byte in enumerate(heard.data)]
        self.ninth += heard.ninth or b""

    def send(self, data: bytes, ninth: bytes | None = None) -> bytes:
        """What is heard of it."""
        count = len(self.heard)
        self.medium.transmit("somebody", data, 0, ninth)
        self.kernel.run()
        assert len(self.seen[-1].outcome(self.medium.seed)) == len(self.heard) - count
        return bytes(byte for _, byte in self.heard[count:])


@pytest.mark.slow
@given(st.binary(min_size=1, max_size=50), st.floats(1e-3, 1), st.integers(0, 9))
def test_bit_errors_count_exactly_the_bits_that_differ(data: bytes, rate: float, seed: int) -> None:
    line = Line(BitErrors(rate), seed=seed)
    arrived = line.send(data)
    differ = sum((a ^ b).bit_count() for a, b in zip(arrived, data, strict=True))
    assert line.on_line[0].count == differ
    assert line.seen[0].faults == (("bit_errors",) if differ else ())
    assert line.seen[0].data == data


def test_every_data_bit_is_as_likely_to_be_inverted_and_the_ninth_is_one_of_them() -> None:
    count = 20_000
    line = Line(BitErrors(0.1), rate=LineRate(57_600, 11))
    arrived = line.send(bytes(count), bytes(count))
    struck = [sum(byte >> bit & 1 for byte in arrived) for bit in range(8)] + [sum(line.ninth)]
    assert line.on_line[0].count == sum(struck)
    assert all(abs(one - count / 10) < 4 * (count * 0.09) ** 0.5 for one in struck)
    outcome = line.seen[0].outcome_ninth(line.medium.seed)
    assert outcome == line.ninth


@pytest.mark.slow
@given(st.binary(min_size=1, max_size=80), st.integers(0, 9))
def test_what_is_dropped_leaves_a_gap_and_the_rest_comes_when_it_would_have(
    data: bytes, seed: int
) -> None:
    line = Line(Drop(0.2), seed=seed)
    # Every byte another, so that those that arrive can be told by their values.
    numbered = bytes(range(len(data)))
    line.send(numbered)
    assert [at for at, _ in line.heard] == pytest.approx(
        [RATE.span(index) for _, index in line.heard], abs=1
    )
    assert line.on_line[0].count == len(data) - len(line.heard)


@pytest.mark.slow
@given(st.integers(1, 80), st.integers(0, 9))
def test_what_comes_twice_makes_room_for_itself(size: int, seed: int) -> None:
    line = Line(Duplicate(0.2), seed=seed)
    arrived = line.send(bytes(range(size)))
    assert sorted(set(arrived)) == list(range(size)) == list(dict.fromkeys(arrived))
    assert len(arrived) == size + line.on_line[0].count
    apart = [later - one for (one, _), (later, _) in pairwise(line.heard)]
    assert all(BYTE <= one <= BYTE + 1 for one in apart)


@pytest.mark.slow
@given(st.integers(1, 80), st.integers(0, 9))
def test_what_is_late_holds_up_all_behind_it_and_nothing_is_lost(size: int, seed: int) -> None:
    line = Line(Delay(0.1, 2 * MS), seed=seed)
    assert line.send(bytes(range(size))) == bytes(range(size))
    late = [at - RATE.span(index) for at, index in line.heard]
    steps = [later - one for one, later in pairwise([0, *late])]
    assert all(-1 <= one <= 2 * MS for one in steps)
    assert sum(one > 1 for one in steps) <= line.on_line[0].count


@pytest.mark.slow
@given(
    st.lists(
        st.sampled_from((BitErrors(0.05), Drop(0.1), Duplicate(0.1), Delay(0.1, MS))), max_size=5
    ),
    st.binary(min_size=1, max_size=60),
    st.integers(0, 9),
)
def test_faults_that_act_on_the_same_bytes_get_along(
    faults: list[Fault], data: bytes, seed: int
) -> None:
    line = Line(*faults, seed=seed)
    arrived = line.send(data)
    assert line.seen[0].outcome(seed) == arrived
    begins = [at for at, _ in line.heard]
    assert all(later - one >= BYTE - 1 for one, later in pairwise(begins))


def test_a_reply_is_swapped_for_the_one_before_it() -> None:
    bench = Bench(10, 11)
    on = bench.bus.medium.add_fault(SwappedReply(1))
    for number, address in enumerate((10, 11, 10)):
        bench.hears("v100", at=(number + 1) * 50 * MS, to=address)
    bench.run()
    assert bench.answers == [ack(MOTHER, 10), ack(MOTHER, 10), ack(MOTHER, 11)]
    assert on.count == 2


def test_a_node_acts_on_what_arrives_and_when_it_does_and_not_on_what_was_sent() -> None:
    """Doubled, the first destination is one, the second the source, and the CRC is wrong."""
    bench = Bench(10)
    bench.bus.medium.add_fault(Duplicate(1))
    data = packet("v100", 10)
    sent = bench.sends(data, at=10 * MS)
    bench.run()
    assert bench.node.snapshot(bench.kernel.now).counters["nak"] == 1
    assert bench.heard[0].data == b"".join(bytes((one, one)) for one in nak(10, 10))
    # The trigger is the first byte behind the two ETX; of what follows it, all puts a NAK off.
    assert bench.heard[0].at > sent.start + bench.span(2 * len(data))
