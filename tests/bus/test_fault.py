"""A fault on a medium: its chance, its count, when it begins and ends, and what it costs others."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.bus import BitErrors, Bus, Dead, Drop, Medium, Transmission
from sacbus.bus.fault import Gaps
from sacbus.kernel import MS, SECOND, Kernel, Ns
from tests.bus.strategies import ADDRESSES, traffic
from tests.nodes.sac.bench import Bench

ZEROS = bytes(1_000)


def line(seed: int = 0) -> tuple[Kernel, Medium, list[Transmission]]:
    """A line without nodes, and what has been on it."""
    kernel = Kernel()
    medium = Bus(kernel, KIND.protocol, seed=seed).medium
    seen: list[Transmission] = []
    medium.watchers.append(seen.append)
    return kernel, medium, seen


def outcomes(medium: Medium, seen: list[Transmission]) -> list[bytes]:
    return [sent.outcome(medium.seed) for sent in seen]


# ---- chance -------------------------------------------------------------------------------------


@pytest.mark.slow
@given(st.floats(1e-300, 1), st.lists(st.integers(0, 500)), st.integers(0, 99))
def test_gaps_are_the_same_however_the_things_are_cut_into_rows(
    rate: float, rows: list[int], seed: int
) -> None:
    apart, together = Gaps(rate, Random(seed)), Gaps(rate, Random(seed))
    found: list[int] = []
    begin = 0
    for row in rows:
        found += [begin + place for place in apart.among(row)]
        begin += row
    assert found == together.among(begin)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1e-3, 0.03, 0.5, 1])
def test_things_are_struck_as_often_as_the_rate_says(rate: float) -> None:
    count = 200_000
    struck = Gaps(rate, Random(1)).among(count)
    assert struck == sorted(set(struck))
    spread = 4 * (count * rate * (1 - rate)) ** 0.5
    assert abs(len(struck) - count * rate) <= spread


def test_a_fault_more_shifts_nothing_in_those_before_it() -> None:
    def run(*, more: bool) -> list[bytes]:
        kernel, medium, seen = line()
        medium.add_fault(Dead(200)).off()
        medium.add_fault(BitErrors(0.01))
        if more:
            medium.add_fault(Dead(7))
        for _ in range(20):
            medium.transmit("a", ZEROS, 0)
            kernel.run()
        return outcomes(medium, seen)

    assert run(more=True) == run(more=False)


def test_two_faults_of_one_kind_and_two_buses_of_one_kernel_have_chances_of_their_own() -> None:
    kernel = Kernel()
    buses = [Bus(kernel, KIND.protocol, seed=seed) for seed in (1, 2)]
    on_line = [bus.medium.add_fault(BitErrors(0.5)) for bus in (*buses, buses[0])]
    drawn = [on.random.random() for on in on_line]
    assert len(set(drawn)) == 3


# ---- on and off ---------------------------------------------------------------------------------


def test_a_fault_acts_from_when_it_is_put_on_until_it_is_taken_off() -> None:
    kernel, medium, seen = line()
    told: list[tuple[Ns, str, bool]] = []
    medium.fault_watchers.append(lambda on: told.append((kernel.now, on.name, on.is_on)))
    for second in range(6):
        kernel.at(second * SECOND, medium.transmit, "a", b"A", 0)
    kernel.run_until(2 * SECOND - 1)
    on = medium.add_fault(Drop(1))
    kernel.run_until(4 * SECOND - 1)
    on.off()
    kernel.run()
    assert outcomes(medium, seen) == [b"A", b"A", b"", b"", b"A", b"A"]
    assert on.count == 2
    assert on.since == 2 * SECOND - 1
    assert told == [(2 * SECOND - 1, "drop", True), (4 * SECOND - 1, "drop", False)]


def test_taking_a_fault_off_twice_is_no_mistake_and_others_stay() -> None:
    _, medium, _ = line()
    gone, stays = medium.add_fault(Drop(1)), medium.add_fault(Drop(1))
    gone.off()
    gone.off()
    assert medium.faults == [stays]
    assert (gone.is_on, stays.is_on) == (False, True)


def test_what_began_under_a_fault_ends_under_it_and_what_began_before_is_spared() -> None:
    kernel, medium, seen = line()
    before = medium.transmit("a", b"AAAA", 0)
    kernel.run_until(before.end // 2)
    on = medium.add_fault(Drop(1))
    kernel.run()
    under = medium.transmit("a", b"BBBB", 0)
    kernel.run_until((under.start + under.end) // 2)
    on.off()
    kernel.run()
    assert outcomes(medium, seen) == [b"AAAA", b""]
    assert [sent.faults for sent in seen] == [(), ("drop",)]


def test_the_same_fault_may_be_on_several_lines_and_each_counts_its_own() -> None:
    fault = Drop(1)
    (kernel, one, _), (_, other, _) = line(), line()
    on_line = one.add_fault(fault), other.add_fault(fault)
    one.transmit("a", b"AB", 0)
    kernel.run()
    assert [on.count for on in on_line] == [2, 0]


# ---- what it costs others -----------------------------------------------------------------------


def talk_over_each_other(bench: Bench, talk: list[tuple[Ns, bytes]]) -> list[object]:
    """Bursts by different talkers that overlap at times."""
    for number, (pause, data) in enumerate(talk):
        bench.sends(data, at=number * 2 * MS + pause % MS, sender=f"talker {number % 3}")
    bench.kernel.run_until(20 * SECOND)
    return bench.transcript()


@pytest.mark.slow
@given(traffic(), st.sampled_from((1, 2)))
def test_a_line_whose_fault_touches_nobody_does_exactly_what_one_without_faults_does(
    talk: list[tuple[Ns, bytes]], lanes: int
) -> None:
    """A dead node that is not there has everything go the way of what faults touch."""
    plain, faulty = (Bench(*ADDRESSES, lanes=lanes, seed=3) for _ in range(2))
    on = faulty.bus.medium.add_fault(Dead(99))
    expected, got = talk_over_each_other(plain, talk), talk_over_each_other(faulty, talk)
    assert got == expected
    assert on.count == 0
