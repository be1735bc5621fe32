"""The motion engine: where the motor stands, between bus time and a profile's ticks."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodes.sac.engine import LEGS_KEPT, NOMINAL, Engine
from sacbus.kernel import MS, SECOND, Ns
from sacbus.language import Motion
from sacbus.motion import Drive, Entry, Profile, Rpm, State, Timebase, lost, plan, slips
from tests.motion.reference import Setup, run
from tests.motion.strategies import drive_of, motions, setups
from tests.motion.test_against_reference import walkable

START: Ns = 5 * SECOND
TICK: Ns = 500
#: 10 RPM: no ramps, 30 ms a step.
STEP: Ns = 30 * MS

STOPPED = Timebase.external(1_000_000, 0)


def span(engine: Engine) -> tuple[Ns | None, Ns | None]:
    return engine.started, engine.end


def continuous(rpm: int, *, linear: bool = False, acc100: int = 500) -> Motion:
    return Motion(None, True, rpm, 300_000 // rpm, acc100, 100, linear)


def profile(steps: int | None = 3, *, cw: bool = True) -> Profile:
    return plan(Motion(steps, cw, 10, 30_000, 100, 100, False), Drive())


def test_a_new_engine_stands_at_zero() -> None:
    engine = Engine()
    assert (engine.profile, engine.end) == (None, None)
    assert (engine.position(0), engine.rpm(0), engine.state(0)) == (0, 0.0, State.STANDBY)


def test_the_first_pulse_is_issued_at_the_start_and_the_end_comes_with_the_last_period() -> None:
    engine = Engine()
    engine.start(profile(), START)
    assert (engine.started, engine.end) == (START, START + 3 * STEP)
    seen = [engine.position(START + at) for at in (-1, 0, STEP - 1, STEP, 2 * STEP, 9 * STEP)]
    assert seen == [0, 1, 1, 2, 3, 3]
    assert [engine.state(at) for at in (START - 1, START, START + 3 * STEP)] == [
        State.STOP,
        State.CRUISE,
        State.STOP,
    ]
    assert [engine.rpm(at) for at in (START - 1, START, START + 3 * STEP)] == [0, 10, 0]


def test_anticlockwise_counts_down() -> None:
    engine = Engine()
    engine.start(profile(cw=False), START)
    assert engine.position(START + STEP) == -2
    assert engine.rpm(START) == -10
    engine.finish(START)
    assert engine.position(START) == -3


def test_one_profile_after_another_adds_up() -> None:
    engine = Engine()
    for cw, stands in ((True, 3), (True, 6), (False, 3)):
        engine.start(profile(cw=cw), START)
        engine.finish(SECOND)
        assert engine.position(SECOND) == stands
        assert (engine.profile, engine.end) == (None, None)


def test_finishing_twice_is_finishing_once() -> None:
    engine = Engine()
    engine.start(profile(), START)
    engine.finish(SECOND)
    engine.finish(SECOND)
    assert engine.position(0) == 3


def test_a_profile_that_is_discarded_has_never_been() -> None:
    engine = Engine()
    engine.start(profile(), START)
    engine.discard()
    assert (engine.position(START + SECOND), engine.end) == (0, None)


def test_continuous_motion_has_no_end() -> None:
    engine = Engine()
    engine.start(profile(None), START)
    assert engine.end is None
    assert engine.position(START + 10**6 * STEP) == 10**6 + 1


def test_a_cut_is_made_at_the_tick_that_runs_and_moves_the_end() -> None:
    engine = Engine()
    engine.start(profile(None), START)
    asked: list[int] = []

    def halt(was: Profile, at: int) -> Profile:
        asked.append(at)
        return was.halt(at)

    engine.change(halt, START + STEP + TICK - 1)
    assert asked == [STEP // TICK]
    assert engine.end == START + STEP
    engine.finish(START + STEP)
    assert engine.position(0) == 2


def test_there_is_nothing_to_cut_where_nothing_runs() -> None:
    engine = Engine()
    engine.change(lambda was, at: was.halt(at), START)
    assert engine.profile is None


def test_single_pulses_count_without_a_profile() -> None:
    engine = Engine()
    engine.step(3)
    engine.step(-5)
    assert engine.position(0) == -2


@given(
    st.lists(
        st.tuples(st.integers(1, 500), st.booleans(), st.integers(1, 400)), min_size=1, max_size=5
    )
)
def test_whatever_was_run_the_motor_stands_where_the_steps_add_up_to(
    moves: list[tuple[int, bool, int]],
) -> None:
    engine, now, stands = Engine(), 0, 0
    for steps, cw, rpm in moves:
        motion = Motion(steps, cw, rpm, 300_000 // rpm, 100, 100, False)
        engine.start(plan(motion, Drive()), now)
        stands += steps if cw else -steps
        end = engine.end
        assert end is not None
        assert engine.position(end) == stands
        engine.finish(end)
        assert engine.position(end) == stands
        now = end + MS


# ---- the clock ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("clock", "step"),
    [
        (Timebase.internal(0), STEP),
        (Timebase.internal(100), 29_997_001),
        (Timebase.internal(-100), 30_003_001),
        (Timebase.external(1_000_000, 1_000_000), STEP),
        (Timebase.external(1_000_000, 500_000), 2 * STEP),
    ],
)
def test_pulses_come_as_the_clock_has_it(clock: Timebase, step: Ns) -> None:
    engine = Engine(clock)
    engine.start(profile(), START)
    seen = [engine.position(START + at) for at in (0, step - 1, step)]
    assert seen == [1, 1, 2]
    assert engine.end == START + clock.span(3 * 60_000)
    assert engine.rpm(START) == pytest.approx(10 * STEP / step)


def test_the_start_wait_is_counted_by_the_clock_and_loading_by_the_processor() -> None:
    engine = Engine(Timebase.internal(100_000), Timebase.external(1_000_000, 500_000))
    assert engine.processing(32) == Timebase.internal(100_000).span(32) == 14_546
    engine.start(profile(), START, wait=2_000)
    assert engine.started == START + 2 * MS
    assert [engine.begun(START + at) for at in (0, 2 * MS - 1, 2 * MS)] == [False, False, True]
    assert engine.state(START) is State.STOP


def test_no_edges_no_motion() -> None:
    engine = Engine(NOMINAL, STOPPED)
    engine.start(profile(), START, wait=2_000)
    assert span(engine) == (None, None)
    much_later = START + 10**6 * SECOND
    assert (engine.position(much_later), engine.rpm(much_later)) == (0, 0)
    assert engine.state(much_later) is State.STOP
    engine.set_clock(NOMINAL, much_later)
    assert span(engine) == (much_later + MS, much_later + MS + 3 * STEP)


def test_a_clock_that_stops_stops_the_motor_until_it_comes_back() -> None:
    engine = Engine()
    engine.start(profile(), START)
    engine.set_clock(STOPPED, START + STEP + MS)
    assert span(engine) == (START, None)
    later = START + 100 * SECOND
    assert (engine.position(later), engine.rpm(later)) == (2, 0)
    assert engine.state(later) is State.CRUISE
    engine.set_clock(Timebase.external(1_000_000, 2_000_000), later)
    # A millisecond of the second step had passed: what is left of it goes at the double.
    assert span(engine) == (START, later + (2 * STEP - MS) // 2)
    assert engine.rpm(later) == 20
    assert engine.position(later + (STEP - MS) // 2) == 3


def test_a_clock_that_changes_before_the_start_changes_what_is_left_of_the_wait() -> None:
    engine = Engine()
    engine.start(profile(), START, wait=4_000)
    engine.set_clock(Timebase.external(1_000_000, 500_000), START + MS)
    assert span(engine)[0] == START + 3 * MS
    engine.set_clock(STOPPED, START + 2 * MS)
    assert span(engine) == (None, None)
    engine.set_clock(NOMINAL, START + SECOND)
    begin = START + SECOND + MS // 2
    assert span(engine) == (begin, begin + 3 * STEP)


def test_a_clock_that_changes_before_loading_is_done_changes_nothing_yet() -> None:
    engine = Engine()
    engine.start(profile(), START)
    engine.set_clock(STOPPED, START - MS)
    assert span(engine) == (None, None)
    engine.set_clock(NOMINAL, START - MS // 2)
    assert span(engine) == (START, START + 3 * STEP)


def test_a_clock_may_change_while_the_motor_stands() -> None:
    engine = Engine()
    engine.set_clock(Timebase.external(1_000_000, 500_000), SECOND)
    assert engine.end is None
    engine.start(profile(), START)
    assert engine.end == START + 6 * STEP


def test_another_profile_may_take_the_place_of_one_that_has_not_begun() -> None:
    engine = Engine()
    engine.start(profile(), START, wait=2_000)
    engine.replace(profile(5))
    assert (engine.started, engine.end) == (START + MS, START + MS + 5 * STEP)


# ---- continuous motion --------------------------------------------------------------------------


@pytest.mark.parametrize("drive", [Drive(), Drive(ustep=3), Drive(ustep=3, auto_micro=True)])
@pytest.mark.parametrize("linear", [False, True])
def test_new_velocities_without_end_take_no_more_memory_and_change_no_pulse(
    drive: Drive, linear: bool
) -> None:
    engine = Engine()
    whole = plan(continuous(100, linear=linear), drive)
    engine.start(whole, START)
    now = START
    for number in range(60):
        now += 97_531_000 + number * 1_234_567
        motion = continuous(60 + 37 * number % 300, linear=linear)

        def to(was: Profile, at: int, motion: Motion = motion) -> Profile:
            return was.retarget(at, motion)

        engine.change(to, now)
        whole = to(whole, (now - START) // TICK)
        running = engine.profile
        assert running is not None
        assert len(running.course.legs) <= LEGS_KEPT
        for at in (now, now + 3_333_333, now + 50_000_000):
            ticks = (at - START) // TICK
            assert engine.where(at)[:2] == (whole.pulses_at(ticks), whole.travel_at(ticks))
            assert engine.rpm(at) == whole.velocity_at(ticks)
            assert engine.state(at) is whole.state_at(ticks)
    assert len(whole.course.legs) > 60
    # A stop with grace still ends on a full step, counted from the beginning.
    engine.change(lambda was, at: was.slow_down(at, 500, linear=linear), now + MS)
    slowed = whole.slow_down((now + MS - START) // TICK, 500, linear=linear)
    assert slowed.duration is not None
    assert engine.end == START + slowed.duration * TICK
    engine.finish(engine.end)
    assert engine.where(now)[:2] == (slowed.pulses, slowed.travel_at(slowed.duration))
    assert engine.where(now).microsteps % drive.m == 0


# ---- the rotor ----------------------------------------------------------------------------------

MOTOR = Drive(pull_in_rpm=100, ustep=1)


def fast(rpm: int = 200, dec100: int = 99_900, *, cw: bool = True) -> Motion:
    return Motion(400, cw, rpm, 300_000 // rpm, 99_900, dec100, False)


def test_a_rotor_that_is_lost_stands_while_pulses_go_on() -> None:
    engine = Engine()
    engine.start(plan(fast(), MOTOR), START)
    assert engine.where(START + SECOND // 2) == (667, 667, 0)
    end = engine.end
    assert end is not None
    engine.finish(end)
    assert engine.where(end) == (800, 800, 0)


def test_a_rotor_that_comes_back_has_lost_what_it_missed_for_good() -> None:
    engine = Engine()
    for cw, rotor in ((True, 19), (False, 0)):
        engine.start(plan(fast(dec100=1_000, cw=cw), MOTOR), START)
        end = engine.end
        assert end is not None
        engine.finish(end)
        # It is back for the pulses of 10 + 5 j RPM that are not above 100.
        assert engine.where(end) == (800 if cw else 0, 800 if cw else 0, rotor)


def test_a_motor_that_turns_takes_a_jump_that_one_at_rest_does_not() -> None:
    for pause, follows in ((0, True), (1, False)):
        engine = Engine()
        engine.start(plan(Motion(400, True, 200, 1_500, 100, 99_900, False), MOTOR), START)
        end = engine.end
        assert end is not None
        engine.finish(end)
        begin = end + 750_000 + pause  # one period of the last pulse, and more
        engine.start(plan(fast(), MOTOR, 200), begin)
        assert (engine.where(begin).rotor == 801) is follows


def test_a_motor_that_has_stalled_goes_on_being_lost_in_the_next_command() -> None:
    engine = Engine()
    for cw, rotor in ((True, 0), (True, 0), (False, 0)):
        engine.start(plan(fast(cw=cw), MOTOR, 200), START)
        engine.finish(START + SECOND)
        assert engine.where(START).rotor == rotor
    engine.start(plan(fast(100), MOTOR), START + 9 * SECOND)
    engine.finish(START + 10 * SECOND)
    assert engine.where(START).rotor == 800


def test_a_reversal_at_more_than_half_the_pull_in_speed_loses_the_rotor() -> None:
    for rpm, missed in ((50, 0), (60, 1)):
        engine = Engine()
        engine.start(plan(fast(rpm), MOTOR), START)
        end = engine.end
        assert end is not None
        engine.finish(end)
        engine.start(plan(fast(rpm, cw=False), MOTOR, rpm), end)
        engine.finish(end + SECOND)
        assert engine.where(end).rotor == missed


def test_single_pulses_take_the_rotor_along() -> None:
    engine = Engine()
    engine.start(plan(fast(), MOTOR), START)
    engine.finish(START + SECOND)
    engine.step(-3)
    assert engine.where(START) == (797, 797, -3)


def test_what_the_rotor_has_lost_stays_lost_however_often_the_velocity_changes() -> None:
    engine = Engine()
    engine.start(plan(continuous(200, acc100=99_900), MOTOR), START)
    whole = engine.profile
    assert whole is not None
    now = START
    gone = 0
    for number in range(40):
        now += 100 * MS
        motion = continuous((90, 150, 400)[number % 3], acc100=99_900)

        def to(was: Profile, at: int, motion: Motion = motion) -> Profile:
            return was.retarget(at, motion)

        engine.change(to, now)
        whole = to(whole, (now - START) // TICK)
        pulses = whole.pulses_at((now - START) // TICK)
        gone = lost(whole.course, slips(whole.course, MOTOR, Entry()), pulses)
        assert engine.where(now) == (pulses, pulses, pulses - gone)
    assert gone > 1_000
    assert len(whole.course.legs) > LEGS_KEPT


# ---- all of it ----------------------------------------------------------------------------------


@pytest.mark.slow
@settings(max_examples=150)
@given(data=st.data(), setup=setups, ppm=st.sampled_from([0, 0, 17, -250, 90_000]))
def test_a_session_stands_where_the_reference_has_come_to(
    data: st.DataObject, setup: Setup, ppm: int
) -> None:
    """Commands both ways, cut and uncut, asked about at any nanosecond, whatever the oscillator."""
    clock = Timebase.internal(ppm)
    engine = Engine(clock)
    drive = drive_of(setup)
    now, pulses, microsteps = START, 0, 0
    kept: Rpm = 0
    for _ in range(data.draw(st.integers(1, 6), label="commands")):
        motion = data.draw(motions(setup.sprf, steps=max(10, 1_000 // setup.m)))
        motion = walkable(setup, motion, int(kept) + 1)
        expected = run(motion, setup, kept)
        engine.start(plan(motion, drive, kept), now)
        at = data.draw(st.integers(0, expected.duration), label="at")
        cut = data.draw(st.sampled_from(["", "S", "N", "n"]), label="cut")
        moment = now + clock.span(at)
        if cut == "S":
            expected = expected.halt(at)
            engine.change(lambda was, ticks: was.halt(ticks), moment)
        elif cut == "N":
            expected = expected.cut(at)
            engine.change(lambda was, ticks: was.cut(ticks), moment)
        elif cut:
            dec100, linear = motion.dec100, motion.linear
            expected = expected.slow_down(at, dec100, linear)
            engine.change(
                lambda was, ticks, dec100=dec100, linear=linear: was.slow_down(  # type: ignore[misc]
                    ticks, dec100, linear=linear
                ),
                moment,
            )
        end = now + clock.span(expected.duration)
        assert engine.end == end
        sign = 1 if motion.cw else -1
        for looked in data.draw(st.lists(st.integers(now, end), max_size=4), label="looked at"):
            done = expected.issued((looked - now) * clock.ticks // clock.ns)
            went = sum(pulse.weight for pulse in expected.pulses[:done])
            if looked == end:
                done = len(expected.pulses)
                went = sum(pulse.weight for pulse in expected.pulses)
            assert engine.where(looked)[:2] == (pulses + sign * done, microsteps + sign * went)
            assert engine.position(looked) == pulses + sign * done
        engine.finish(end)
        pulses += sign * len(expected.pulses)
        microsteps += sign * sum(pulse.weight for pulse in expected.pulses)
        assert engine.where(end)[:2] == (pulses, microsteps)
        kept, now = expected.kept, end
