"""Where a node is by plan, and between which bounds by mother's clock."""

from __future__ import annotations

import pytest

from sacbus.kernel import MS, SECOND, US
from sacbus.language import Motion, Move, Session, parse
from sacbus.mother.timeline import Departure, NotStreamable, Timeline, Times, check_streamed
from sacbus.motion import Drive


def motion(line: str) -> Motion:
    command = parse(line).command
    assert isinstance(command, Move)
    return Session().resolve(command)[0]


def test_commands_follow_each_other_as_the_node_runs_them() -> None:
    timeline = Timeline(Drive())
    assert timeline.end == 0
    assert timeline.add(motion("m100v60a999d999")) == Times(0, 0, 500 * MS)
    # Seamless: loaded within the last period.
    assert timeline.add(motion("m100v60a999d999t0")) == Times(
        500 * MS + 16 * US, 500 * MS, 1_000 * MS
    )
    # A wait parts them, and loading comes on top of it.
    assert timeline.add(motion("m100v60a999d999t1000")).start == 1_001 * MS + 16 * US
    assert timeline.end == 1_501 * MS + 16 * US


def test_after_a_halt_time_begins_anew() -> None:
    timeline = Timeline(Drive())
    timeline.add(motion("m100v60a999d999"))
    timeline.halt()
    assert timeline.end == 0
    assert timeline.add(motion("m100v60a999d999")).start == 16 * US


def test_without_gap_a_velocity_is_kept_over_any_wait() -> None:
    ends = []
    for gap in (True, False):
        timeline = Timeline(Drive(), gap=gap)
        timeline.add(motion("m200v100a1d999"))
        timeline.add(motion("m200v100a1d999t1000000"))
        ends.append(timeline.end)
    assert ends[1] < ends[0]


@pytest.mark.parametrize(
    ("line", "told"), [("m", "it never ends, give it steps"), ("m1s", "take its sync out")]
)
def test_what_nobody_knows_the_end_of_is_refused(line: str, told: str) -> None:
    with pytest.raises(NotStreamable, match=told):
        check_streamed(motion(line))
    with pytest.raises(NotStreamable, match=told):
        Timeline(Drive()).add(motion(line))


def test_a_planned_time_lies_between_two_bounds() -> None:
    departure = Departure(earliest=SECOND, latest=SECOND + 10 * MS, drift_ppm=1_000)
    assert departure.not_before(0) == SECOND
    assert departure.not_before(10 * SECOND) == 11 * SECOND - 10 * MS
    assert departure.surely_by(0) == SECOND + 15 * MS
    assert departure.surely_by(10 * SECOND) == 11 * SECOND + 25 * MS
