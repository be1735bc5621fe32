"""The command processor, driven by packets on a line: what runs when, and what becomes of it.

Times are exact. At 10 RPM, which is `slow`, there are no ramps: a full step lasts 30 ms. At 100 RPM
it lasts 3 ms, and a ramp of 1.0 from 10 RPM takes 90 steps.
"""

from __future__ import annotations

from itertools import pairwise

import pytest

from nodes.sac import SacSettings
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.node import ReportKind
from sacbus.wire import DC1, DC2, GENERAL_CALL, MOTHER, ack
from tests.nodes.sac.bench import LOAD, LOAD_ACC, NODE, Bench, Said, packet

AT: Ns = 20 * MS
STEP: Ns = 30 * MS
"""A full step at 10 RPM."""
FAST: Ns = 3 * MS
"""A full step at 100 RPM."""
LONG: Ns = 100 * SECOND


def pulse_times(bench: Bench, since: Ns, until: Ns) -> list[Ns]:
    """When each pulse after ``since`` up to ``until`` came, to the ns, as positions show it."""

    def position(at: Ns) -> int:
        return bench.node.snapshot(at).position_pulses

    def changes(low: Ns, was: int, high: Ns, became: int) -> list[Ns]:
        if was == became:
            return []
        if high - low == 1:
            return [high]
        middle = (low + high) // 2
        there = position(middle)
        return changes(low, was, middle, there) + changes(middle, there, high, became)

    times: list[Ns] = []
    at, here = since, bench.position(since)
    # Between two events of the bus any instant may be asked about; they themselves may cut in.
    while at < until:
        due = bench.kernel.next_at()
        end = until if due is None else min(due, until)
        before = position(end - 1)
        times += changes(at, here, end - 1, before)
        at, here = end, bench.position(end)
        if here != before:
            times.append(end)
    return times


def periods(times: list[Ns]) -> list[Ns]:
    return [after - before for before, after in pairwise(times)]


def command(bench: Bench, line: str, at: Ns) -> None:
    """A line straight into the node, at a time when no packet could bring it."""
    bench.kernel.run_until(at)
    bench.node.board.messages.network_line(line.encode(), MOTHER, NODE, at)
    bench.bus.touch(bench.node)


def told(bench: Bench) -> list[tuple[str, str]]:
    return [(report.kind.value, report.line) for report in bench.told()]


def settled(bench: Bench) -> int:
    """Where the motor stands when nothing is due any more."""
    bench.run()
    snapshot = bench.node.snapshot(bench.kernel.now)
    assert snapshot.state == "STANDBY"
    return snapshot.position_pulses


# ---- M and its qualifiers -----------------------------------------------------------------------


def test_the_first_pulse_comes_a_load_time_after_the_trigger_byte_whatever_the_ack_does() -> None:
    bench = Bench()
    bench.hears("m3v10", at=AT)
    assert bench.position(AT + LOAD_ACC - 1) == 0
    assert bench.position(AT + LOAD_ACC) == 1
    assert bench.heard == []  # the ACK is yet to come
    for pulse in (1, 2):
        assert bench.position(AT + LOAD_ACC + pulse * STEP - 1) == pulse
        assert bench.position(AT + LOAD_ACC + pulse * STEP) == pulse + 1
    end = AT + LOAD_ACC + 3 * STEP
    assert bench.snapshot(end - 1).state == "CRUISE"
    assert bench.snapshot(end).state == "STANDBY"
    assert bench.position(LONG) == 3


def test_loading_takes_less_when_the_acceleration_stays_as_it_was() -> None:
    bench = Bench()
    for number, (line, load) in enumerate(
        [("m1v10", LOAD_ACC), ("m1v9", LOAD), ("m1a2", LOAD_ACC), ("m1", LOAD), ("m1d3", LOAD_ACC)]
    ):
        at = SECOND * (number + 1)
        bench.hears(line, at=at)
        assert bench.position(at + load - 1) == number
        assert bench.position(at + load) == number + 1


@pytest.mark.parametrize(
    ("line", "settings", "pulses"),
    [
        ("m20v10", SacSettings(), 20),
        ("M20V10", SacSettings(), 20),
        ("m-20v10", SacSettings(), -20),
        ("m20v10 m99", SacSettings(), 20),
        ("m20v10u5", SacSettings(), 25),
        ("m20v10u0", SacSettings(), 20),
        ("m20v10", SacSettings(ustep=2), 80),
        ("m20v10f", SacSettings(ustep=2), 80),
        ("m20v10p", SacSettings(ustep=2), 20),
        ("m-20v10u5p", SacSettings(ustep=2), -25),
        ("m20u5v10", SacSettings(ustep=2), 85),
        ("m20v10s0", SacSettings(), 20),
        ("m200v100l1a50d50", SacSettings(), 200),
        ("m200v100l0a.5d1", SacSettings(), 200),
        ("m200vc3000ad", SacSettings(), 200),
        ("m200v", SacSettings(), 200),
        ("m200v100a1d1u9", SacSettings(), 209),
        # Truncated: extra pulses are dropped.
        ("m200v100a.5d1u9", SacSettings(), 200),
    ],
)
def test_a_move_makes_exactly_its_pulses(line: str, settings: SacSettings, pulses: int) -> None:
    bench = Bench(settings=settings)
    bench.hears(line, at=AT)
    assert settled(bench) == pulses
    assert bench.answers == [ack(MOTHER, NODE)]


@pytest.mark.parametrize(
    ("line", "seconds"),
    [
        ("m200v100a1d1", 1.469),
        ("m200v100a.5d1", 1.860),
        ("m2000v100l1a50d50", 6.185),
        ("m2000v100l1a10.47d10.47", 6.948),
        ("m200v9", 6.667),
        ("m500v100a1d999", 1.935),
    ],
)
def test_the_worked_values_of_the_manual_take_their_time(line: str, seconds: float) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert (bench.kernel.now - AT - LOAD_ACC) / SECOND == pytest.approx(seconds, abs=0.0007)


@pytest.mark.parametrize(
    ("line", "states"),
    [
        ("m200v100a1d1", ["ACCEL"] * 90 + ["CRUISE"] * 20 + ["DECEL"] * 90),
        ("m200v100a.5d1", ["ACCEL"] * 133 + ["DECEL"] * 67),
        ("m200v100a999d999", ["CRUISE"] * 200),
        ("m200v9", ["CRUISE"] * 200),
    ],
)
def test_pulses_are_shared_out_as_in_the_manual(line: str, states: list[str]) -> None:
    bench, twin = Bench(), Bench()
    bench.hears(line, at=AT)
    twin.hears(line, at=AT)
    times = pulse_times(bench, AT, 8 * SECOND)
    assert [twin.snapshot(time).state for time in times] == states


@pytest.mark.parametrize("wait_us", [0, 1, 2000, 2**32 - 1])
def test_a_start_wait_runs_after_loading(wait_us: int) -> None:
    bench = Bench()
    bench.hears(f"m1v10t{wait_us}", at=AT)
    start = AT + LOAD_ACC + wait_us * US
    assert bench.snapshot(start - 1).state == "STOP"
    assert bench.position(start - 1) == 0
    assert bench.position(start) == 1


@pytest.mark.parametrize("cycle_us", [42_567, 30_001, 2_500])
def test_a_cycle_is_the_time_of_a_step(cycle_us: int) -> None:
    bench = Bench()
    bench.hears(f"m5vc{cycle_us}a999d999", at=AT)
    times = pulse_times(bench, AT, AT + LOAD_ACC + 5 * cycle_us * US)
    assert periods(times) == [cycle_us * US] * 4


def test_velocity_and_ramps_of_a_command_become_the_session_defaults_and_nothing_else_does() -> (
    None
):
    bench = Bench(settings=SacSettings(ustep=1))
    bench.hears("m-10v60a2d3l1u5t1000p", at=AT)
    bench.run()
    bench.hears("m10", at=LONG)
    current = bench.snapshot(LONG + LOAD).current
    assert current == "m10v60a2d3l1"
    before = bench.position(LONG)
    assert settled(bench) == before + 20


def test_l_brings_its_ramps_own_defaults() -> None:
    bench = Bench()
    bench.hears("m1v10a2d3", at=AT)
    bench.hears("m1v10l1", at=SECOND)
    assert bench.snapshot(SECOND).current == "m1v10a10.47d10.47l1"


def test_bare_letters_bring_back_the_system_defaults() -> None:
    bench = Bench()
    bench.hears("m1v10a2d3", at=AT)
    bench.hears("m1vad", at=SECOND)
    assert bench.snapshot(SECOND).current == "m1v100a1d1"


# ---- V A D alone --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "current"),
    [
        ("v50", "m9v50a1d1"),
        ("V50", "m9v50a1d1"),
        ("vc4567", "m9vc4567a1d1"),
        ("v59", "m9v59a1d1"),
        ("a2.5", "m9v100a2.5d1"),
        ("d.25", "m9v100a1d.25"),
        ("a999", "m9v100a999d1"),
    ],
)
def test_v_a_and_d_alone_set_what_the_next_command_leaves_out(line: str, current: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.hears("m9", at=SECOND)
    assert bench.snapshot(SECOND).current == current
    bench.run()
    for number, bare in enumerate("vad"):
        bench.hears(bare, at=LONG + number * SECOND)
    bench.hears("m9", at=LONG * 2)
    assert bench.snapshot(LONG * 2).current == "m9v100a1d1"


def test_session_velocity_does_not_touch_a_move_that_runs() -> None:
    bench, plain = Bench(), Bench()
    for each in (bench, plain):
        each.hears("m1000v100a1d1", at=AT)
    bench.hears("v300", at=SECOND)
    bench.hears("a9", at=SECOND + 20 * MS)
    assert settled(bench) == settled(plain)
    assert bench.kernel.now == plain.kernel.now


def test_vd_prints_on_the_terminal_only() -> None:
    bench = Bench()
    bench.hears("vd", at=AT)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)]
    assert told(bench) == [("ignored", "vd")]


# ---- the queue ----------------------------------------------------------------------------------


def test_thirty_pending_commands_run_in_order() -> None:
    bench = Bench()
    bench.hears("m1v10s", at=AT)
    lines = [f"m{number}v100a999d999" for number in range(2, 32)]
    for number, line in enumerate(lines):
        bench.hears(line, at=AT + (number + 1) * 20 * MS)
    assert len(bench.snapshot(bench.kernel.now).pending) == 30
    assert bench.told(ReportKind.OVERRUN) == []
    bench.hears("y", at=SECOND)
    ran: list[str] = []
    while (snapshot := bench.node.snapshot(bench.kernel.now)).state != "STANDBY":
        if snapshot.current not in ran[-1:]:
            ran.append(snapshot.current)
        assert bench.kernel.run_next()
    assert ran[1:] == [f"m{number}v100a999d999" for number in range(2, 32)]
    assert snapshot.position_pulses == sum(range(1, 32))


def test_the_31st_pending_command_overwrites_the_oldest_and_is_reported() -> None:
    bench = Bench()
    bench.hears("m1v10s", at=AT)
    for number in range(2, 33):
        bench.hears(f"m{number}v100a999d999", at=AT + number * 20 * MS)
    (report,) = bench.told(ReportKind.OVERRUN)
    assert (report.line, report.address) == ("m32v100a999d999", NODE)
    assert "queue position 2 overwritten" in report.text
    assert len(bench.node.snapshot(bench.kernel.now).pending) == 30
    bench.hears("y", at=SECOND)
    # All but the oldest pending one, which had two steps.
    assert settled(bench) == sum(range(1, 33)) - 2
    assert bench.answers == [ack(MOTHER, NODE)] * 33


def test_what_comes_behind_the_31st_overwrites_the_oldest_too_and_runs_once() -> None:
    bench = Bench()
    bench.hears("m1v10s", at=AT)
    for number in range(2, 33):
        bench.hears(f"m{number}v100a999d999", at=AT + number * 20 * MS)
    bench.hears("y", at=SECOND)
    # The 32 steps in the place of 2 are on their way, and 3 is the oldest of 29 that wait.
    bench.hears("m40v100a999d999", at=SECOND + 80 * MS)
    texts = [report.text for report in bench.told(ReportKind.OVERRUN)]
    assert texts == [
        "queue position 2 overwritten, which was pending",
        "queue position 3 overwritten, which was pending",
    ]
    assert settled(bench) == sum(range(1, 33)) - 2 - 3 + 40


def test_queue_positions_go_round() -> None:
    bench = Bench()
    for number in range(65):
        bench.hears("m1v100a999d999", at=AT + number * 30 * MS)
    assert settled(bench) == 65
    assert bench.told() == []


# ---- sync ---------------------------------------------------------------------------------------


def test_a_command_with_s_is_held_until_y_and_those_behind_it_wait() -> None:
    bench = Bench()
    bench.hears("m1v10s", at=AT)
    bench.hears("m5v10", at=AT + 20 * MS)
    snapshot = bench.snapshot(LONG - SECOND)
    assert (snapshot.state, snapshot.position_pulses) == ("SYNC", 0)
    assert (snapshot.current, snapshot.pending) == ("m1v10a1d1", ("m5v10a1d1",))
    bench.hears("y", at=LONG)
    assert bench.position(LONG - 1) == 0
    assert bench.position(LONG) == 1
    assert settled(bench) == 6


def test_a_start_wait_runs_after_the_release() -> None:
    bench = Bench()
    bench.hears("m1v10t5000s", at=AT)
    bench.hears("y", at=LONG)
    start = LONG + 5 * MS
    assert (bench.position(start - 1), bench.position(start)) == (0, 1)


def test_a_release_that_finds_nothing_held_is_not_remembered() -> None:
    bench = Bench()
    bench.hears("y", at=AT)
    bench.hears("m1v10s", at=SECOND)
    assert bench.snapshot(LONG).state == "SYNC"
    assert bench.told() == []


def test_one_y_releases_one_command() -> None:
    bench = Bench()
    bench.hears("m1v10s", at=AT)
    bench.hears("m2v10s", at=AT + 20 * MS)
    bench.hears("y", at=SECOND)
    assert bench.position(LONG) == 1
    assert bench.snapshot(LONG).state == "SYNC"
    bench.hears("y", at=LONG + SECOND)
    assert settled(bench) == 3


def test_a_broadcast_y_releases_all_nodes_at_the_same_instant() -> None:
    bench = Bench(10, 11, 12)
    for number, address in enumerate(bench.nodes):
        bench.hears("m5v10s", at=AT * (number + 1), to=address)
    # All of them have loaded it by then: no load time comes between.
    bench.hears("y", at=SECOND, to=GENERAL_CALL)
    assert [bench.position(SECOND - 1, address) for address in bench.nodes] == [0, 0, 0]
    assert [bench.position(SECOND, address) for address in bench.nodes] == [1, 1, 1]


# ---- S s N n ------------------------------------------------------------------------------------


@pytest.mark.parametrize("line", ["m2000v300a5d5", "mv100", "m400v10"])
def test_stop_with_prejudice_issues_no_further_pulse_and_drops_what_is_pending(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.hears("m500", at=AT + 20 * MS)
    bench.hears("S", at=SECOND)
    there = bench.position(SECOND)
    assert there > 0
    snapshot = bench.snapshot(SECOND)
    assert (snapshot.state, snapshot.rpm, snapshot.pending) == ("STANDBY", 0, ())
    assert bench.position(LONG) == there
    # It is over for what was there, not for what comes.
    bench.hears("m5v10", at=LONG + SECOND)
    assert settled(bench) == there + 5


def test_a_stop_before_the_first_pulse_leaves_the_motor_where_it_is() -> None:
    for stop in ("S", "s"):
        bench = Bench()
        bench.hears("m100v10t500000", at=AT)
        bench.hears(stop, at=AT + 100 * MS)
        assert bench.snapshot(AT + 100 * MS).state == "STANDBY"
        assert settled(bench) == 0


def test_a_stop_ends_the_hold_at_sync() -> None:
    bench = Bench()
    bench.hears("m5v10s", at=AT)
    bench.hears("S", at=AT + 20 * MS)
    bench.hears("y", at=AT + 40 * MS)
    assert settled(bench) == 0


def test_stop_with_grace_decelerates_with_the_sessions_deceleration_and_drops_the_rest() -> None:
    bench = Bench()
    bench.hears("mv100a1d9", at=AT)
    bench.hears("m500", at=AT + 20 * MS)
    at = 5 * SECOND
    bench.hears("s", at=at)
    there = bench.position(at)
    # From 100 to 10 RPM at the session's 1.0, not at the command's own 9.
    assert bench.snapshot(at + 10 * MS).state == "DECEL"
    assert settled(bench) == there + 90


def test_next_with_prejudice_ends_the_command_with_its_pulse_and_keeps_the_velocity() -> None:
    bench, twin = Bench(), Bench()
    for each in (bench, twin):
        each.hears("m5000v100a1d1", at=AT)
        each.hears("m-100v100a1d1", at=AT + 20 * MS)
    at = 3 * SECOND + 123_456
    last = pulse_times(twin, at - 2 * FAST, at)[-1]
    bench.hears("N", at=at)
    there = bench.position(at)
    # The next one goes on at 100 RPM, one period after the last pulse, the other way.
    assert pulse_times(bench, at, at + 3 * FAST) == [last + n * FAST for n in (1, 2, 3)]
    assert bench.position(at + 3 * FAST) == there - 3
    assert settled(bench) == there - 100


def test_next_with_grace_decelerates_with_the_commands_own_deceleration() -> None:
    bench = Bench()
    bench.hears("m5000v100a1d9", at=AT)
    bench.hears("m100v10d1", at=AT + 20 * MS)
    at = 3 * SECOND
    bench.hears("n", at=at)
    there = bench.position(at)
    assert settled(bench) == there + 10 + 100


def test_next_without_a_next_ends_in_standby() -> None:
    for line, more in (("N", 0), ("n", 90)):
        bench = Bench()
        bench.hears("m5000v100a1d1", at=AT)
        bench.hears(line, at=3 * SECOND)
        there = bench.position(3 * SECOND)
        assert settled(bench) == there + more


def test_next_at_sync_goes_on_with_the_one_behind() -> None:
    bench = Bench()
    bench.hears("m5v10s", at=AT)
    bench.hears("m7v10", at=AT + 20 * MS)
    bench.hears("N", at=AT + 40 * MS)
    assert settled(bench) == 7


@pytest.mark.parametrize("line", ["S", "s", "N", "n", "y", "v200", "+", "-"])
def test_what_finds_nothing_to_act_on_is_acknowledged_and_does_no_harm(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)]
    assert bench.told() == []
    before = bench.position(SECOND)
    bench.hears("m5v10", at=2 * SECOND)
    assert settled(bench) == before + 5


@pytest.mark.parametrize("microseconds", [1, 39, 40, 41, 29_999, 30_040, 90_040, 90_041])
@pytest.mark.parametrize("line", ["S", "s", "N", "n", "mv20", "v20", "m5v10", "y", "+"])
def test_at_the_edges_of_a_command_everything_may_come(line: str, microseconds: int) -> None:
    bench = Bench()
    bench.hears("m3v10", at=AT)
    at = AT + microseconds * US
    before = bench.position(at)
    command(bench, line, at)
    after = bench.position(at + 10 * SECOND)
    assert after >= before
    bench.hears("S", at=at + 20 * SECOND)
    there = bench.position(at + 20 * SECOND)
    bench.hears("m-7v10", at=at + 21 * SECOND)
    assert settled(bench) == there - 7


# ---- continuous ---------------------------------------------------------------------------------


@pytest.mark.parametrize("line", ["mv10", "m0v10", "m-v10"])
def test_without_steps_a_motor_turns_until_it_is_stopped(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    sign = -1 if "-" in line else 1
    start = AT + LOAD_ACC
    assert bench.position(start + 1_000_000 * STEP) == sign * 1_000_001
    assert bench.snapshot(bench.kernel.now).rpm == sign * 10
    bench.hears("S", at=bench.kernel.now + SECOND)
    assert bench.snapshot(bench.kernel.now).state == "STANDBY"


def test_a_continuous_commands_parameters_are_thrown_away() -> None:
    bench = Bench()
    bench.hears("mv20a2d3", at=AT)
    bench.hears("S", at=SECOND)
    bench.hears("m9", at=2 * SECOND)
    assert bench.snapshot(2 * SECOND).current == "m9v100a1d1"


def test_continuous_motion_goes_before_what_runs_and_what_is_pending() -> None:
    bench, twin = Bench(), Bench()
    for each in (bench, twin):
        each.hears("m5000v100a1d1", at=AT)
        each.hears("m50v100", at=AT + 20 * MS)
    at = 3 * SECOND
    last = pulse_times(twin, at - FAST, at)[-1]
    bench.hears("mv100", at=at)
    # Without a gap and without a ramp: the velocity is kept.
    assert pulse_times(bench, at, at + 2 * FAST) == [last + FAST, last + 2 * FAST]
    snapshot = bench.snapshot(LONG)
    assert (snapshot.current, snapshot.pending) == ("mv100a1d1", ("m50v100a1d1",))
    bench.hears("N", at=LONG + SECOND)
    there = bench.position(LONG + SECOND)
    assert settled(bench) == there + 50


def test_continuous_motion_does_not_wait_for_one_that_is_held_and_which_is_held_again_after() -> (
    None
):
    bench = Bench()
    bench.hears("m5v10s", at=AT)
    bench.hears("mv10", at=SECOND)
    assert bench.position(SECOND + LOAD_ACC) == 1
    snapshot = bench.snapshot(2 * SECOND)
    assert (snapshot.rpm, snapshot.pending) == (10, ("m5v10a1d1",))
    bench.hears("N", at=3 * SECOND)
    snapshot = bench.snapshot(LONG)
    assert (snapshot.state, snapshot.pending) == ("SYNC", ())
    bench.hears("y", at=2 * LONG)
    assert settled(bench) == snapshot.position_pulses + 5


def test_a_new_velocity_retargets_continuous_motion_with_the_sessions_acceleration() -> None:
    bench, twin = Bench(), Bench()
    for each in (bench, twin):
        each.hears("a2", at=AT)
        each.hears("mv100a9", at=SECOND)
    at = 5 * SECOND
    before = pulse_times(twin, at - FAST, at)
    bench.hears("v200", at=at)
    times = pulse_times(bench, at, at + 300 * MS)
    # The pulse on its way takes its time; then 50 steps from 100 to 200 RPM at 2.0, in ticks of
    # 500 ns, then 1.5 ms each.
    ramp = [12_000_000_000 // (200 * 100 * (100 + 2 * k)) * 500 for k in range(50)]
    assert times[0] - before[-1] == FAST
    assert periods(times)[:50] == ramp
    assert set(periods(times)[50:]) == {1500 * US}
    snapshot = bench.node.snapshot(bench.kernel.now)
    assert (snapshot.state, snapshot.rpm) == ("CRUISE", 200)


def test_it_retargets_downwards_and_by_cycle_as_well() -> None:
    bench = Bench()
    bench.hears("mv200", at=AT)
    bench.hears("v50", at=5 * SECOND)
    assert bench.snapshot(10 * SECOND).rpm == 50
    bench.hears("vc1000", at=11 * SECOND)
    assert bench.snapshot(20 * SECOND).rpm == 300
    bench.hears("v", at=21 * SECOND)
    assert bench.snapshot(30 * SECOND).rpm == 100


def test_a_new_velocity_in_the_start_wait_of_continuous_motion_counts_from_its_start() -> None:
    bench = Bench()
    bench.hears("mv100t2000000", at=AT)
    bench.hears("v10", at=SECOND)
    start = AT + LOAD_ACC + 2 * SECOND
    assert bench.position(start - 1) == 0
    assert bench.position(start + 10 * STEP) == 11


@pytest.mark.parametrize("line", ["s", "n", "N"])
def test_a_motion_that_comes_to_its_end_takes_no_new_velocity(line: str) -> None:
    bench, twin = Bench(), Bench()
    for each in (bench, twin):
        # At 1 RPM a step lasts 300 ms: long enough for another packet.
        each.hears("mv1" if line == "N" else "mv100", at=AT)
        each.hears(line, at=5 * SECOND)
    bench.hears("v200", at=5 * SECOND + 20 * MS)
    assert settled(bench) == settled(twin)
    assert bench.kernel.now == twin.kernel.now


def test_a_velocity_that_the_gap_has_lost_does_not_come_back_with_a_new_one() -> None:
    bench = Bench()
    bench.hears("m10v100a999d999", at=AT)
    bench.hears("a1", at=SECOND)
    bench.hears("mt2000000", at=SECOND * 2)
    bench.hears("v200", at=SECOND * 3)
    times = pulse_times(bench, SECOND * 3, SECOND * 5)
    assert times[0] == SECOND * 2 + LOAD_ACC + SECOND * 2
    assert times[1] - times[0] == STEP


# ---- GAP ----------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_manuals_200_0_0_turns_to_0_200_0_while_it_repeats() -> None:
    bench = Bench()
    for number in range(3):
        bench.hears("m200v100a.4d999", at=AT * (number + 1))
    times = pulse_times(bench, bench.kernel.now, 10 * SECOND)
    assert settled(bench) == 600
    apart = periods(times)
    seamless = len(apart) - 399
    # The first one is all acceleration, the others are all cruise, without a break between them.
    assert all(one > other for one, other in pairwise(apart[:seamless]))
    assert set(apart[seamless:]) == {FAST}


@pytest.mark.slow
def test_a_chain_that_ends_without_deceleration_goes_on_at_its_speed() -> None:
    bench = Bench()
    bench.hears("m500v100a1d999", at=AT)
    bench.hears("m500v100a1d1", at=AT + 20 * MS)
    times = pulse_times(bench, AT + 20 * MS, 10 * SECOND)
    assert settled(bench) == 1000
    # Between the ramps of 90 steps 410 + 410 at 3 ms. (The last pulse has no other behind it.)
    apart = periods(times)
    assert apart[-909:-89] == [FAST] * 820
    assert apart[-910] == apart[-89] == 3_030_000
    assert (times[-1] + STEP - AT) / SECOND == pytest.approx(2 * 1.935, abs=0.001)


def second_of_two(
    late: Ns, *, first: str = "m10v100a999d999", line: str = "m200v100a1d1"
) -> tuple[list[Ns], Bench]:
    """Pulse times of a command that is ready ``late`` ns after the end of the first, from there."""
    bench = Bench()
    bench.hears(first, at=AT)
    end = AT + LOAD_ACC + 10 * FAST
    bench.hears(line, at=end + late - LOAD_ACC)
    assert bench.position(end - 1) == 10
    return [time - end for time in pulse_times(bench, end - 1, end + SECOND)], bench


@pytest.mark.parametrize("late", [LOAD_ACC + 1, MS, FAST])
def test_a_command_loaded_within_one_period_of_the_end_goes_on_at_the_speed(late: Ns) -> None:
    times, _ = second_of_two(late)
    assert times[:3] == [late, late + FAST, late + 2 * FAST]


@pytest.mark.parametrize("late", [FAST + 500, FAST + MS, SECOND // 10])
def test_a_tick_later_it_starts_from_rest(late: Ns) -> None:
    times, _ = second_of_two(late)
    assert times[0] == late
    assert times[1] - times[0] == STEP
    assert times[2] - times[1] < STEP


def test_a_command_that_waits_adds_no_time_at_all() -> None:
    times, _ = second_of_two(-10 * MS)
    assert times[:3] == [0, FAST, 2 * FAST]


def test_the_direction_is_no_part_of_the_test() -> None:
    times, bench = second_of_two(-10 * MS, line="m-200v100a1d1")
    assert times[:3] == [0, FAST, 2 * FAST]
    assert settled(bench) == 10 - 200


def test_a_command_that_decelerates_leaves_nothing_to_go_on_with() -> None:
    bench = Bench()
    bench.hears("m200v100a1d1", at=AT)
    bench.hears("m200v100a1d1", at=AT + 20 * MS)
    bench.run()
    apart = (bench.kernel.now - AT - LOAD_ACC - LOAD) / SECOND
    assert apart == pytest.approx(2 * 1.469, abs=0.001)


def test_a_stop_leaves_nothing_to_go_on_with() -> None:
    bench = Bench()
    bench.hears("m5000v100a1d999", at=AT)
    bench.hears("S", at=3 * SECOND)
    # Sooner than any packet could follow, and within a period of the stop.
    command(bench, "m200v100a1d1", 3 * SECOND + MS)
    times = pulse_times(bench, 3 * SECOND + MS, 4 * SECOND)
    assert times[0] == 3 * SECOND + MS + LOAD_ACC
    assert times[1] - times[0] == STEP


@pytest.mark.parametrize("stop", ["S", "s"])
def test_a_stop_within_the_gap_takes_the_velocity_that_was_left(stop: str) -> None:
    bench = Bench()
    bench.hears("m10v100a999d999", at=AT)
    end = AT + LOAD_ACC + 10 * FAST
    command(bench, stop, end + MS)
    command(bench, "m200v100a1d1", end + MS)
    times = pulse_times(bench, end + MS, end + SECOND)
    assert times[1] - times[0] == STEP


def test_a_stop_with_grace_that_has_no_ramp_leaves_nothing_either() -> None:
    bench = Bench()
    bench.hears("d999", at=AT)
    bench.hears("mv100", at=SECOND)
    bench.hears("s", at=5 * SECOND)
    # It is over within a period; the next one comes right after that, and would pass the test.
    end = end_of_motion(bench)
    command(bench, "m200v100a1d1", end + MS)
    times = pulse_times(bench, end + MS, end + SECOND)
    assert times[0] == end + MS + LOAD_ACC
    assert times[1] - times[0] == STEP


def end_of_motion(bench: Bench) -> Ns:
    """When the command that runs will be over."""
    end = bench.node.board.engine.end
    assert end is not None
    return end


@pytest.mark.parametrize(("cycle_us", "gap"), [(16, 0), (20, 0), (15, LOAD), (10, LOAD)])
def test_loading_hides_in_the_last_period_if_it_fits(cycle_us: int, gap: Ns) -> None:
    bench = Bench()
    # The first one begins late, so that the second one is there when it ends.
    bench.hears(f"m10vc{cycle_us}a999d999t100000", at=AT)
    bench.hears(f"m10vc{cycle_us}a999d999", at=AT + 20 * MS)
    start = AT + LOAD_ACC + 100 * MS
    times = pulse_times(bench, start - 1, start + 10 * MS)
    end = start + 10 * cycle_us * US
    assert times == [
        *(start + n * cycle_us * US for n in range(10)),
        *(end + gap + n * cycle_us * US for n in range(10)),
    ]


# ---- single pulses ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "pulses"), [("+", 1), ("-", -1), ("+++", 3), ("+-+", 1), ("-----", -5)]
)
@pytest.mark.parametrize("ustep", [0, 3])
def test_each_sign_is_one_pulse_whatever_the_microsteps(line: str, pulses: int, ustep: int) -> None:
    bench = Bench(settings=SacSettings(ustep=ustep))
    # The CRC of a single + is 03: on the wire that is a second ETX, so the packet goes unchecked.
    bench.hears(line + " ", at=AT)
    assert bench.position(AT) == pulses
    assert settled(bench) == pulses


def test_single_pulses_in_motion_are_ignored_and_reported() -> None:
    bench = Bench()
    bench.hears("m100v10", at=AT)
    bench.hears("+ ", at=AT + 20 * MS)
    assert told(bench) == [("ignored", "+ ")]
    assert settled(bench) == 100


# ---- ops ----------------------------------------------------------------------------------------

OPS = SacSettings(soft_ops=True)
STARTED = packet(bytes((DC1,)), GENERAL_CALL, NODE)
ENDED = packet(bytes((DC2,)), GENERAL_CALL, NODE)
#: A node enables its driver this long before a packet of its own.
LEAD: Ns = 8 * US


def test_soft_ops_are_whole_packets_to_everybody_at_the_first_pulse_and_at_the_end() -> None:
    assert (STARTED[:4], ENDED[:4]) == (b"\x02\x00\x52\x11", b"\x02\x00\x52\x12")
    assert len(STARTED) == 7
    bench = Bench(settings=OPS)
    bench.hears("m10v10t100000", at=AT)
    bench.run()
    start = AT + LOAD_ACC + 100 * MS
    assert bench.heard[1:] == [Said(start, STARTED), Said(start + 10 * STEP, ENDED)]


def test_the_start_is_told_only_when_the_nodes_own_ack_is_out() -> None:
    bench = Bench(settings=OPS)
    bench.hears("m10v10", at=AT)
    bench.run()
    acked, started, ended = bench.heard
    assert acked.data == ack(MOTHER, NODE)
    assert started == Said(acked.at + bench.span(4) + LEAD, STARTED)
    assert ended == Said(AT + LOAD_ACC + 10 * STEP, ENDED)


def test_between_two_commands_the_packets_outlast_the_gap() -> None:
    bench = Bench(settings=OPS)
    bench.hears("m10v100a999d999t100000", at=AT)
    bench.hears("m200v100a1d1", at=AT + 20 * MS)
    end = AT + LOAD_ACC + 100 * MS + 10 * FAST
    start = end + bench.span(7) + LOAD_ACC
    times = pulse_times(bench, end, start + SECOND)
    assert times[0] == start
    assert times[1] - times[0] == STEP  # from rest
    assert [said for said in bench.heard if said.at >= end] == [
        Said(end, ENDED),
        Said(start, STARTED),
    ]


def test_a_stopped_command_has_ended() -> None:
    bench = Bench(settings=OPS)
    bench.hears("mv10t100000", at=AT)
    bench.hears("S", at=SECOND)
    bench.run()
    assert [said.data for said in bench.heard].count(ENDED) == 1
    assert bench.heard[-1].data == ENDED
    assert bench.heard[-1].at >= SECOND


def test_a_command_that_never_started_tells_nothing() -> None:
    bench = Bench(settings=OPS)
    bench.hears("m10v10t500000", at=AT)
    bench.hears("S", at=AT + 100 * MS)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)] * 2


def test_a_held_command_tells_its_start_when_it_is_released() -> None:
    bench = Bench(settings=OPS)
    bench.hears("m10v10st50000", at=AT)
    bench.hears("y", at=SECOND)
    bench.run()
    assert bench.heard[2] == Said(SECOND + 50 * MS, STARTED)
    assert len(bench.heard) == 4


def test_soft_ops_of_others_are_no_unknown_commands_and_are_never_answered() -> None:
    bench = Bench(10, NODE)
    for number, data in enumerate((STARTED, ENDED)):
        bench.sends(data, at=AT * (number + 1), sender="another node")
    bench.run()
    assert bench.answers == [STARTED, ENDED]
    assert bench.told() == []


# ---- what is obeyed all the same ----------------------------------------------------------------


@pytest.mark.parametrize(("line", "warned"), [("v625", 1), ("vc480", 0)])
def test_a_new_velocity_is_warned_of_as_it_was_given(line: str, warned: int) -> None:
    bench = Bench()
    bench.hears("mv100a999d999", at=AT)
    bench.hears(line, at=SECOND)
    assert bench.snapshot(2 * SECOND).rpm == 625
    assert len(bench.told(ReportKind.WARNING)) == warned


def test_what_the_hardware_may_not_be_able_to_do_is_obeyed_and_warned_of() -> None:
    bench = Bench()
    bench.hears("m2000v700a5d5", at=AT)
    assert {report.kind for report in bench.told()} == {ReportKind.WARNING}
    assert {report.line for report in bench.told()} == {"m2000v700a5d5"}
    assert settled(bench) == 2000


def test_a_held_command_whose_place_was_taken_is_told_lost_and_the_queue_stays_at_30() -> None:
    bench = Bench()
    bench.hears("m1000v10s", at=AT)
    for number in range(1, 31):
        bench.hears(f"m{number}", at=AT * (number + 1))
    bench.hears("mv60", at=AT * 40)
    snapshot = bench.snapshot(AT * 41)
    assert len(snapshot.pending) == 30
    overrun = [one.text for one in bench.told() if one.kind is ReportKind.OVERRUN]
    assert overrun == ["m1000v10a1d1 had not begun, and is overwritten"]
    bench.hears("m31", at=AT * 42)
    assert len(bench.snapshot(AT * 43).pending) == 30


def test_continuous_motion_waits_for_a_stop_with_grace_that_is_on_its_way() -> None:
    bench = Bench()
    bench.hears("mv110a5d1", at=AT)
    bench.hears("s", at=SECOND)
    bench.hears("mv300", at=SECOND + 100 * MS)
    rpms = [bench.snapshot(SECOND + 110 * MS + n * 50 * MS).rpm for n in range(8)]
    assert rpms == sorted(rpms, reverse=True)
    assert rpms[0] > 60
    assert bench.snapshot(LONG).rpm == 300


def test_a_velocity_that_comes_while_continuous_motion_waits_for_a_pulse_is_its_velocity() -> None:
    bench = Bench()
    bench.hears("m50v10", at=AT)
    bench.hears("mv60", at=SECOND)
    bench.hears("v120", at=SECOND + 10 * MS)
    assert bench.snapshot(LONG).rpm == 120


def test_a_new_velocity_that_asks_too_much_is_warned_of() -> None:
    bench = Bench()
    bench.hears("mv60", at=AT)
    bench.hears("v200000", at=SECOND)
    assert {one.kind for one in bench.told()} == {ReportKind.WARNING}


def test_what_stands_behind_a_space_is_told_to_be_ignored_unless_it_is_padding() -> None:
    bench = Bench()
    bench.hears("m500 200", at=AT)
    bench.hears("m500  ", at=2 * AT)
    assert [(one.kind, one.line, one.column) for one in bench.told()] == [
        (ReportKind.IGNORED, "m500 200", 5)
    ]
