"""Pins: driven inputs and what they set going, outputs at any instant, edges as they are told."""

from __future__ import annotations

from typing import Any

import pytest

from nodes.sac import SacSettings
from nodes.sac.pins import INPUTS, OUTPUTS, TOLD
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.node import PinError, ReportKind
from tests.nodes.sac.bench import LOAD_ACC, Bench, packet

AT: Ns = 20 * MS
STEP: Ns = 30 * MS
"""A full step at 10 RPM."""

#: A clockwise detent of the encoder: which pin becomes what.
CLOCKWISE = [("enA", 0), ("enB", 0), ("enA", 1), ("enB", 1)]
COUNTERCLOCKWISE = [("enB", 0), ("enA", 0), ("enB", 1), ("enA", 1)]


def drive(bench: Bench, pin: str, level: int, at: Ns) -> None:
    bench.kernel.run_until(at)
    bench.node.pins.drive(pin, level, at)
    bench.bus.touch(bench.node)


def turn(bench: Bench, detents: int, at: Ns) -> None:
    bench.kernel.run_until(at)
    for pin, level in (CLOCKWISE if detents > 0 else COUNTERCLOCKWISE) * abs(detents):
        drive(bench, pin, level, at)


def level(bench: Bench, pin: str, at: Ns) -> int:
    bench.kernel.run_until(at)
    return bench.node.pins.level(pin, at)


def watched(bench: Bench) -> list[tuple[str, int, Ns]]:
    edges: list[tuple[str, int, Ns]] = []
    bench.node.pins.watch(lambda *edge: edges.append(edge), bench.kernel.now)
    bench.bus.touch(bench.node)
    return edges


# ---- which there are ----------------------------------------------------------------------------


def test_a_node_has_no_pins_until_somebody_asks_for_them() -> None:
    bench = Bench()
    bench.hears("m5v10", at=AT)
    bench.run()
    assert bench.node.board._pins is None


def test_every_pin_has_a_level_and_open_inputs_are_pulled_up() -> None:
    pins = Bench(settings=SacSettings(xclk_hz=5)).node.pins
    assert [pins.level(pin, 0) for pin in INPUTS] == [1, 1, 1, 5, 1, 1]
    assert {pins.level(pin, 0) for pin in OUTPUTS} == {0, 1}
    assert set(TOLD) < set(OUTPUTS)


@pytest.mark.parametrize(
    ("pin", "value", "said"),
    [
        ("clk", 1, "one of the inputs sync, estop, rst, xclk, enA, enB"),
        ("SYNC", 1, "one of the inputs"),
        ("sync", 2, "expected 0 or 1, got 2"),
        ("sync", True, "expected 0 or 1, got True"),
        ("sync", 0.5, "expected 0 or 1, got 0.5"),
        ("sync", "1", "expected 0 or 1, got '1'"),
        ("estop", None, "expected 0 or 1, got None"),
        ("xclk", -1, "expected Hz from 0 to 20000000, got -1"),
        ("xclk", 20_000_001, "expected Hz from 0"),
    ],
)
def test_what_cannot_be_driven_is_refused_in_one_line(
    pin: str,
    value: Any,  # noqa: ANN401 (what is no level)
    said: str,
) -> None:
    pins = Bench().node.pins
    with pytest.raises(PinError, match=said):
        pins.drive(pin, value, 0)


def test_a_pin_that_is_not_there_has_no_level() -> None:
    with pytest.raises(PinError, match="outputs clk, dir"):
        Bench().node.pins.level("pwm", 0)


# ---- sync and e-stop ----------------------------------------------------------------------------


def test_sync_releases_when_it_falls_and_only_what_is_held() -> None:
    bench = Bench()
    drive(bench, "sync", 0, AT)  # nothing is held: not remembered
    bench.hears("m5v10s", at=2 * AT)
    drive(bench, "sync", 1, SECOND)
    assert bench.snapshot(2 * SECOND).state == "SYNC"
    drive(bench, "sync", 0, 3 * SECOND)
    assert bench.position(3 * SECOND) == 1
    drive(bench, "sync", 0, 4 * SECOND)
    bench.run()
    assert bench.position(bench.kernel.now) == 5


def test_estop_ends_all_at_once_and_nothing_starts_before_it_is_high_again() -> None:
    bench = Bench()
    bench.hears("m5000v100a1d1", at=AT)
    bench.hears("m7", at=2 * AT)
    drive(bench, "estop", 0, SECOND)
    there = bench.position(SECOND)
    snapshot = bench.snapshot(2 * SECOND)
    assert (snapshot.state, snapshot.position_pulses, snapshot.pending) == ("STANDBY", there, ())
    for number, line in enumerate(["m9v10a999d999", "mv60", "+ ", "ls1", "lf2", "l"]):
        bench.hears(line, at=3 * SECOND + number * AT)
    assert bench.snapshot(20 * SECOND).position_pulses == there
    warned = [report.text for report in bench.told(ReportKind.WARNING)]
    assert set(warned) == {"e-stop is low: nothing starts until it is high"}
    drive(bench, "estop", 1, 30 * SECOND)
    # Continuous motion goes before what is pending.
    assert bench.snapshot(31 * SECOND).rpm == pytest.approx(60, abs=1)
    bench.hears("N", at=32 * SECOND)
    there = bench.position(32 * SECOND)
    bench.run()
    assert bench.position(bench.kernel.now) == there + 9


def test_estop_works_in_the_turn_of_a_loop_and_ends_it() -> None:
    bench = Bench()
    for number, line in enumerate(["q1m5v10", "q2m5v10", "ls1", "lf2"]):
        bench.hears(line, at=AT * (number + 1))
    drive(bench, "estop", 0, SECOND)
    there = bench.position(SECOND)
    drive(bench, "estop", 1, 2 * SECOND)
    bench.run()
    assert bench.position(bench.kernel.now) == there


# ---- the encoder --------------------------------------------------------------------------------


def test_follow_makes_a_pulse_a_detent_while_no_command_runs() -> None:
    bench = Bench(settings=SacSettings(ustep=3))
    turn(bench, 5, AT)
    turn(bench, -2, 2 * AT)
    assert bench.position(2 * AT) == 3
    bench.hears("m1v10", at=SECOND)
    turn(bench, 4, SECOND + AT)
    bench.run()
    assert bench.position(bench.kernel.now) == 3 + 8
    assert bench.told() == []


def test_throttle_turns_continuous_motion_up_and_down_but_never_below_1_rpm() -> None:
    bench = Bench()
    bench.hears("$n", at=AT)
    bench.hears("mv60a999d999", at=2 * AT)
    turn(bench, 3, SECOND)
    assert bench.snapshot(2 * SECOND).rpm == pytest.approx(63, abs=0.1)
    turn(bench, -1, 3 * SECOND)
    assert bench.snapshot(4 * SECOND).rpm == pytest.approx(62, abs=0.1)
    turn(bench, -100, 5 * SECOND)
    assert bench.snapshot(20 * SECOND).rpm == pytest.approx(1)
    bench.hears("m5", at=30 * SECOND)  # the session is what it was
    assert bench.snapshot(30 * SECOND).pending == ("m5v100a1d1",)


def test_throttle_does_nothing_in_standby_and_to_commands_with_steps() -> None:
    bench = Bench()
    bench.hears("$n", at=AT)
    turn(bench, 7, 2 * AT)
    bench.hears("m50v10", at=SECOND)
    turn(bench, 7, SECOND + 5 * AT)
    assert bench.snapshot(SECOND + 6 * AT).rpm == 10
    bench.run()
    assert bench.position(bench.kernel.now) == 50


# ---- outputs ------------------------------------------------------------------------------------


def test_clk_rises_with_each_pulse_and_falls_after_the_pulses_width() -> None:
    bench = Bench()
    bench.hears("$CK30", at=AT)
    bench.hears("$R", at=2 * AT)
    bench.hears("m3v10", at=SECOND)
    start = SECOND + LOAD_ACC
    for pulse in range(3):
        rises = start + pulse * STEP
        assert [level(bench, "clk", at) for at in (rises - 1, rises, rises + 30 * US - 1)] == [
            0,
            1,
            1,
        ]
        assert level(bench, "clk", rises + 30 * US) == 0
    assert level(bench, "clk", start + 3 * STEP + 1) == 0


def test_clk_falls_a_tick_before_the_next_pulse_when_its_width_is_too_long() -> None:
    bench = Bench()
    bench.hears("$CK30", at=AT)
    bench.hears("$R", at=2 * AT)
    bench.hears("m3vc20a999d999", at=SECOND)
    start = SECOND + LOAD_ACC
    times = [start, start + 19_499, start + 19_500, start + 20_000]
    assert [level(bench, "clk", at) for at in times] == [1, 1, 0, 1]


def test_dir_keeps_the_direction_of_the_last_command_at_the_level_that_cw_says() -> None:
    for cw in (0, 1):
        bench = Bench()
        bench.hears(f"$CF{cw}", at=AT)
        bench.hears(f"$CG{cw}", at=2 * AT)
        bench.hears("$R", at=3 * AT)
        assert level(bench, "dir", SECOND) == cw
        bench.hears("m-5v10", at=2 * SECOND)
        assert level(bench, "dir", 10 * SECOND) == 1 - cw
        bench.hears("m5v10", at=11 * SECOND)
        assert level(bench, "dir", 20 * SECOND) == cw


def test_op_sa_is_high_from_the_first_pulse_to_the_end_and_op_sb_is_its_inverse() -> None:
    bench = Bench()
    bench.hears("m2v10t5000", at=AT)
    start = AT + LOAD_ACC + 5 * MS
    end = start + 2 * STEP
    for at, op_sa in ((start - 1, 0), (start, 1), (end - 1, 1), (end, 0)):
        assert (level(bench, "op_sa", at), level(bench, "op_sb", at)) == (op_sa, 1 - op_sa)


@pytest.mark.parametrize(("value", "op_sb"), [(0, 0), (36, 1), (1, 1)])
def test_ops_at_0_keeps_both_low(value: int, op_sb: int) -> None:
    bench = Bench()
    bench.hears(f"$Ch{value}", at=AT)
    bench.hears("$R", at=2 * AT)
    bench.hears("m2v10", at=SECOND)
    assert level(bench, "op_sa", SECOND + MS) == (1 if value else 0)
    assert level(bench, "op_sb", 2 * SECOND) == op_sb


def test_tx_en_is_high_from_before_the_answer_until_just_after_it() -> None:
    bench, twin = Bench(), Bench()
    for each in (bench, twin):
        each.hears("m6v10", at=AT)  # 5 characters: enabled 330 us before the first bit
    twin.run()
    answer = twin.heard[0].at
    end = answer + bench.span(4)
    times = [answer - 330 * US - 1, answer - 330 * US, end, end + 8 * US - 1, end + 8 * US]
    assert [level(bench, "tx_en", at) for at in times] == [0, 1, 1, 1, 0]


def test_tx_en_comes_287_us_before_the_answer_to_a_packet_without_crc() -> None:
    bench = Bench()
    data = packet("m2v10", crc=False)
    bench.sends(data, at=AT)
    answer = AT + bench.span(len(data)) + 406 * US
    assert level(bench, "tx_en", answer - 287 * US - 1) == 0
    assert level(bench, "tx_en", answer - 287 * US) == 1


def test_the_clock_output_is_1_mhz_of_its_own_oscillator() -> None:
    assert [level(Bench(), "1MHz", at) for at in (0, 499, 500, 999, 1000, 1500)] == [
        *(0, 0, 1, 1, 0, 1),
    ]
    # 100 000 ppm fast: after 10 us it is at its 11th period.
    fast = Bench(settings=SacSettings(ppm=100_000))
    edges = sum(
        fast.node.pins.level("1MHz", at) != fast.node.pins.level("1MHz", at - 1)
        for at in range(1, 100_001)
    )
    assert edges == 220


def test_a_clock_at_xclk_can_be_driven_and_stopped() -> None:
    bench = Bench(settings=SacSettings(clock=False))
    drive(bench, "xclk", 1_000_000, AT)
    bench.hears("mv10", at=SECOND)
    assert level(bench, "xclk", SECOND) == 1_000_000
    there = bench.position(2 * SECOND)
    assert there == 34
    drive(bench, "xclk", 0, 2 * SECOND)
    assert bench.position(5 * SECOND) == there


# ---- watching -----------------------------------------------------------------------------------


def test_edges_are_told_at_their_instants() -> None:
    bench = Bench()
    edges = watched(bench)
    bench.hears("m-2v10t5000", at=AT)
    bench.run()
    start = AT + LOAD_ACC + 5 * MS
    end = start + 2 * STEP
    assert edges == [
        ("dir", 1, AT),
        ("op_sa", 1, start),
        ("op_sb", 0, start),
        ("op_sa", 0, end),
        ("op_sb", 1, end),
    ]


def test_a_stop_is_an_edge_at_its_instant() -> None:
    bench = Bench()
    edges = watched(bench)
    bench.hears("mv10", at=AT)
    drive(bench, "estop", 0, SECOND)
    assert edges[-2:] == [("op_sa", 0, SECOND), ("op_sb", 1, SECOND)]


def test_watching_changes_nothing_on_the_line_and_nothing_of_motion() -> None:
    plain, seen = Bench(), Bench()
    watched(seen)
    for bench in (plain, seen):
        bench.hears("m10v100a1d999", at=AT)
        bench.hears("m-10v100", at=2 * AT)
        bench.run()
    assert seen.heard == plain.heard
    assert seen.kernel.now == plain.kernel.now
    assert seen.position(seen.kernel.now) == plain.position(plain.kernel.now)


def test_a_node_that_is_watched_is_not_quiet_and_is_again_afterwards() -> None:
    bench = Bench()
    quiet = [bench.node.quiet]
    edges = watched(bench)
    quiet.append(bench.node.quiet)
    bench.node.pins.watch(None, 0)
    quiet.append(bench.node.quiet)
    assert quiet == [True, False, True]
    bench.hears("m2v10", at=AT)
    bench.run()
    assert edges == []


def test_microstep_pins_follow_the_driver_and_are_told_at_the_reboot() -> None:
    bench = Bench()
    edges = watched(bench)
    bench.hears("$CJ4", at=AT)
    bench.hears("$R", at=SECOND)
    bench.run()
    assert edges == [("ms1", 1, SECOND), ("ms2", 1, SECOND), ("ms3", 1, SECOND)]


def test_who_begins_to_watch_in_a_start_wait_is_told_of_the_start() -> None:
    bench = Bench()
    bench.hears("m2v10t2000000", at=AT)
    bench.kernel.run_until(SECOND)
    edges = watched(bench)
    bench.run()
    start = AT + LOAD_ACC + 2 * SECOND
    assert edges[:2] == [("op_sa", 1, start), ("op_sb", 0, start)]
    assert [edge[0] for edge in edges].count("op_sa") == 2


def test_who_begins_to_watch_in_motion_is_told_of_the_end() -> None:
    bench = Bench()
    bench.hears("m2v10", at=AT)
    bench.kernel.run_until(AT + LOAD_ACC + STEP)
    edges = watched(bench)
    bench.run()
    assert [edge[:2] for edge in edges] == [("op_sa", 0), ("op_sb", 1)]


# ---- power --------------------------------------------------------------------------------------


def switch(bench: Bench, at: Ns, *, on: bool) -> None:
    bench.kernel.run_until(at)
    bench.node.power(on=on, now=at)
    bench.bus.touch(bench.node)


def test_without_power_every_output_is_low() -> None:
    bench = Bench()
    bench.hears("m-5v10", at=AT)
    switch(bench, AT + LOAD_ACC + 1, on=False)
    later = bench.kernel.now + 500
    assert [level(bench, pin, later) for pin in OUTPUTS] == [0] * len(OUTPUTS)
    switch(bench, SECOND, on=True)
    assert level(bench, "op_sb", SECOND + 1) == 1


def test_estop_that_is_low_when_power_comes_keeps_everything_from_starting() -> None:
    bench = Bench()
    drive(bench, "estop", 0, AT)
    switch(bench, SECOND, on=False)
    switch(bench, 2 * SECOND, on=True)
    bench.hears("m5v10", at=4 * SECOND)
    assert bench.position(10 * SECOND) == 0
    drive(bench, "estop", 1, 11 * SECOND)
    assert bench.position(20 * SECOND) == 5


def test_the_encoder_moves_no_motor_without_power() -> None:
    bench = Bench()
    switch(bench, AT, on=False)
    turn(bench, 3, SECOND)
    switch(bench, 2 * SECOND, on=True)
    turn(bench, 3, 2 * SECOND + MS)  # it is not over with its boot yet
    assert bench.position(5 * SECOND) == 0
    turn(bench, 3, 6 * SECOND)
    assert bench.position(6 * SECOND) == 3


def test_what_a_pin_sets_going_is_reported_with_its_time() -> None:
    bench = Bench()
    bench.hears("m5v700a999d999s", at=AT)
    bench.bus.reports.clear()
    drive(bench, "sync", 0, 5 * SECOND)
    assert {report.when for report in bench.told()} == {5 * SECOND}
