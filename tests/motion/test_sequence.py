"""How a command begins after another: the rule, and a real node beside it, to the tick."""

from __future__ import annotations

from typing import Final

from hypothesis import example, given, settings
from hypothesis import strategies as st

from nodes.sac import SacSettings
from sacbus.kernel import MS, Ns
from sacbus.language import Motion
from sacbus.motion import NO_RAMP, REST, Drive, Left, begin, plan, release
from tests.nodes.sac.bench import NODE, Bench

TICK: Final[Ns] = 500
SPEED: Final = 100


def motion(
    steps: int,
    cycle_us: int = 3000,
    *,
    acc: int = NO_RAMP,
    dec: int = NO_RAMP,
    linear: bool = True,
    wait_us: int = 0,
    cw: bool = True,
) -> Motion:
    rpm = 300_000 // cycle_us
    return Motion(steps, cw, rpm, cycle_us, acc, dec, linear=linear, wait_us=wait_us)


def left(of: Motion, *, ustep: int = 0) -> Left:
    return Left.by(plan(of, Drive(ustep=ustep)))


def test_a_command_that_has_the_velocity_of_the_one_before_begins_with_its_end() -> None:
    assert begin(motion(10), left(motion(10)), 1_000) == (1_032, 1_000, SPEED)


def test_another_acceleration_takes_longer_to_load_but_not_to_begin() -> None:
    assert begin(motion(10, acc=500), left(motion(10)), 1_000) == (1_080, 1_000, SPEED)


def test_where_loading_outlasts_the_last_pulse_the_velocity_is_lost() -> None:
    # 312 RPM at 32 microsteps: 60 ticks a pulse, in which 16 us can be loaded, and 40 us cannot.
    fast = motion(10, 960)
    assert begin(fast, left(fast, ustep=5), 0) == (32, 0, 312)
    assert begin(motion(10, 960, acc=500), left(fast, ustep=5), 0) == (80, 80, 0)
    kept = begin(motion(10, 960, acc=500), left(fast, ustep=5), 0, gap=False)
    assert kept == (80, 0, 312)


def test_after_coming_to_rest_loading_takes_its_time() -> None:
    assert begin(motion(10), left(motion(10, dec=500)), 1_000) == (1_080, 1_080, 0)


def test_a_start_wait_within_the_last_period_keeps_the_velocity_and_loading_adds_to_it() -> None:
    assert begin(motion(10, wait_us=2_984), left(motion(10)), 0) == (32, 5_968 + 32, SPEED)
    assert begin(motion(10, wait_us=2_985), left(motion(10)), 0) == (32, 5_970 + 32, 0)


def test_below_an_rpm_nothing_is_kept() -> None:
    assert begin(motion(1, 400_000), left(motion(1, 400_000)), 0) == (32, 32, 0)


def test_the_first_command_of_all_is_loaded_already() -> None:
    assert begin(motion(1, wait_us=7), REST, 100) == (100, 114, 0)


def test_a_command_that_was_held_begins_when_it_is_released() -> None:
    assert release(motion(1), 100) == (100, 100, 0)
    assert release(motion(1, wait_us=50), 100) == (100, 200, 0)


# ------------------------------------------------------------------------ a real node beside it

cycles = st.sampled_from([1_000, 1_001, 2_999, 3_000, 5_000, 27_272, 30_000, 70_000, 400_000])
accelerations = st.sampled_from([NO_RAMP, NO_RAMP, 500, 501, 5_000])
commands = st.builds(
    motion,
    st.integers(1, 40),
    cycles,
    acc=accelerations,
    dec=st.sampled_from([NO_RAMP, NO_RAMP, NO_RAMP, 99_800, 5_000]),
    linear=st.sampled_from([True, True, False]),
    wait_us=st.sampled_from([0, 0, 0, 1, 900, 20_000]),
    cw=st.booleans(),
)


def text(one: Motion, *, sync: bool) -> str:
    minus = "" if one.cw else "-"
    acc, dec = (f"{figure / 100:g}" for figure in (one.acc100, one.dec100))
    wait = f"t{one.wait_us}" if one.wait_us else ""
    held = "s" if sync else ""
    return f"m{minus}{one.steps}vc{one.cycle_us}a{acc}d{dec}l{int(one.linear)}{wait}{held}"


@example(motions=[motion(3), motion(3, cw=False), motion(3, wait_us=900), motion(2, 400_000)], u=0)
@example(motions=[motion(9, 1_000), motion(9, 1_001), motion(9, 1_000, dec=5_000)], u=4)
@settings(max_examples=60)
@given(st.lists(commands, min_size=2, max_size=7), st.sampled_from([0, 0, 1, 4]))
def test_commands_that_are_held_and_released_begin_in_a_node_as_the_rule_says(
    motions: list[Motion], u: int
) -> None:
    bench = Bench(settings=SacSettings(ustep=u))
    for number, one in enumerate(motions):
        bench.hears(text(one, sync=not number), at=(number + 1) * 20 * MS, to=NODE)
    released = 200 * MS
    bench.hears("y", at=released)
    drive = Drive(ustep=u)
    before, end, position = REST, 0, 0
    for number, one in enumerate(motions):
        beginning = begin(one, before, end) if number else release(one, 0)
        profile = plan(one, drive, beginning.start_rpm)
        assert profile.duration is not None
        before, end = Left.by(profile), beginning.start + profile.duration
        # Every pulse comes at its very tick: a tick earlier it is not there yet.
        for pulse, tick in enumerate(profile.pulse_times(0, profile.duration)[:12], start=1):
            at = released + int(beginning.start + tick) * TICK
            there = position + (pulse if one.cw else -pulse)
            if at > bench.kernel.now + 1:
                assert bench.position(at - 1) != there
            assert bench.position(at) == there
        pulses = profile.pulses or 0
        position += pulses if one.cw else -pulses
    bench.run()
    assert bench.position(bench.kernel.now) == position
    assert bench.kernel.now >= released + end * TICK
