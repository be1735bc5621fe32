"""A few steps to look at: where the most is to be learned."""

from __future__ import annotations

import pytest

from sacbus.simad import SimadError, Steps, encode
from sacbus.simad.excerpt import Excerpt, excerpt
from tests.simad.reference import as_tuples

#: A step every 100 us, clockwise; the 21st goes the other way, the 31st comes too close.
TIMES = [100_000 * number for number in range(40)]
TIMES[30] = TIMES[29] + 1_000


def chosen(times: list[int], turned: int, **how: int) -> Excerpt:
    ways = [-1 if number == turned else 1 for number in range(len(times))]
    steps = Steps.of(times, [number % 2 for number in range(len(times))], ways)
    coded = encode(steps, 2)
    return excerpt(steps, coded.falls, coded.edges, **how)


def test_it_is_about_the_first_step_that_had_to_move() -> None:
    found = chosen(TIMES, 30)
    assert found.number == 29
    assert found.due.count == found.falls.size == 10
    assert found.due.times[2] == TIMES[30] < found.falls[2]
    # With the edges from its first fall to DIR's turn for the step that follows.
    assert as_tuples(found.edges)[0] == (TIMES[28], 1, 0)
    assert found.edges.times[-1] == TIMES[37] + 500
    assert found.edges.direction == 1


def test_else_about_the_first_turn_of_dir_and_else_the_beginning() -> None:
    regular = [100_000 * number for number in range(40)]
    assert chosen(regular, 20).number == 19
    assert chosen(regular, 40).number == 1


def test_or_where_it_is_asked_for() -> None:
    assert chosen(TIMES, 30, at=TIMES[5]).number == 6
    assert chosen(TIMES, 30, at=TIMES[38] + 1, few=3).number == 40
    with pytest.raises(SimadError, match="expected an instant before the last step falls"):
        chosen(TIMES, 30, at=TIMES[39] + 1)


def test_what_falls_together_is_seen_together() -> None:
    steps = Steps.of([0, *[100_000] * 5, 100_500], [0, *range(5), 5], [1] * 7)
    coded = encode(steps, 6)
    found = excerpt(steps, coded.falls, coded.edges, at=1, few=2)
    assert (found.number, found.due.count) == (2, 6)
    # The one that had to move is the last of an instant: the others are there as well.
    steps = Steps.of([0, *[100_000] * 5], [0, *range(4), 3], [1] * 6)
    coded = encode(steps, 4)
    assert excerpt(steps, coded.falls, coded.edges).number == 2


def test_of_no_steps_there_is_nothing_to_see() -> None:
    with pytest.raises(SimadError, match="expected steps to be drawn, there are none"):
        chosen([], 0)
