"""The whole module: jumpers, baud codes, power, memory, and what it looks like."""

from __future__ import annotations

import pytest

from nodes.superstepper import KIND
from nodes.superstepper.memory import BAUDS, baud_error, code_of, nominal_baud, own_baud
from sacbus.configuration import Configuration, NodeAt, check
from sacbus.kernel import MS, SECOND, Kernel, LineRate
from sacbus.node import (
    KindError,
    PinError,
    PolyglotKind,
    Report,
    ReportKind,
    SettingError,
    find_kind,
    find_protocol,
    settings_from,
)
from sacbus.wire.superstepper import MoveAtSpeed, Read, Stop, Write, encode
from tests.nodes.superstepper.bench import Bench

#: Table 6, and the error of 4 MHz / 16 / (code + 1), in per cent.
TABLE_6 = [
    (2_400, 103, 0.16),
    (4_800, 51, 0.16),
    (9_600, 25, 0.16),
    (14_400, 16, 2.12),
    (19_200, 12, 0.16),
    (28_800, 8, -3.55),
    (38_400, 6, -6.99),
    (57_600, 3, 8.51),
    (76_800, 2, 8.51),
    (115_200, 1, 8.51),
]


def told(bench: Bench) -> list[str]:
    return [one.text for one in bench.bus.reports]


def test_the_kind_is_found_by_its_entry_point() -> None:
    kind = find_kind("ss-mst67")
    assert kind is KIND
    assert isinstance(kind, PolyglotKind)
    assert [one.name for one in kind.protocols] == ["superstepper", "superstepper-9"]
    assert find_protocol("superstepper-9").rate == LineRate(9_600, 11)
    with pytest.raises(KindError, match="no node kind that is installed speaks 'smoke'"):
        find_protocol("smoke")


# ---- jumpers ----


def test_jmp2_decides_on_the_mode_and_all_of_a_line_must_have_one() -> None:
    nine = {"jmp2": "closed"}
    eight = check(Configuration(nodes=(0, 31), kind="ss-mst67"))
    assert (eight.name, eight.rate.bits, eight.lanes) == ("superstepper", 10, 2)
    found = check(Configuration(nodes=(0, 31), kind="ss-mst67", settings=nine))
    assert (found.name, found.rate.bits) == ("superstepper-9", 11)
    both = (NodeAt(3, "ss-mst67"), NodeAt(4, "ss-mst67", nine))
    with pytest.raises(SettingError, match=r"one protocol on a line, got superstepper \(node 3\)"):
        check(Configuration(nodes=both))
    # A bus without nodes speaks what its settings say.
    assert check(Configuration(nodes=(), kind="ss-mst67", settings=nine)) is found
    with pytest.raises(SettingError, match="addresses from 0 to 31, got 32"):
        check(Configuration(nodes=(32,), kind="ss-mst67"))


def test_jmp1_open_is_2400_baud_at_address_0_whatever_the_eeprom_says() -> None:
    bench = Bench(3, baud=2_400, jmp1="open")
    assert bench.exchange("07 00 02") == "80 00 00 0a 8a"
    assert bench.exchange("1f 00 02") == ""
    assert told(bench) == [
        "it answers at address 0, not at the configured 3: JMP1 is open",
    ]
    deaf = Bench(0, jmp1="open")
    assert deaf.exchange("07 00 02") == ""
    hears_nothing = ["it is set to 2400 baud, the line runs at 9600: it hears nothing"]
    assert told(deaf) == hears_nothing
    deaf.node.power(on=False, now=deaf.now)
    assert told(deaf) == hears_nothing
    deaf.node.power(on=True, now=deaf.now)
    assert told(deaf) == hears_nothing * 2


# ---- baud codes ----


@pytest.mark.parametrize(("baud", "code", "percent"), TABLE_6)
def test_every_code_of_table_6_is_served_with_its_error(
    baud: int, code: int, percent: float
) -> None:
    assert (nominal_baud(code), code_of(baud)) == (baud, code)
    assert round(baud_error(code) * 100, 2) == percent
    assert own_baud(code) == 4_000_000 / 16 / (code + 1)
    bench = Bench(3, baud=baud)
    assert bench.exchange("1f 01 00") == f"83 00 00 {code:02x} {0x83 + code:02x}"
    assert bench.heard[0].at == bench.span(3) + 100_000
    warned = [one for one in told(bench) if "off" in one]
    assert len(warned) == (abs(percent) > 2.5)
    if warned:
        assert f"{percent:+.1f}% off {baud}" in warned[0]


def test_table_6_is_whole() -> None:
    assert [(baud, code) for baud, code, _ in TABLE_6] == [(b, c) for c, b in BAUDS.items()]


def test_a_code_that_table_6_lacks_falls_back_to_2400() -> None:
    bench = Bench(3, baud=2_400, baud_code=77)
    assert bench.exchange("1f 01 00") == "83 00 00 4d d0"
    assert (nominal_baud(77), own_baud(77)) == (2_400, own_baud(103))
    assert code_of(12_345) is None


def test_a_module_whose_uart_runs_as_its_crystal_lets_it_is_misunderstood() -> None:
    # 8.5 % too fast: the last bits of a byte are read a whole bit too early.
    bench = Bench(3, baud=57_600, own_baud=True)
    assert bench.node.uart_baud == 62_500
    assert bench.exchange("1f 01 00") != "83 00 00 03 86"
    assert bench.node.network.framing_errors
    # 0.16 % matter to nobody.
    good = Bench(3, baud=9_600, own_baud=True)
    assert good.node.uart_baud == 9_615
    assert good.exchange("1f 01 00") == "83 00 00 19 9c"
    assert Bench(3, own_baud=True, baud_code=1).node.uart_baud is None  # it is deaf anyway


# ---- memory ----


def test_what_was_stored_comes_back_but_for_what_is_given() -> None:
    bench = Bench(3)
    for at, byte in ((4, 99), (7, 1), (9, 2)):
        bench.ask(3, Write(at, byte, eeprom=True))
    stored = bench.node.persist()
    assert stored == {
        "baud_code": 25,
        "address": 3,
        "rate": 256,
        "time_base": 99,
        "starting_speed": 32_000,
        "user": "01ff02",
    }
    reports: list[Report] = []
    settings = settings_from(KIND.settings, {"rate": 1})
    assert isinstance(settings, KIND.settings)
    again = KIND.create(3, settings, LineRate(9_600), reports.append, stored)
    assert again.persist() == {**stored, "rate": 1}
    assert not reports


def test_odd_values_are_told_and_left_out() -> None:
    reports: list[Report] = []
    settings = settings_from(KIND.settings, {})
    assert isinstance(settings, KIND.settings)
    odd = {"rate": 70_000, "time_base": True, "user": "zz", "tea": 1, "address": 40}
    node = KIND.create(3, settings, LineRate(9_600), reports.append, odd)
    assert node.address == 8  # the low five bits
    assert [one.kind for one in reports] == [ReportKind.WARNING] * 5
    assert "address 8, not at the configured 3: its EEPROM says so" in reports[0].text
    told = " ".join(one.text for one in reports[1:])
    for word in ("rate expected 0 to 65535, got 70000", "time_base", "user", "'tea' is not known"):
        assert word in told
    more = {"user": "00" * 250, "baud_code": 1}
    KIND.create(3, settings, LineRate(9_600), reports.append, {**more, "user": 5})
    KIND.create(3, settings, LineRate(9_600), reports.append, more)
    assert sum("user expected 249 bytes" in one.text for one in reports) == 3


def test_the_eeprom_is_told_in_words() -> None:
    words = KIND.memory_words({"baud_code": 6, "address": 3, "rate": 0, "user": "01"}, 3)
    shown = {one.key: (one.value, one.meaning, one.factory) for one in words.values}
    assert shown["EEPROM 0"] == ("6", "38400 baud; really 35714.3, -6.99%", "25")
    assert shown["EEPROM 1"] == ("3", "answers at 3", None)
    assert shown["EEPROM 2:3"] == ("0", "no ramps", "256")
    assert shown["EEPROM 4"] == ("10", "a beat every 11 ms", None)
    assert shown["EEPROM 5:6"][0] == "32000"
    assert shown["EEPROM 7:255"][0] == "01"
    assert words.remarks == ()
    (remark,) = KIND.memory_words({"baud_code": 77}, None).remarks
    assert "falls back to 2400" in remark


# ---- power, pins, looks ----


def test_without_power_it_forgets_where_it_stands_and_is_silent() -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    bench.run(SECOND)
    node = bench.node
    bench.talk(encode(3, Read(2)))
    node.power(on=False, now=bench.now)
    node.power(on=False, now=bench.now)
    bench.bus.touch(node)
    bench.run(SECOND)
    seen = node.snapshot(bench.now)
    assert (seen.state, seen.position_pulses, bench.heard) == ("OFF", 0, [])
    assert [node.pins.level(pin, bench.now) for pin in node.pins.outputs] == [0] * 7
    node.pins.drive("home", 0, bench.now)
    node.power(on=True, now=bench.now)
    bench.bus.touch(node)
    assert node.pins.level("home", bench.now) == 0
    assert bench.exchange("1f 00 02") == "83 00 00 0a 8d"


def test_in_an_emergency_no_step_follows() -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    bench.run(SECOND)
    bench.node.stop(bench.now)
    bench.run(SECOND)
    seen = bench.node.snapshot(bench.now)
    assert (seen.state, seen.position_pulses) == ("STANDBY", 500)
    assert bench.node.pins.level("enable", bench.now) == 1
    bench.node.power(on=False, now=bench.now)
    bench.node.stop(bench.now)
    assert bench.node.state(bench.now) == "OFF"


@pytest.mark.parametrize("decelerate", [False, True])
def test_an_emergency_switches_no_driver_on(*, decelerate: bool) -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    bench.run(SECOND)
    bench.execute(Stop(decelerate=decelerate, enabled=False))
    bench.node.stop(bench.now)
    assert bench.node.pins.level("enable", bench.now) == 0
    bench.run(SECOND)
    assert bench.node.snapshot(bench.now).position_pulses == 500
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    bench.run(SECOND)
    assert bench.node.pins.level("enable", bench.now) == 1


def test_pins_that_it_does_not_have_are_refused() -> None:
    pins = Bench(3).node.pins
    assert pins.inputs == ("home",)
    for pin, level in (("sync", 0), ("clk", 1), ("home", 2), ("home", True)):
        with pytest.raises(PinError):
            pins.drive(pin, level, 0)
    with pytest.raises(PinError, match="expected one of home, clk, dir, enable"):
        pins.level("sync", 0)


def test_the_step_output_is_high_for_the_second_half_of_a_period() -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    levels = []
    for _ in range(8):
        bench.run(MS // 2)
        levels.append(bench.node.pins.level("clk", bench.now))
    assert levels == [0, 1, 1, 0, 0, 1, 1, 0]


def test_edges_of_its_outputs_are_told() -> None:
    bench = Bench(3)
    edges: list[tuple[str, int, int]] = []
    bench.node.pins.watch(lambda *edge: edges.append(edge), 0)
    bench.exchange("1b 0e")
    bench.exchange("18 00 0f a0")
    bench.exchange("1c 00")
    assert [edge[:2] for edge in edges] == [
        ("ms1", 1),
        ("dm0", 1),
        ("dm1", 1),
        ("dir", 0),
        ("enable", 0),
    ]
    bench.node.pins.watch(None, bench.now)
    bench.exchange("1b 00")
    assert len(edges) == 5


def test_a_watcher_may_do_something_in_the_middle_of_what_it_is_told() -> None:
    bench = Bench(3)
    edges: list[tuple[str, int]] = []

    def watch(pin: str, level: int, when: int) -> None:
        edges.append((pin, level))
        if pin == "ms0":
            bench.node.power(on=False, now=when)

    bench.node.pins.watch(watch, 0)
    bench.exchange("1b 0f")
    assert edges == [
        ("ms0", 1),
        ("dir", 0),
        ("enable", 0),
        ("ms0", 0),
        ("ms1", 0),
        ("dm0", 0),
        ("dm1", 0),
    ]


def test_what_can_be_seen_of_it() -> None:
    bench = Bench(3)
    assert bench.node.terminal is None
    assert not bench.node.receiving
    assert bench.node.quiet
    bench.exchange("18 0c 0f a0")
    seen = bench.node.snapshot(bench.now)
    assert (seen.kind, seen.address) == ("ss-mst67", 3)
    assert seen.current == "move clockwise at speed 4000"
    assert seen.pending == ()
    assert {name: seen.counters[name] for name in ("messages", "ack", "nak")} == {
        "messages": 1,
        "ack": 1,
        "nak": 0,
    }


def test_a_module_in_motion_costs_no_event_a_step() -> None:
    bench = Bench(3)
    bench.execute(MoveAtSpeed(True, 100))
    before = bench.kernel.ran
    bench.run(100 * SECOND)
    assert bench.kernel.ran - before <= 2
    assert isinstance(bench.kernel, Kernel)
