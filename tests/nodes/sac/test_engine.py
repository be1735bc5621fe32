"""The motion engine: where the motor stands, between bus time and a profile's ticks."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from nodes.sac.engine import Engine
from sacbus.kernel import MS, SECOND, Ns
from sacbus.language import Motion
from sacbus.motion import Drive, Profile, State, plan

START: Ns = 5 * SECOND
TICK: Ns = 500
#: 10 RPM: no ramps, 30 ms a step.
STEP: Ns = 30 * MS


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
