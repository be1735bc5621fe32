"""An axis that follows a law: pulses near their ideal times, whatever the law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sacbus.motion import Drive
from sacbus.toolpath import Axis, AxisRun, Law, Phase, Pulses, follow
from sacbus.toolpath.line import line_law
from sacbus.toolpath.share import TICKS_PER_SECOND, sweeps


def axis(ustep: int = 0) -> Axis:
    return Axis("X", 10, 100.0, drive=Drive(ustep=ustep))


def off(of: Axis, run: AxisRun, steps: list[int], law: Law) -> float:
    """Full steps by which a pulse is early or late at most."""
    times = Pulses(of, run).times(0, run.end).tolist()
    worst, at = 0.0, 0
    for sweep in sweeps(steps, law):
        for pulse in range(sweep.steps * of.drive.m):
            place = (pulse + 0.5) / of.drive.m
            worst = max(worst, abs(sweep.at(times[at]) - place))
            at += 1
    assert at == len(times)
    return worst


def even(steps: list[int], per_second: float) -> Law:
    """Segments at a rate of the axis, and a quarter of a second where it does not move."""
    return tuple(
        Phase(at, 0.0, 1.0, abs(count) / per_second if count else 0.25, 1.0, 1.0)
        for at, count in enumerate(steps)
    )


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(-60, 60), min_size=1, max_size=8),
    st.floats(1, 36),
    st.sampled_from([0, 1, 4]),
)
@example([1, 0, 0, -1, 1], 30.0, 0)
def test_at_constant_velocity_every_pulse_is_on_time(
    steps: list[int], per_second: float, u: int
) -> None:
    of, law = axis(ustep=u), even(steps, per_second)
    run = follow(of, 0, steps, law)
    if not any(steps):
        assert run is None
        return
    assert run is not None
    assert run.steps == sum(steps)
    # The microsteps of a last full step come sooner, lest everybody waits for its last period.
    assert off(of, run, steps, law) <= (0.13 if u else 0.1)
    assert run.starts[0] == run.motions[0].wait_us * 2
    assert list(run.loaded) == sorted(run.loaded)
    assert run.loaded[0] == 0


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.integers(1, 300), st.floats(0.3, 30), st.floats(1, 200), st.sampled_from([0, 2]))
def test_a_slow_axis_is_led_up_and_down_by_pieces(
    steps: int, seconds: float, per_second: float, u: int
) -> None:
    # Its own velocity stays below slow; how long the ramps take is the others' business.
    speed = min(per_second, 36.0)
    length = steps / 100
    acceleration = max(speed / 100 / seconds, (speed / 100) ** 2 / length / 0.8)
    law = line_law(length, speed / 100, acceleration)
    of = axis(ustep=u)
    run = follow(of, 0, [steps], law)
    assert run is not None
    assert all(motion.acc100 == 99_900 for motion in run.motions)
    # A single step may have a shorter period: nothing follows that it would be too quick for. And
    # pieces begin and end a little aside of the ideal motion.
    assert all(motion.rpm <= 12 for motion in run.motions if motion.steps != 1)
    assert off(of, run, [steps], law) <= 0.36
    end = sum(phase.seconds for phase in law) * TICKS_PER_SECOND
    assert abs(run.end - end) <= max(run.end - run.starts[-1], 60_000)


def test_two_segments_at_one_velocity_are_one_command() -> None:
    run = follow(axis(), 0, [30, 20, 50], even([30, 20, 50], 30.0))
    assert run is not None
    assert [motion.steps for motion in run.motions] == [100]


def test_velocities_change_where_segments_meet() -> None:
    law = (Phase(0, 0.0, 1.0, 1.0, 1.0, 1.0), Phase(1, 0.0, 1.0, 1.0, 1.0, 1.0))
    run = follow(axis(), 0, [30, 20], law)
    assert run is not None
    assert [motion.steps for motion in run.motions] == [30, 20]
    assert run.starts[1] == pytest.approx(TICKS_PER_SECOND * 1.025, abs=40)


def test_an_axis_that_stands_still_meanwhile_waits() -> None:
    law = even([30, 0, 30], 30.0)
    run = follow(axis(), 0, [30, 0, 30], law)
    assert run is not None
    assert [motion.steps for motion in run.motions] == [30, 30]
    assert run.motions[1].wait_us > 200_000
    assert off(axis(), run, [30, 0, 30], law) < 0.01


@pytest.mark.slow
@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from([-40, -9, -2, -1, 0, 1, 2, 9, 40]), st.floats(0.5, 33)),
        min_size=1,
        max_size=8,
    ),
    st.sampled_from([0, 3]),
)
@example([(1, 2.2), (-10, 72.0)], 3)
@example([(1, 2.2), (-10, 72.0)], 0)
@example([(-1, 13.0), (16, 180.0)], 0)
def test_no_step_comes_much_sooner_than_the_law_has_steps(
    moves: list[tuple[int, float]], u: int
) -> None:
    of, steps = axis(ustep=u), [count for count, _ in moves]
    law = tuple(
        Phase(at, 0.0, 1.0, max(abs(count), 1) / per_second, 1.0, 1.0)
        for at, (count, per_second) in enumerate(moves)
    )
    run = follow(of, 0, steps, law)
    if run is None:
        return
    periods = np.diff(Pulses(of, run).times(0, run.end))
    # What an axis is late by is not made good by a single quick step: half a jump is the most.
    jump = of.jump * of.drive.steps_per_rev / 60
    fastest = max(per_second for count, per_second in moves if count) + jump / 2
    assert not periods.size or periods.min() * fastest * of.drive.m >= 0.97 * TICKS_PER_SECOND


def test_a_reversal_is_another_command_the_other_way() -> None:
    of = Axis("X", 10, 100.0, inverted=True)
    run = follow(of, 0, [30, -30], even([30, -30], 30.0))
    assert run is not None
    assert [motion.cw for motion in run.motions] == [False, True]
    assert run.steps == 0


def test_ramp_cruise_and_ramp_are_one_command_where_one_cycle_does() -> None:
    law = line_law(10.0, 5.0, 25.0)
    run = follow(axis(), 0, [1_000], law)
    assert run is not None
    (motion,) = run.motions
    assert (motion.rpm, motion.cycle_us, motion.steps) == (150, 2_000, 1_000)
    assert off(axis(), run, [1_000], law) < 0.5


def test_where_commands_are_few_it_follows_less_closely() -> None:
    of, law = axis(), line_law(3.0, 0.30, 0.05)
    close = follow(of, 0, [300], law)
    loose = follow(of, 0, [300], law, commands_max=8)
    assert close is not None
    assert loose is not None
    assert len(close.motions) > 8 >= len(loose.motions)
    assert off(of, close, [300], law) < off(of, loose, [300], law)
    # Not even one piece a way will do: then it says so by what it gives.
    back = follow(of, 0, [10, -10, 10], even([10, -10, 10], 30.0), commands_max=2)
    assert back is not None
    assert len(back.motions) == 3


def test_it_leaves_nothing_to_what_comes_after_the_block() -> None:
    for law in (even([30], 30.0), line_law(0.3, 5.0, 25.0)):
        run = follow(axis(), 0, [30], law)
        assert run is not None
        assert Pulses(axis(), run).profiles[-1].kept_rpm == 0


def test_ramps_keep_to_the_acceleration_they_are_allowed() -> None:
    law = line_law(10.0, 5.0, 25.0)
    asked = 25.0 * 100 / (200 / (2 * 3.141592653589793))
    run = follow(axis(), 0, [1_000], law, acceleration=asked)
    assert run is not None
    assert all(min(one.acc100, one.dec100) <= asked * 100 + 1e-6 for one in run.motions)
