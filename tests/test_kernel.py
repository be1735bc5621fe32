"""The event queue, the clock and the arithmetic of line time."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import MS, SECOND, US, Appointment, Kernel, LineRate

RATES = st.builds(LineRate, st.integers(300, 2_000_000), st.sampled_from((10, 11)))
COUNTS = st.integers(0, 300)


# ---- line time ----------------------------------------------------------------------------------


def test_a_byte_at_38400_baud_takes_ten_bits_and_260_microseconds() -> None:
    assert LineRate().span(1) == 260_416
    assert LineRate(38_400, bits=11).span(1) == 286_458


def test_the_line_time_of_a_run_is_truncated_once_and_not_per_byte() -> None:
    rate = LineRate()
    assert rate.span(3) == 781_250 > 3 * rate.span(1)
    assert rate.span(38_400) == 10 * SECOND


@given(RATES, COUNTS)
def test_the_line_time_is_that_of_exact_arithmetic_for_short_and_long_runs(
    rate: LineRate, count: int
) -> None:
    assert rate.span(count) == int(Fraction(count * rate.bits * SECOND, rate.baud))


@given(RATES, COUNTS, st.integers(-2, 2))
def test_bytes_begun_are_those_whose_start_bit_lies_before_the_moment(
    rate: LineRate, count: int, off: int
) -> None:
    moment = rate.span(count) + off
    expected = sum(rate.span(index) < moment for index in range(count + 3))
    assert rate.bytes_begun(moment) == expected


# ---- events -------------------------------------------------------------------------------------


def test_a_kernel_starts_where_it_is_told_with_nothing_due() -> None:
    kernel = Kernel(start=7 * MS)
    assert (kernel.now, kernel.next_at(), kernel.run_next(), kernel.run()) == (
        7 * MS,
        None,
        False,
        0,
    )
    assert kernel.now == 7 * MS


def test_events_find_the_clock_at_their_own_time() -> None:
    kernel = Kernel()
    seen: list[tuple[str, int]] = []
    for name, when in (("late", 30), ("early", 10), ("middle", 20)):
        kernel.at(when, lambda name: seen.append((name, kernel.now)), name)
    assert kernel.run_until(25) == 2
    assert seen == [("early", 10), ("middle", 20)]
    assert kernel.now == 25
    assert kernel.run() == 1
    assert seen[-1] == ("late", 30)
    assert kernel.now == 30


def test_an_event_at_the_very_limit_runs() -> None:
    kernel = Kernel()
    ran: list[int] = []
    kernel.at(10, ran.append, 1)
    assert kernel.run_until(9) == 0
    assert kernel.run_until(10) == 1


def test_events_of_one_instant_run_in_the_order_in_which_they_were_scheduled() -> None:
    kernel = Kernel()
    ran: list[int] = []
    for number in range(50):
        kernel.at(5, ran.append, number)
    kernel.run()
    assert ran == list(range(50))


def test_a_time_that_has_passed_means_now_and_the_clock_never_goes_back() -> None:
    kernel = Kernel()
    kernel.run_until(100)
    seen: list[int] = []
    kernel.at(20, lambda: seen.append(kernel.now))
    assert kernel.next_at() == 100
    kernel.run_until(50)
    assert (seen, kernel.now) == ([], 100)
    kernel.run_until(100)
    assert (seen, kernel.now) == ([100], 100)


def test_events_that_events_schedule_run_in_the_same_go_if_they_are_due() -> None:
    kernel = Kernel()
    seen: list[int] = []

    def again(left: int) -> None:
        seen.append(kernel.now)
        if left:
            kernel.at(kernel.now + 10, again, left - 1)

    kernel.at(0, again, 9)
    assert kernel.run_until(45) == 5
    assert seen == [0, 10, 20, 30, 40]
    assert kernel.next_at() == 50
    assert kernel.run() == 5


def test_a_cancelled_event_neither_runs_nor_counts_nor_is_next() -> None:
    kernel = Kernel()
    ran: list[str] = []
    first = kernel.at(10, ran.append, "first")
    kernel.at(20, ran.append, "second")
    kernel.cancel(first)
    kernel.cancel(first)
    assert kernel.next_at() == 20
    assert kernel.run() == 1
    assert ran == ["second"]
    assert kernel.ran == 1


def test_cancelling_what_has_run_is_no_mistake() -> None:
    kernel = Kernel()
    ran: list[int] = []
    done = kernel.at(10, ran.append, 1)
    kernel.run()
    kernel.cancel(done)
    assert ran == [1]


def test_an_event_may_cancel_one_of_its_own_instant() -> None:
    kernel = Kernel()
    ran: list[str] = []
    later: list[Appointment] = []
    kernel.at(10, lambda: kernel.cancel(later[0]))
    later.append(kernel.at(10, ran.append, "never"))
    kernel.run()
    assert ran == []


def test_the_next_instant_runs_whole_and_no_further() -> None:
    kernel = Kernel()
    ran: list[int] = []
    for when in (10, 10, 20):
        kernel.at(when, ran.append, when)
    assert kernel.run_next()
    assert (ran, kernel.now) == ([10, 10], 10)


def test_time_passes_until_a_moment_only_if_nothing_is_due_by_then() -> None:
    kernel = Kernel()
    kernel.at(5, print)
    kernel.at_leisure(3, print)
    assert (kernel.pass_until(2), kernel.now) == (True, 2)
    assert (kernel.pass_until(1), kernel.now) == (True, 2)
    assert (kernel.pass_until(3), kernel.now) == (False, 2)
    assert (kernel.pass_until(5), kernel.now) == (False, 2)
    assert (kernel.ran, kernel.next_at()) == (0, 3)


@pytest.mark.parametrize(("pausable", "heard"), [(True, "abc"), (False, "abcd")])
def test_a_pause_ends_a_run_that_allows_it_behind_the_present_instant(
    pausable: bool, heard: str
) -> None:
    kernel = Kernel()
    ran: list[str] = []

    def pauses() -> None:
        ran.append("b")
        kernel.pause()
        kernel.at(kernel.now, ran.append, "c")

    kernel.at(1, ran.append, "a")
    kernel.at(2, pauses)
    kernel.at(3, ran.append, "d")
    assert kernel.run_due(10, pausable=pausable) == len(heard)
    assert "".join(ran) == heard
    kernel.run_until(10)
    assert (ran, kernel.now) == (["a", "b", "c", "d"], 10)


@pytest.mark.parametrize(("within", "heard"), [(True, []), (False, [5])])
def test_a_pause_in_a_run_within_another_ends_both_if_the_outer_one_is_pausable(
    within: bool, heard: list[int]
) -> None:
    kernel = Kernel()
    ran: list[int] = []

    def looks_ahead() -> None:
        kernel.at(2, kernel.pause)
        kernel.at(3, ran.append, 3)
        kernel.run_due(3)
        assert kernel.running

    kernel.at(1, looks_ahead)
    kernel.at(5, ran.append, 5)
    kernel.run_due(9, pausable=within)
    assert (ran, kernel.running) == ([3, *heard], False)


def test_a_pause_outside_of_a_run_ends_no_later_one() -> None:
    kernel = Kernel()
    ran: list[int] = []
    kernel.at(1, ran.append, 1)
    kernel.at(2, ran.append, 2)
    kernel.pause()
    kernel.run_due(9, pausable=True)
    assert (ran, kernel.running) == ([1, 2], False)


def test_an_error_comes_out_and_leaves_the_clock_at_its_event_and_the_rest_due() -> None:
    kernel = Kernel()
    ran: list[int] = []

    def break_down() -> None:
        raise ZeroDivisionError

    kernel.at(10, break_down)
    kernel.at(20, ran.append, 20)
    with pytest.raises(ZeroDivisionError):
        kernel.run_until(50)
    assert (kernel.now, kernel.ran) == (10, 1)
    kernel.run_until(50)
    assert (ran, kernel.now, kernel.ran) == ([20], 50, 2)


@pytest.mark.slow
@given(st.lists(st.tuples(st.integers(0, 40), st.booleans())), st.lists(st.integers(0, 50)))
def test_whatever_is_scheduled_runs_by_time_and_then_by_order(
    events: list[tuple[int, bool]], stops: list[int]
) -> None:
    kernel = Kernel()
    ran: list[tuple[int, int]] = []
    for number, (when, cancelled) in enumerate(events):
        appointment = kernel.at(when, lambda n, w: ran.append((w, n)), number, when)
        if cancelled:
            kernel.cancel(appointment)
    clocks = []
    for stop in stops:
        kernel.run_until(stop)
        clocks.append(kernel.now)
    kernel.run()
    assert ran == sorted((when, at) for at, (when, cancelled) in enumerate(events) if not cancelled)
    assert clocks == sorted(clocks)


# ---- quiet events -------------------------------------------------------------------------------


def test_quiet_events_and_others_of_one_instant_run_in_the_order_of_their_scheduling() -> None:
    kernel = Kernel()
    ran: list[int] = []
    for number in range(50):
        make = kernel.at_leisure if number % 3 else kernel.at
        make(5, ran.append, number)
    kernel.run()
    assert ran == list(range(50))


def test_it_can_be_asked_when_the_next_event_is_due_that_is_not_quiet() -> None:
    kernel = Kernel()
    assert kernel.next_loud_at() is None
    kernel.at_leisure(10, lambda: None)
    assert (kernel.next_at(), kernel.next_loud_at()) == (10, None)
    kernel.at(30, lambda: None)
    kernel.at_leisure(40, lambda: None)
    assert (kernel.next_at(), kernel.next_loud_at()) == (10, 30)
    kernel.run_until(20)
    assert (kernel.next_at(), kernel.next_loud_at()) == (30, 30)
    kernel.run_until(30)
    assert (kernel.next_at(), kernel.next_loud_at()) == (40, None)


def test_a_quiet_event_whose_time_has_passed_runs_now() -> None:
    kernel = Kernel(start=100)
    seen: list[int] = []
    kernel.at_leisure(20, lambda: seen.append(kernel.now))
    assert kernel.run_until(100) == 1
    assert seen == [100]


def test_cancelled_appointments_of_both_kinds_are_passed_over_and_do_not_pile_up() -> None:
    kernel = Kernel()
    ran: list[str] = []
    for make, kept in ((kernel.at, 50), (kernel.at_leisure, 40)):
        kernel.cancel(make(10, ran.append, "cancelled"))
        make(kept, ran.append, make.__name__)
    assert (kernel.next_at(), kernel.next_loud_at()) == (40, 50)
    for number in range(10_000):
        make = kernel.at_leisure if number % 2 else kernel.at
        kernel.cancel(make(10 * SECOND + number, ran.append, "cancelled"))
    assert len(kernel._loud) + len(kernel._quiet) < 200
    assert kernel.run() == 2
    assert ran == ["at_leisure", "at"]


def test_a_quiet_event_that_is_hastened_is_quiet_no_more_and_keeps_its_place() -> None:
    kernel = Kernel()
    ran: list[str] = []
    kernel.at(10, ran.append, "before")
    quiet = kernel.at_leisure(10, ran.append, "hastened")
    kernel.at(10, ran.append, "behind")
    kernel.hasten(quiet)
    kernel.hasten(quiet)
    assert kernel.run_until(9) == 0
    assert kernel.next_loud_at() == 10
    assert kernel.run_until(10) == 3
    assert ran == ["before", "hastened", "behind"]
    assert kernel.next_at() is None


def test_what_was_hastened_can_be_cancelled_and_leaves_nothing_behind() -> None:
    kernel = Kernel()
    ran: list[str] = []
    for _ in range(1_000):
        hastened = kernel.at_leisure(10, ran.append, "never")
        kernel.hasten(hastened)
        kernel.cancel(hastened)
    assert len(kernel._loud) + len(kernel._quiet) < 200
    kept = kernel.at_leisure(20, ran.append, "kept")
    kernel.hasten(kept)
    for number in range(1_000):
        kernel.cancel(kernel.at_leisure(30 + number, ran.append, "never"))
    assert kernel.next_at() == kernel.next_loud_at() == 20
    assert kernel.run() == 1
    assert (ran, kernel._cancelled) == (["kept"], 0)


def test_hastening_what_is_not_quiet_or_not_there_any_more_changes_nothing() -> None:
    kernel = Kernel()
    ran: list[str] = []
    done, gone = (kernel.at_leisure(10, ran.append, "quiet") for _ in range(2))
    loud = kernel.at(20, ran.append, "loud")
    kernel.cancel(gone)
    kernel.run_until(10)
    for one in (done, gone, loud):
        kernel.hasten(one)
    assert kernel.run() == 1
    assert ran == ["quiet", "loud"]


class Making(NamedTuple):
    """An appointment so much later, and what becomes of it; it makes the next at its time."""

    wait: int
    quiet: bool
    fate: Literal["runs", "is cancelled", "is hastened"]
    more: int


makings = st.builds(
    Making,
    st.integers(0, 20),
    st.booleans(),
    st.sampled_from(("runs", "runs", "is cancelled", "is hastened")),
    st.integers(0, 2),
)


@pytest.mark.slow
@given(st.lists(makings, max_size=30), st.lists(st.integers(0, 80)))
def test_any_mix_of_quiet_events_and_others_runs_in_the_order_of_one_heap(
    plan: list[Making], stops: list[int]
) -> None:
    def play(*, all_loud: bool) -> list[tuple[int, int]]:
        kernel = Kernel()
        left = list(reversed(plan))
        ran: list[tuple[int, int]] = []

        def happen(number: int, more: int) -> None:
            ran.append((kernel.now, number))
            for _ in range(more):
                make()

        def make() -> None:
            if not left:
                return
            wait, quiet, fate, more = left.pop()
            choose = kernel.at_leisure if quiet and not all_loud else kernel.at
            appointment = choose(kernel.now + wait, happen, len(left), more)
            if fate == "is cancelled":
                kernel.cancel(appointment)
            elif fate == "is hastened":
                kernel.hasten(appointment)

        for _ in range(10):
            make()
        for stop in stops:
            kernel.run_until(stop)
            ran.append((kernel.now, kernel.next_at() or -1))
        kernel.run()
        return ran

    assert play(all_loud=False) == play(all_loud=True)


def test_units_are_nanoseconds() -> None:
    assert (US, MS, SECOND) == (10**3, 10**6, 10**9)


def test_cancelled_appointments_do_not_pile_up() -> None:
    kernel = Kernel()
    kept = kernel.at(SECOND, lambda: None)
    for number in range(10_000):
        kernel.cancel(kernel.at(10 * SECOND + number, lambda: None))
    assert len(kernel._loud) < 200
    assert kernel.next_at() == SECOND
    assert kernel.run() == 1
    kernel.cancel(kept)
