"""What each message does to the motor, the registers and the status."""

from __future__ import annotations

import pytest

from nodes.superstepper import KIND, SuperStepperSettings
from sacbus.kernel import MS, SECOND, LineRate
from sacbus.node import ReportKind
from sacbus.wire.superstepper import (
    Answer,
    ChangeSpeed,
    Decay,
    Expanded,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Rate,
    Read,
    Status,
    Stop,
    Write,
    decode_status,
)
from tests.nodes.superstepper.bench import Bench

CW, CCW = True, False


def at_once(speed: int, rate: Rate = Rate.FAST, *, clockwise: bool = CW) -> MoveAtSpeed:
    return MoveAtSpeed(clockwise, speed, rate, accelerate=False)


def status(bench: Bench) -> Status:
    return bench.node.commands.status(bench.now)


def pulses(bench: Bench) -> int:
    return bench.node.snapshot(bench.now).position_pulses


def gap_us(bench: Bench) -> float:
    """From one step to the next."""
    course = bench.node.commands.engine.course
    assert course is not None
    return (course.time_of(1) - course.time_of(0)) / 4


# ---- timing ----


@pytest.mark.parametrize(
    ("rate", "us"), [(Rate.FAST, 2_000), (Rate.MEDIUM, 16_000), (Rate.SLOW, 128_000)]
)
def test_speed_4000_is_a_step_every_2_ms_by_the_divider(rate: Rate, us: int) -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000, rate))
    assert gap_us(bench) == us
    before = pulses(bench)
    bench.run(SECOND)
    assert pulses(bench) - before == (1_000_000 + us // 2) // us


@pytest.mark.parametrize(("exponent", "rpm"), [(0, 150), (1, 75), (2, 37.5), (3, 18.75)])
def test_a_motor_of_1_8_degrees_turns_slower_by_its_microsteps(exponent: int, rpm: float) -> None:
    bench = Bench(3)
    bench.execute(Microsteps(exponent))
    bench.execute(at_once(4_000))
    assert gap_us(bench) == 2_000
    assert bench.node.snapshot(bench.now).rpm == rpm
    bench.run(4 * SECOND)
    seen = bench.node.snapshot(bench.now)
    assert (seen.position_pulses, seen.position_steps) == (2_000, 2_000 / 2**exponent)


def test_a_crystal_that_is_too_fast_turns_the_motor_faster() -> None:
    bench = Bench(3, ppm=1_000)
    bench.execute(at_once(4_000))
    bench.run(100 * SECOND)
    assert pulses(bench) == 50_050
    assert bench.node.snapshot(bench.now).rpm == pytest.approx(150.15)


def test_speed_0_is_the_slowest() -> None:
    bench = Bench(3)
    bench.execute(at_once(0))
    assert gap_us(bench) == 65_536 / 2


def test_rate_3_does_not_move_and_says_so() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    bench.run(SECOND)
    there = pulses(bench)
    bench.execute(MoveSteps(CW, 4_000, 10, Rate.NONE))
    bench.run(SECOND)
    assert pulses(bench) == there
    assert not status(bench).busy
    assert [one.kind for one in bench.bus.reports] == [ReportKind.WARNING]


@pytest.mark.parametrize(("rate", "speed"), [(Rate.FAST, 99), (Rate.MEDIUM, 19), (Rate.SLOW, 1)])
def test_a_speed_below_table_2_is_obeyed_with_a_warning(rate: Rate, speed: int) -> None:
    bench = Bench(3)
    bench.execute(at_once(speed, rate))
    assert gap_us(bench) == speed * rate.divider / 2
    assert [one.kind for one in bench.bus.reports] == [ReportKind.WARNING]
    bench.execute(at_once(speed + 1, rate))
    assert len(bench.bus.reports) == 1


def test_a_change_to_a_speed_below_table_2_warns_when_it_is_used() -> None:
    bench = Bench(3)
    bench.execute(ChangeSpeed(99))
    assert not bench.bus.reports
    bench.execute(at_once(4_000))
    bench.execute(ChangeSpeed(100))
    assert len(bench.bus.reports) == 1
    bench.execute(ChangeSpeed(98))
    assert [one.text for one in bench.bus.reports] == [
        f"speed {speed} is below the 100 that its rate allows" for speed in (99, 98)
    ]


def test_a_speed_below_table_2_that_is_not_used_does_not_warn() -> None:
    bench = Bench(3)
    bench.execute(ChangeSpeed(8_000))
    bench.execute(at_once(99))
    assert not bench.bus.reports


# ---- op 0 ----


def test_without_the_accelerate_bit_it_goes_to_its_speed_at_once() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    assert status(bench) == Status(busy=True)
    bench.execute(MoveAtSpeed(CW, 2_000))
    bench.run(50 * MS)
    assert status(bench) == Status(busy=True, changing_speed=True)


def test_a_starting_speed_faster_than_the_target_is_not_used() -> None:
    bench = Bench(3, starting_speed=4_000)
    bench.execute(MoveAtSpeed(CW, 8_000))
    assert status(bench) == Status(busy=True)
    assert gap_us(bench) == 4_000


def test_rate_0_goes_at_once() -> None:
    bench = Bench(3, rate=0)
    bench.execute(MoveAtSpeed(CW, 8_000))
    assert status(bench) == Status(busy=True)
    assert gap_us(bench) == 4_000


def test_in_the_other_direction_it_decelerates_first() -> None:
    bench = Bench(3)
    edges: list[tuple[str, int, int]] = []
    bench.execute(at_once(4_000))
    bench.run(SECOND)
    bench.node.pins.watch(lambda *edge: edges.append(edge), bench.now)
    bench.execute(MoveAtSpeed(CCW, 4_000))
    bench.run(50 * MS)
    assert bench.node.snapshot(bench.now).rpm > 0
    assert bench.node.state(bench.now) == "DECEL"
    assert edges == []
    bench.run(10 * SECOND)
    assert bench.node.snapshot(bench.now).rpm == -150
    ((pin, level, when),) = edges
    assert (pin, level) == ("dir", 0)
    assert SECOND < when < 3 * SECOND


# ---- op 1 ----


def test_steps_are_made_and_counted_and_the_motor_rests_then() -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(CCW, 10_000, 400))
    bench.run(10 * SECOND)
    seen = bench.node.snapshot(bench.now)
    assert (seen.position_pulses, seen.state, seen.rpm) == (-400, "STANDBY", 0)
    assert bench.node.commands.steps_run(bench.now) == 400
    assert bench.node.commands.enabled  # "the motor windings will still be energized"


def test_no_steps_end_at_once_what_runs() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    bench.run(SECOND)
    there = pulses(bench)
    bench.execute(MoveSteps(CW, 4_000, 0))
    bench.run(SECOND)
    assert pulses(bench) == there
    assert not status(bench).busy


def test_a_move_replaces_the_one_that_runs() -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(CW, 10_000, 60_000))
    bench.run(2 * SECOND + 3 * MS)
    # The step of the period that runs comes, then so many more.
    there = pulses(bench)
    running = not bench.node.commands.engine.clk(bench.now)
    bench.execute(MoveSteps(CW, 10_000, 100))
    bench.run(60 * SECOND)
    assert pulses(bench) == there + running + 100


# ---- op 2 ----


def test_a_change_of_speed_ramps_and_keeps_the_number_of_steps() -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(CW, 20_000, 1_000))
    bench.run(2 * SECOND)
    assert bench.node.state(bench.now) == "CRUISE"
    bench.execute(ChangeSpeed(5_000))
    bench.run(50 * MS)
    assert bench.node.state(bench.now) == "ACCEL"
    bench.run(60 * SECOND)
    assert pulses(bench) == 1_000
    bench.execute(at_once(4_000))
    bench.execute(ChangeSpeed(8_000))
    bench.run(3 * SECOND)
    assert bench.node.snapshot(bench.now).rpm == 75


def test_a_change_of_speed_at_rest_is_for_the_next_move_at_speed() -> None:
    bench = Bench(3)
    bench.execute(ChangeSpeed(8_000))
    bench.run(SECOND)
    assert pulses(bench) == 0
    bench.execute(at_once(4_000))
    assert bench.node.snapshot(bench.now).rpm == 75
    bench.execute(at_once(4_000))
    bench.run(10 * MS)
    assert bench.node.snapshot(bench.now).rpm == 150


# ---- op 3 ----


def test_microsteps_change_in_mid_motion_and_the_motor_stays_where_it_is() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    bench.run(SECOND)
    bench.execute(Microsteps(3, Decay.SLOW))
    seen = bench.node.snapshot(bench.now)
    assert (seen.position_pulses, seen.position_steps, seen.rpm) == (500, 500, 18.75)
    bench.run(SECOND)
    seen = bench.node.snapshot(bench.now)
    assert (seen.position_pulses, seen.position_steps) == (1_000, 562.5)
    levels = [bench.node.pins.level(pin, bench.now) for pin in ("ms0", "ms1", "dm0", "dm1")]
    assert levels == [1, 1, 1, 1]
    assert bench.ask(3, Read(5)).value == 0b1111


# ---- op 4 ----


def test_a_stop_at_once_leaves_no_step_behind() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    bench.run(SECOND)
    bench.execute(Stop(decelerate=False, enabled=True))
    there = pulses(bench)
    bench.run(SECOND)
    assert (pulses(bench), bench.node.state(bench.now)) == (there, "STANDBY")
    assert bench.node.pins.level("enable", bench.now) == 1


def test_a_stop_by_the_profile_ends_at_the_starting_speed_and_then_takes_the_current_off() -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(CW, 10_000))
    bench.run(10 * SECOND)
    course = bench.node.commands.engine.course
    assert course is not None
    up = course.stretches[0].periods
    bench.execute(Stop(decelerate=True, enabled=False))
    there, running = pulses(bench), not bench.node.commands.engine.clk(bench.now)
    assert bench.node.pins.level("enable", bench.now) == 1
    bench.run(50 * MS)
    assert bench.node.state(bench.now) == "DECEL"
    bench.run(10 * SECOND)
    assert pulses(bench) == there + running + (up or 0)
    assert bench.node.pins.level("enable", bench.now) == 0
    bench.execute(MoveSteps(CW, 10_000, 1))
    assert bench.node.pins.level("enable", bench.now) == 1


def test_a_stop_at_rest_switches_the_driver() -> None:
    bench = Bench(3)
    bench.execute(Stop(decelerate=True, enabled=False))
    assert bench.node.pins.level("enable", bench.now) == 0
    bench.execute(Stop(decelerate=False, enabled=True))
    assert bench.node.pins.level("enable", bench.now) == 1


# ---- home ----


def test_status_and_steps_run_through_a_move_with_homing() -> None:
    bench = Bench(3)
    seen = []

    def look() -> None:
        run = bench.ask(3, Read(7, word=True)).value
        seen.append((*decode_status(bench.ask(3, Read(6)).value), run))

    look()
    bench.ask(3, MoveSteps(CW, 10_000, 60_000, home=True))
    bench.run(300 * MS)
    look()
    bench.run(2 * SECOND)
    look()
    bench.node.pins.drive("home", 0, bench.now)
    bench.bus.touch(bench.node)
    there = pulses(bench)
    look()
    bench.run(SECOND)
    assert pulses(bench) == there
    assert [flags[:3] for flags in seen] == [
        (False, False, False),
        (True, False, True),
        (True, False, False),
        (False, True, False),
    ]
    assert seen[-1][3] == there == bench.node.commands.steps_run(bench.now)
    # A new move clears it, and needs an edge: the sensor is low still.
    bench.ask(3, MoveSteps(CCW, 10_000, 5, home=True))
    assert status(bench).busy
    assert not status(bench).home_complete
    bench.run(2 * SECOND)
    assert (pulses(bench), status(bench)) == (there - 5, Status())


def test_the_home_sensor_stops_no_other_move() -> None:
    bench = Bench(3)
    bench.execute(at_once(4_000))
    bench.node.pins.drive("home", 0, bench.now)
    bench.node.pins.drive("home", 1, bench.now)
    bench.execute(MoveSteps(CW, 4_000, 10))
    bench.node.pins.drive("home", 0, bench.now)
    assert status(bench).busy
    assert not status(bench).home_complete


def test_steps_run_count_modulo_65_536_from_each_new_move() -> None:
    bench = Bench(3)
    bench.execute(at_once(100))
    bench.run(4 * SECOND)
    assert pulses(bench) == 80_000
    assert bench.node.commands.steps_run(bench.now) == 80_000 - 65_536
    assert bench.ask(3, Read(7, word=True)).value > 80_000 - 65_536
    bench.execute(Stop(decelerate=False))
    bench.execute(MoveSteps(CCW, 4_000, 7))
    assert bench.node.commands.steps_run(bench.now) == 0
    bench.run(10 * SECOND)
    assert bench.node.commands.steps_run(bench.now) == 7


# ---- memories ----


def test_the_ram_map_reads_and_writes_as_table_8_says() -> None:
    bench = Bench(3)
    assert [bench.ask(3, Read(at)).value for at in range(5)] == [0x01, 0x00, 10, 0x7D, 0x00]
    assert bench.ask(3, Read(0, word=True)).value == 0x0100
    assert bench.ask(3, Read(3, word=True)).value == 32_000
    for at in (*range(6), *range(9, 0x18)):
        bench.ask(3, Write(at, at ^ 0x55))
        assert bench.ask(3, Read(at)).value == at ^ 0x55
    assert bench.ask(3, Read(0x16, word=True)).value == 0x4342
    assert not bench.bus.reports
    for at in (6, 7, 8, *range(0x18, 0x20)):
        assert bench.ask(3, Write(at, 0x77)) == Answer(3)
        assert bench.ask(3, Read(at)).value == 0
    assert {one.kind for one in bench.bus.reports} == {ReportKind.IGNORED}
    # A word at the map's end goes on at its beginning; addresses beyond it are taken by their
    # low bits.
    assert bench.ask(3, Read(0x1F, word=True)).value == 0x55
    assert bench.ask(3, Read(0x29)).value == 9 ^ 0x55


def test_new_registers_are_used_by_the_next_ramp() -> None:
    bench = Bench(3)
    for at, byte in ((0, 0x7D), (1, 0x00), (2, 0)):
        bench.ask(3, Write(at, byte))
    bench.execute(MoveAtSpeed(CW, 10_000))
    bench.run(40 * MS)
    assert bench.node.state(bench.now) == "CRUISE"


def test_ram_5_is_the_microsteps_register() -> None:
    bench = Bench(3)
    bench.ask(3, Write(5, 0b0110))
    bench.execute(at_once(4_000))
    assert bench.node.snapshot(bench.now).rpm == 37.5
    assert bench.node.commands.microsteps == Microsteps(2, Decay.MIXED)


def test_the_eeprom_is_used_after_the_next_power_on() -> None:
    bench = Bench(3)
    changes: list[object] = []
    bench.node.memory_changed = lambda: changes.append(bench.node.persist())
    for at, byte in ((1, 9), (2, 2), (3, 0), (4, 4), (5, 0x30), (6, 0x39), (0x80, 0x42)):
        assert bench.ask(3, Write(at, byte, eeprom=True)) == Answer(3)
    assert bench.ask(3, Read(4, eeprom=True)).value == 4
    assert bench.ask(3, Read(2)).value == 10
    assert len(changes) == 6  # EEPROM 3 was 0 already
    node = bench.node
    node.power(on=False, now=bench.now)
    assert (node.state(bench.now), bench.exchange("1f 00 02")) == ("OFF", "")
    node.power(on=True, now=bench.now)
    bench.bus.touch(node)
    assert bench.exchange("1f 00 02") == ""
    assert bench.ask(9, Read(0, word=True)).value == 0x0200
    assert bench.ask(9, Read(2)).value == 4
    assert bench.ask(9, Read(3, word=True)).value == 0x3039
    assert bench.ask(9, Read(0x80, eeprom=True)).value == 0x42
    # And so it is in another life.
    again = KIND.create(3, SuperStepperSettings(), LineRate(9_600), lambda _: None, node.persist())
    assert again.address == 9
    assert again.eeprom.bytes == node.eeprom.bytes


@pytest.mark.parametrize(
    "message",
    [
        Expanded(),
        Read(2),
        Write(0x10, 1),
        Microsteps(0),
        ChangeSpeed(100),
    ],
)
def test_what_is_no_move_leaves_home_complete_and_steps_run_alone(message: Message) -> None:
    bench = Bench(3)
    bench.execute(MoveSteps(CW, 10_000, 60_000, home=True))
    bench.run(SECOND)
    bench.node.pins.drive("home", 0, bench.now)
    run = bench.node.commands.steps_run(bench.now)
    bench.execute(message)
    assert status(bench) == Status(home_complete=True)
    assert bench.node.commands.steps_run(bench.now) == run > 0
