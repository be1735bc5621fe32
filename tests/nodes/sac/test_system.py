"""System commands: what they store, what they change at once, and what a reboot makes of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import SacSettings
from nodes.sac.memory import Memory, name_of
from sacbus.kernel import MS, SECOND, US, LineRate, Ns
from sacbus.language import QUEUE_LENGTH, MapPins, Motion, Parameter, SetParameter, seeded_row
from sacbus.node import ReportKind
from sacbus.wire import DC1, DC2, GENERAL_CALL, ack, encode
from tests.nodes.sac.bench import LOAD, LOAD_ACC, NODE, Bench

AT: Ns = 20 * MS


class Desk:
    """A bench and a clock: lines one after the other, 20 ms apart."""

    def __init__(
        self,
        settings: SacSettings | None = None,
        rate: LineRate | None = None,
        memory: Mapping[str, object] | None = None,
    ) -> None:
        self.bench = Bench(settings=settings, rate=rate, memory=memory)
        self.node = self.bench.node
        self.now: Ns = 0

    def hears(self, *lines: str, to: int = NODE) -> None:
        for line in lines:
            self.now += 20 * MS
            self.bench.hears(line, at=self.now, to=to)

    def level(self, pin: str) -> int:
        """The level of a pin now."""
        return self.node.pins.level(pin, self.bench.kernel.now)

    def rests(self) -> None:
        """Until nothing is due."""
        self.bench.run()
        self.now = max(self.now, self.bench.kernel.now)

    def runs(self, line: str) -> tuple[Ns, int]:
        """How long a command takes from its start, and how many pulses; the motor then stands."""
        self.rests()
        before = self.node.snapshot(self.now).position_pulses
        self.hears(line)
        began = self.bench.kernel.now
        while self.bench.snapshot(self.bench.kernel.now).state == "STOP":
            self.bench.kernel.run_until(self.bench.kernel.now + 1 * US)
        began = self.bench.kernel.now
        ends = self.node.board.commands.due
        assert ends is not None
        self.rests()
        return ends - began, self.bench.position(self.now) - before

    def answered(self, line: str) -> list[bytes]:
        """What comes of a line at once."""
        self.rests()
        self.bench.heard.clear()
        self.hears(line)
        self.bench.kernel.run_until(self.now + 10 * MS)
        return self.bench.answers


@pytest.fixture
def desk() -> Desk:
    return Desk()


# ---- the EEPROM ---------------------------------------------------------------------------------


@given(st.sampled_from(list(Parameter)), st.data())
def test_a_parameter_is_in_the_eeprom_at_once_and_obeyed_after_the_next_boot(
    parameter: Parameter, data: st.DataObject
) -> None:
    value = data.draw(st.integers(0 if parameter.zero is None else 1, parameter.largest))
    if parameter.decimal and value > 10_000:
        value -= value % 100  # above 100 only whole numbers can be said
    desk = Desk()
    born = desk.node.board.eeprom
    desk.hears(SetParameter(parameter, value).text())
    assert desk.node.board.eeprom == born.with_values({parameter: value})
    assert desk.node.address == NODE
    desk.hears("$R")
    assert desk.node.address == (value if parameter is Parameter.D_ID else NODE)


def test_the_eeprom_s_keeper_is_told_of_changes_alone(desk: Desk) -> None:
    told: list[object] = []
    desk.node.memory_changed = lambda: told.append(desk.node.persist())
    desk.hears("$CJ2", "$CJ2", "$CU21", "$CU21", "qs", "qs", "$F", "$R")
    assert [len(told), told[-1]] == [3, desk.node.persist()]


@pytest.mark.parametrize("line", ["$CJ2", "$CU21", "$F", "$H", "$K", "$L1", "$n", "$O0", "$E"])
def test_every_system_command_ends_all_motion(line: str) -> None:
    desk = Desk()
    desk.hears("m2000v60", "m300", line)
    snapshot = desk.bench.snapshot(desk.now)
    assert (snapshot.state, snapshot.current, snapshot.pending) == ("STANDBY", "", ())


@pytest.mark.parametrize("line", ["qs", "qr", "$C", "$X", "$Cz1"])
def test_what_saves_the_queue_or_is_none_lets_motion_go_on(line: str) -> None:
    desk = Desk()
    desk.hears("m2000v60", line)
    assert desk.bench.snapshot(desk.now).state == "ACCEL"


def test_an_entry_of_the_pin_map_is_stored(desk: Desk) -> None:
    desk.hears(MapPins(2, 1).text())
    assert desk.node.board.eeprom == replace(
        desk.node.board.eeprom, pins=(0, 1, 1, 3, 4, 5, 6, 7), d_id=NODE
    )


# ---- the queue ----------------------------------------------------------------------------------


def rows(desk: Desk) -> tuple[Motion, ...]:
    return desk.node.board.commands.queue.rows()


def test_a_saved_queue_comes_back_and_nothing_of_it_is_pending(desk: Desk) -> None:
    desk.hears("q3m-500v50", "q30m7t9", "qs")
    saved = rows(desk)
    desk.hears("qc", "m5", "m6", "qr")
    assert rows(desk) == saved == desk.node.board.eeprom.queue
    assert desk.node.board.commands.pending == []


def test_without_a_saved_queue_the_system_defaults_come_back(desk: Desk) -> None:
    desk.hears("v50", "q3m-500", "qr")
    assert rows(desk) == (seeded_row(Memory().defaults()),) * QUEUE_LENGTH


def test_clearing_the_queue_leaves_the_saved_one(desk: Desk) -> None:
    desk.hears("q3m-500v50", "qs")
    saved = rows(desk)
    desk.hears("qc")
    assert desk.node.board.eeprom.queue == saved != rows(desk)


# ---- settings of the session --------------------------------------------------------------------


def test_full_steps_and_pulses(desk: Desk) -> None:
    desk.hears("$CJ2", "$R")
    assert desk.runs("m5")[1] == 20
    desk.hears("$P")
    assert desk.runs("m5")[1] == 5
    assert [desk.runs(line)[1] for line in ("m5f", "m5p", "m5")] == [20, 5, 5]
    desk.hears("$U")
    assert desk.runs("m5")[1] == 20
    desk.hears("$U")
    assert desk.runs("m5")[1] == 5
    desk.hears("$F", "$P", "$R")
    assert desk.runs("m5")[1] == 20


def test_what_is_sent_has_no_crc_until_the_reboot(desk: Desk) -> None:
    sent, bare = (encode(NODE, NODE, b"hello", crc=crc) for crc in (True, False))
    line = f"{NODE}hello"
    assert desk.answered(line)[-1] == sent
    desk.hears("$H0")
    assert desk.answered(line)[-1] == bare
    desk.hears("$R")
    assert desk.answered(line)[-1] == sent
    for on in ("$H", "$H1", "$H7"):
        desk.hears("$H0", on)
        assert desk.answered(line)[-1] == sent


def test_a_crc_that_comes_is_checked_all_the_same(desk: Desk) -> None:
    desk.hears("$H0")
    desk.bench.heard.clear()
    spoilt = bytearray(encode(NODE, 1, b"m200"))
    spoilt[-2] ^= 0x40
    desk.bench.sends(bytes(spoilt), at=desk.now + 20 * MS)
    desk.bench.run()
    assert desk.bench.snapshot(desk.bench.kernel.now).counters["nak"] == 1


def test_answers_are_off_until_the_reboot_but_the_line_that_said_so_has_one(desk: Desk) -> None:
    acked = [ack(1, NODE)]
    assert desk.answered("$K0") == acked
    assert desk.answered("m1") == []
    assert desk.answered("$R") == []
    assert desk.answered("m1") == acked
    for on in ("$K", "$K1", "$K7"):
        assert desk.answered("$K0") == acked
        assert desk.answered(on) == []
        assert desk.answered("m1") == acked


def test_a_ramp_comes_with_its_own_defaults_until_the_reboot(desk: Desk) -> None:
    desk.hears("$Cf2", "$Cg3", "$R", "$L1")
    session = desk.node.board.commands.session
    assert (session.linear, session.acc100, session.dec100) == (True, 200, 300)
    desk.hears("$L0")
    session = desk.node.board.commands.session
    assert (session.linear, session.acc100, session.dec100) == (False, 100, 100)
    desk.hears("$L1", "$R")
    assert desk.node.board.commands.session.linear is False


def test_soft_ops_are_told_until_the_reboot(desk: Desk) -> None:
    told = [encode(GENERAL_CALL, NODE, bytes((code,))) for code in (DC1, DC2)]

    def ops() -> list[bytes]:
        desk.rests()
        desk.bench.heard.clear()
        desk.runs("m20v600a999d999")
        return [one for one in desk.bench.answers if one[1] == GENERAL_CALL]

    assert ops() == []
    desk.hears("$O1")
    assert ops() == told
    desk.hears("$O0")
    assert ops() == []
    desk.hears("$O1", "$R")
    assert ops() == []
    desk.hears("$Ci1")
    assert ops() == []
    desk.hears("$R")
    assert ops() == told


def test_the_encoder_changes_its_mode_until_the_reboot(desk: Desk) -> None:
    modes = [desk.node.board.throttles]
    for line in ("$n", "$n", "$n", "$R"):
        desk.hears(line)
        modes.append(desk.node.board.throttles)
    assert modes == [False, True, False, True, False]


def test_other_settings_of_the_session_are_gone_after_the_reboot(desk: Desk) -> None:
    desk.hears("v50", "a3", "b", "g", "$R")
    commands = desk.node.board.commands
    assert (commands.session.rpm, commands.session.acc100) == (100, 100)
    assert (commands.debug, commands.gap) == (False, True)


# ---- parameters: seen after the reboot, and not before ------------------------------------------


Look = Callable[[Desk], object]


def cruise(desk: Desk) -> object:
    """How long ten full steps of a cycle of 3 ms take, without ramps."""
    return desk.runs("m10vc3000a999d999")[0]


def slow(desk: Desk) -> object:
    """How long one step takes at the speed of the start."""
    return desk.runs("m1")[0]


def default(desk: Desk) -> object:
    """How long one step takes at the default velocity."""
    return desk.runs("m1a999d999")[0]


def ramp(desk: Desk) -> object:
    """How long a ramp takes."""
    return desk.runs("m100v120")[0]


def linear(desk: Desk) -> object:
    """How long a linear ramp takes."""
    return desk.runs("m100v120l1")[0]


def pulses(desk: Desk) -> object:
    return desk.runs("m10vc3000a999d999")[1]


def turned(desk: Desk) -> object:
    """The pin and the way of a command without a sign."""
    moved = desk.runs("m10")[1]
    return desk.level("dir"), moved


def ops(desk: Desk) -> object:
    desk.hears("m10v10")
    desk.bench.kernel.run_until(desk.now + 5 * MS)
    running = desk.level("op_sa"), desk.level("op_sb")
    desk.rests()
    return running, (desk.level("op_sa"), desk.level("op_sb"))


def answers(desk: Desk) -> object:
    return len(desk.answered("v100"))


def crc(desk: Desk) -> object:
    return len(desk.answered(f"{NODE}x")[-1])


def microstep_pins(desk: Desk) -> object:
    return desk.level("ms3"), desk.level("ms2"), desk.level("ms1")


def width(desk: Desk) -> object:
    """Whether a pulse of 100 us is said to be too short."""
    desk.bench.bus.reports.clear()
    desk.hears("m10vc100a999d999")
    desk.rests()
    return any("clk is" in report.text for report in desk.bench.told(ReportKind.WARNING))


@pytest.mark.parametrize(
    ("lines", "look", "before", "after"),
    [
        (["$Ca400"], slow, 30 * MS, 15 * MS),
        (["$Cb5000"], default, 3 * MS, 5 * MS),
        (["$CL30"], slow, 30 * MS, 10 * MS),
        (["$Cd4"], ramp, None, None),
        (["$Ce4"], ramp, None, None),
        (["$Cf40"], linear, None, None),
        (["$Cg40"], linear, None, None),
        (["$CB1"], ramp, None, None),
        (["$CH0"], cruise, 30 * MS, 30 * MS + 40 * US),
        (["$CI3"], cruise, 30 * MS, 30 * MS + 15 * US),
        (["$CJ3"], pulses, 10, 80),
        (["$CJ3"], microstep_pins, (0, 0, 0), (0, 1, 1)),
        (["$CJ4"], microstep_pins, (0, 0, 0), (1, 1, 1)),
        (["$CJ4", "$CN1"], microstep_pins, (0, 0, 0), (1, 0, 0)),
        (["$CJ2", "$CN2", "$CU25"], microstep_pins, (0, 0, 0), (1, 0, 1)),
        (["$Cu1", "$CJ1"], pulses, 10, 10),
        (["$CF1"], turned, (0, 10), (0, -10)),
        (["$CG1"], turned, (0, 10), (1, -10)),
        (["$CF1", "$CG1"], turned, (0, 10), (1, 10)),
        (["$Ch0"], ops, ((1, 0), (0, 1)), ((0, 0), (0, 0))),
        (["$Ch1"], ops, ((1, 0), (0, 1)), ((1, 0), (0, 1))),
        (["$Cj0"], answers, 1, 0),
        (["$Ck0"], crc, 7, 6),
        (["$CK200"], width, False, True),
    ],
)
def test_a_parameter_shows_after_the_reboot_and_not_before(
    lines: list[str], look: Look, before: object, after: object
) -> None:
    desk = Desk()
    at_first = look(desk)
    desk.hears(*lines)
    assert look(desk) == at_first
    desk.hears("$R")
    then = look(desk)
    if before is None:  # what the planner makes of it is tested elsewhere: it must be another time
        assert then != at_first
    else:
        assert (at_first, then) == (before, after)


def test_the_external_clock_times_pulses_after_the_reboot() -> None:
    desk = Desk(SacSettings(xclk_hz=500_000))
    assert cruise(desk) == 30 * MS
    desk.hears("$CC0")
    assert cruise(desk) == 30 * MS
    desk.hears("$R")
    # Ticks come at half the rate that the node takes them to come at.
    assert cruise(desk) == 60 * MS
    desk.hears("$Cc500000")
    assert cruise(desk) == 60 * MS
    desk.hears("$R")
    assert cruise(desk) == 30 * MS


def test_microsteps_beyond_the_driver_s_table_multiply_pulses_and_leave_the_pins() -> None:
    desk = Desk()
    desk.hears("$CJ3", "$R", "$CJ6", "$R")
    assert microstep_pins(desk) == (0, 1, 1)
    assert pulses(desk) == 640
    (report,) = desk.bench.told(ReportKind.WARNING)
    assert report.text == (
        "driver 0 has no microsteps of 2**6: pulses are multiplied by that, and its pins stay as "
        "they are"
    )


def test_a_motor_stays_where_it_is_when_its_microsteps_change() -> None:
    desk = Desk()
    desk.runs("m10")
    places = []
    for line in ("$CJ2", "$CJ4", "$CJ0"):
        desk.hears(line, "$R")
        places.append(desk.node.snapshot(desk.now).position_steps)
    assert places == [10, 10, 10]
    desk.hears("$CJ2", "$R")
    desk.runs("m3p")
    assert desk.node.snapshot(desk.now).position_steps == 10.75
    desk.hears("$CJ0", "$R")
    # A driver in full steps holds the motor at the nearest of them.
    assert desk.node.snapshot(desk.now).position_steps == 11


# ---- address and rate ---------------------------------------------------------------------------


def test_a_node_is_found_at_its_new_address_after_the_reboot_and_not_before(desk: Desk) -> None:
    desk.hears("$CM99")
    assert desk.answered("v100") == [ack(1, NODE)]
    assert desk.answered("$R") == [ack(1, NODE)]
    assert desk.answered("v100") == []
    desk.bench.heard.clear()
    desk.hears("v100", to=99)
    desk.rests()
    assert desk.bench.answers == [ack(1, 99)]
    assert desk.bench.bus.node(99) is desk.node


def test_a_node_is_found_at_its_new_address_once_it_is_touched_after_power_came(desk: Desk) -> None:
    desk.hears("$CM99")
    desk.rests()
    for on in (False, True):
        desk.node.power(on=on, now=desk.now)
    desk.bench.bus.touch(desk.node)
    desk.rests()
    desk.bench.heard.clear()
    desk.hears("v100", to=99)
    desk.rests()
    assert desk.bench.answers == [ack(1, 99)]


def test_two_nodes_may_change_their_addresses_one_after_the_other() -> None:
    bench = Bench(10, 11)
    for number, (line, to) in enumerate([("$CM12", 10), ("$R", 10), ("$CM10", 11), ("$R", 11)]):
        bench.hears(line, at=(number + 1) * AT, to=to)
    bench.run()
    bench.heard.clear()
    bench.hears("v10", at=5 * AT, to=10)
    bench.hears("v10", at=6 * AT, to=12)
    bench.hears("v10", at=7 * AT, to=11)
    bench.run()
    assert bench.answers == [ack(1, 10), ack(1, 12)]


DEAF = "sw is 9600 baud, the line runs at 38400: it hears nothing, and nobody understands it"


def test_a_node_at_another_rate_hears_nothing_after_the_reboot(desk: Desk) -> None:
    desk.hears("$Cn9600")
    assert desk.answered("v100") == [ack(1, NODE)]
    assert desk.answered("$R") == [ack(1, NODE)]
    assert [report.text for report in desk.bench.told(ReportKind.WARNING)] == [DEAF]
    assert desk.answered("m100") == []
    assert desk.bench.snapshot(desk.now).counters["packets"] == 3
    assert desk.node.receiving is False


def test_what_a_node_at_another_rate_sends_is_garbled_and_always_the_same() -> None:
    heard = []
    for _ in range(2):
        desk = Desk(SacSettings(sw=9_600, soft_ops=True, autorun=1))
        desk.bench.kernel.run_until(SECOND)
        heard.append(desk.bench.answers[0])
    sent = encode(GENERAL_CALL, NODE, bytes((DC1,)))
    assert heard[0] == heard[1]
    assert len(heard[0]) == len(sent)
    assert all(one != other for one, other in zip(heard[0], sent, strict=True))
    # Whatever it is, nobody takes it for a packet.
    assert min(heard[0]) >= 0x80


@pytest.mark.parametrize(("baud", "understood"), [(39_360, True), (39_380, False), (37_440, True)])
def test_rates_may_differ_by_two_and_a_half_per_cent(baud: int, understood: bool) -> None:
    desk = Desk(SacSettings(sw=baud))
    assert bool(desk.answered("v100")) is understood
    assert bool(desk.bench.told(ReportKind.WARNING)) is not understood


def test_a_node_is_born_with_the_rate_of_its_line() -> None:
    desk = Desk(rate=LineRate(9_600))
    assert desk.answered("v100") == [ack(1, NODE)]
    assert desk.node.board.eeprom.sw == 9_600
    assert desk.bench.told() == []
    assert "sw" not in desk.node.persist()
    stored = {name_of(Parameter.SW): 38_400}
    desk = Desk(rate=LineRate(9_600), memory=stored)
    assert desk.answered("v100") == []


def test_load_times_are_as_after_power_came(desk: Desk) -> None:
    """The reboot forgets the last command: the next one loads its acceleration anew."""
    desk.runs("m1v100a999d999")
    desk.hears("m1v100a999d999")
    assert desk.node.board.commands.due == desk.now + LOAD + 3 * MS
    desk.rests()
    desk.hears("$R", "m1v100a999d999")
    assert desk.node.board.commands.due == desk.now + LOAD_ACC + 3 * MS
