"""Oscillator, external clock, gears and motor of a node, as they show on the line and in the table.

At 10 RPM, which is `slow`, there are no ramps: a full step lasts 30 ms.
"""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.node import ReportKind, SettingError, settings_from
from sacbus.wire import DC1, DC2, GENERAL_CALL
from tests.nodes.sac.bench import LOAD_ACC, NODE, Bench, packet

AT: Ns = 20 * MS
STEP: Ns = 30 * MS
STARTED = packet(bytes((DC1,)), GENERAL_CALL, NODE)
ENDED = packet(bytes((DC2,)), GENERAL_CALL, NODE)
LONGEST_WAIT = 2**32 - 1
POINTS = "points RPM:RAD/S2 such as 0:900,600:400,1200:0"


def six_seconds(bench: Bench) -> Ns:
    """What lies between DC1 and DC2 of a command of six seconds, as a calibration times it."""
    bench.hears("m200v10t100000", at=bench.kernel.now + AT)
    bench.hears("S", at=bench.kernel.now + 20 * SECOND)
    told = {said.data: said.at for said in bench.heard}
    return told[ENDED] - told[STARTED]


@pytest.mark.parametrize(
    ("ppm", "lasted"), [(0, 6_000_000_000), (100, 5_999_400_060), (-100, 6_000_600_060)]
)
def test_soft_ops_tell_how_fast_the_oscillator_runs(ppm: int, lasted: Ns) -> None:
    assert six_seconds(Bench(settings=SacSettings(soft_ops=True, ppm=ppm))) == lasted


def test_the_start_wait_is_timed_by_the_oscillator_too() -> None:
    bench = Bench(settings=SacSettings(soft_ops=True, ppm=1_000))
    bench.hears("m1v10t1001000", at=AT)
    bench.run()
    load = 39_961  # 40 us of it, rounded up to the ns
    assert bench.heard[1].at == AT + load + SECOND


def test_the_longest_wait_is_over_after_71_minutes_to_the_nanosecond() -> None:
    bench = Bench(settings=SacSettings(soft_ops=True))
    bench.hears(f"m2v10t{LONGEST_WAIT}", at=AT)
    start = AT + LOAD_ACC + LONGEST_WAIT * US
    assert bench.position(start - 1) == 0
    assert bench.position(start) == 1
    bench.run()
    assert [said.at for said in bench.heard[1:]] == [start, start + 2 * STEP]


def test_on_the_external_clock_no_edges_are_no_motion_and_that_is_told() -> None:
    bench = Bench(settings=SacSettings(clock=False, soft_ops=True))
    bench.hears("m10v10", at=AT)
    (warning,) = bench.told(ReportKind.WARNING)
    assert warning.text == "external clock: no edges come, so nothing moves before they do"
    assert bench.snapshot(10 * SECOND).position_pulses == 0
    bench.node.board.feed_xclk(1_000_000, 10 * SECOND)
    bench.bus.touch(bench.node)
    assert bench.position(10 * SECOND + STEP) == 2
    bench.run()
    assert [said.at for said in bench.heard if said.data in (STARTED, ENDED)] == [
        10 * SECOND,
        10 * SECOND + 10 * STEP,
    ]


def test_a_clock_that_stops_stops_the_motor_but_s_is_obeyed() -> None:
    bench = Bench(settings=SacSettings(clock=False, xclk_hz=1_000_000))
    bench.hears("m10v10", at=AT)
    bench.kernel.run_until(AT + LOAD_ACC + 3 * STEP)
    bench.node.board.feed_xclk(0, bench.kernel.now)
    bench.bus.touch(bench.node)
    snapshot = bench.snapshot(SECOND)
    assert (snapshot.state, snapshot.position_pulses, snapshot.rpm) == ("CRUISE", 4, 0)
    bench.hears("S", at=2 * SECOND)
    snapshot = bench.snapshot(3 * SECOND)
    assert (snapshot.state, snapshot.position_pulses) == ("STANDBY", 4)


def test_a_command_that_waits_for_the_clock_begins_at_rest() -> None:
    bench = Bench(settings=SacSettings(clock=False, xclk_hz=1_000_000))
    bench.hears("m400v100a999d999", at=AT)
    bench.hears("m400v100a1d1s", at=AT + 20 * MS)
    bench.kernel.run_until(AT + LOAD_ACC + 1_200 * MS)
    bench.node.board.feed_xclk(0, bench.kernel.now)
    bench.bus.touch(bench.node)
    bench.hears("y", at=2 * SECOND)
    bench.node.board.feed_xclk(1_000_000, 3 * SECOND)
    bench.bus.touch(bench.node)
    assert bench.snapshot(3 * SECOND).rpm == 10


def test_a_cycle_takes_its_edges_whatever_their_frequency() -> None:
    for xfreq, hz, step in ((1_000_000, 999_000, 30_030_031), (500_000, 1_000_000, 15 * MS)):
        bench = Bench(settings=SacSettings(clock=False, xfreq=xfreq, xclk_hz=hz))
        bench.hears("m10v10", at=AT)
        start = AT + LOAD_ACC
        assert [bench.position(start + at) for at in (0, step - 1, step)] == [1, 1, 2]
        assert bench.snapshot(start + step).rpm == pytest.approx(10 * STEP / step)


def test_the_clock_at_xclk_is_of_no_matter_to_a_node_that_times_itself() -> None:
    bench = Bench()
    bench.hears("m10v10", at=AT)
    bench.node.board.feed_xclk(0, AT)
    bench.node.board.feed_xclk(123, AT + MS)
    assert bench.position(AT + LOAD_ACC + STEP) == 2


def test_with_auto_micro_positions_in_steps_and_in_pulses_go_apart() -> None:
    bench = Bench(settings=SacSettings(auto_micro=True, ustep=4))
    bench.hears("m-100v375a999d999", at=AT)
    # 800 us a step: a quarter of that is 200 us.
    snapshot = bench.snapshot(AT + LOAD_ACC + 10 * 800 * US - 1)
    assert (snapshot.position_steps, snapshot.position_pulses) == (-10, -40)
    assert snapshot.rpm == -375


def test_a_rotor_that_stalls_is_left_behind_and_that_is_told() -> None:
    bench = Bench(settings=SacSettings(pull_in=200, pull_out="0:900,400:100,600:0", ustep=1))
    bench.hears("m200v300a999d999", at=AT)
    (warning,) = bench.told(ReportKind.WARNING)
    assert warning.text == (
        "from rest to 300 RPM at once: the motor pulls in up to 200 RPM and may stall"
    )
    snapshot = bench.snapshot(SECOND)
    assert (snapshot.position_steps, snapshot.rotor_steps) == (200, 0)
    bench.hears("m-200v100a1d1", at=2 * SECOND)
    snapshot = bench.snapshot(4 * SECOND)
    assert (snapshot.position_steps, snapshot.rotor_steps) == (0, -200)


def test_without_a_motor_model_there_is_no_rotor() -> None:
    assert Bench().snapshot(0).rotor_steps is None


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"pull_out": "100:5"}, "setting 'pull_out': expected pull_in with it, got none"),
        (
            {"pull_in": 100, "pull_out": "300:5,200:4"},
            "setting 'pull_out': the RPM of a pull-out curve rise from 0 on, got [300, 200]",
        ),
        (
            {"pull_out": "a:b"},
            f"setting 'pull_out': expected {POINTS}, got 'a:b'",
        ),
        (
            {"pull_out": 5},
            f"setting 'pull_out': expected {POINTS}, got 5",
        ),
    ],
)
def test_a_curve_that_is_none_is_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(SettingError) as refused:
        settings_from(SacSettings, given)
    assert str(refused.value) == message


def test_the_clock_is_persistent_and_a_setting_that_is_given_wins() -> None:
    made = settings_from(SacSettings, {"clock": False, "xfreq": 2_000_000})
    assert isinstance(made, SacSettings)
    memory = made.factory_memory(10)
    assert (memory.clock, memory.xfreq) == (0, 2_000_000)
    assert made.asked_for() == {"clock", "xfreq"}
