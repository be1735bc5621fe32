"""What follows a dollar, the persistent parameters, and the lines of the configure screen."""

from __future__ import annotations

import pytest
from hypothesis import given

from sacbus.language import (
    NO_RAMP,
    Configure,
    MapPins,
    Mode,
    Parameter,
    Parsed,
    Ramp,
    Reboot,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    ShowMemory,
    StepMode,
    ToggleEncoder,
    ToggleStepMode,
    parse,
    parse_in,
)
from tests.language.strategies import nearly_commands

NOTHING = "the line does nothing"
END = "the end of the command"
A_SYSTEM_LETTER = "one of C E F H K L O P R U n after a dollar"
A_PARAMETER = "the letter of a parameter (A-N but D, U, a-n but l, u)"


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("$C", Configure()),
        ("$C please", Configure()),
        ("$E", ShowMemory()),
        ("$F", StepMode(full_step=True)),
        ("$P", StepMode(full_step=False)),
        ("$U", ToggleStepMode()),
        # Manual, "System Commands": an explicit 0, any other value leaves it on.
        ("$H0", SendCrcs(on=False)),
        ("$H000", SendCrcs(on=False)),
        ("$H", SendCrcs(on=True)),
        ("$H1", SendCrcs(on=True)),
        ("$H" + "9" * 5000, SendCrcs(on=True)),
        ("$K0", SendAcks(on=False)),
        ("$K", SendAcks(on=True)),
        ("$K10", SendAcks(on=True)),
        ("$L1", Ramp(linear=True)),
        ("$L0", Ramp(linear=False)),
        ("$n", ToggleEncoder()),
        ("$O1", SendSoftOps(on=True)),
        ("$O0", SendSoftOps(on=False)),
        ("$R", Reboot()),
        ("$R now", Reboot()),
        # Manual, "ustep": the TB6600's quarter step.
        ("$CU21", MapPins(2, 1)),
        ("$CU07", MapPins(0, 7)),
    ],
)
def test_system_lines_mean(line: str, command: object) -> None:
    assert parse(line) == Parsed(command)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("line", "parameter", "value"),
    [
        # Manual, "System Commands", "autorun", "clock", "Accel", "Decel", "V", "Configure".
        ("$CA8", Parameter.AUTORUN, 8),
        ("$CA30", Parameter.AUTORUN, 30),
        ("$CA0", Parameter.AUTORUN, 0),
        ("$CC0", Parameter.CLOCK, 0),
        ("$CB1", Parameter.RAMP, 1),
        ("$CE1", Parameter.NETWORK, 1),
        ("$CF1", Parameter.CW, 1),
        ("$CG0", Parameter.DIR, 0),
        ("$CH255", Parameter.IHD, 255),
        ("$CI0", Parameter.XCLK, 0),
        ("$CJ7", Parameter.USTEP, 7),
        ("$CK30", Parameter.PULSE, 30),
        ("$CL10", Parameter.SLOW, 10),
        ("$CM085", Parameter.D_ID, 85),
        ("$CM4", Parameter.D_ID, 4),
        ("$CN2", Parameter.R_ID, 2),
        ("$Ca65535", Parameter.SPRF, 65535),
        ("$Cb3000", Parameter.CYCLE, 3000),
        ("$Cc4294967295", Parameter.XFREQ, 4294967295),
        ("$Cd1.25", Parameter.ACC, 125),
        ("$Ce.5", Parameter.DEC, 50),
        ("$Cf10.47", Parameter.L_ACC, 1047),
        ("$Cg999", Parameter.L_DEC, NO_RAMP),
        ("$Ch36", Parameter.OPS, 36),
        ("$Ci1", Parameter.SOFT_OPS, 1),
        ("$Cj0", Parameter.ACK, 0),
        ("$Ck0", Parameter.CRC, 0),
        ("$Cm2000000", Parameter.HW, 2000000),
        ("$Cn38400", Parameter.SW, 38400),
        # Manual, "Miscellaneous".
        ("$Cu1", Parameter.OVERRIDE, 1),
        ("$Cu0 rest", Parameter.OVERRIDE, 0),
    ],
)
def test_parameters_are_typed_by_their_letter(line: str, parameter: Parameter, value: int) -> None:
    assert parse(line) == Parsed(SetParameter(parameter, value))
    assert parse_in(Mode.CONFIGURE, line[2:]) == Parsed(SetParameter(parameter, value))


def test_every_parameter_is_in_the_table_above() -> None:
    (marked,) = test_parameters_are_typed_by_their_letter.pytestmark  # type: ignore[attr-defined]
    assert {parameter for _, parameter, _ in marked.args[1]} == set(Parameter)


@pytest.mark.parametrize(
    ("line", "column", "expected", "got"),
    [
        ("$", 2, A_SYSTEM_LETTER, END),
        ("$Z", 2, A_SYSTEM_LETTER, "'Z'"),
        ("$\x1b", 2, A_SYSTEM_LETTER, r"'\x1b'"),
        ("$r", 2, "R: case counts after a dollar", "'r'"),
        ("$ca8", 2, "C: case counts after a dollar", "'c'"),
        ("$N", 2, "n: case counts after a dollar", "'N'"),
        ("$R1", 3, END, "'1'"),
        ("$F1", 3, END, "'1'"),
        ("$nn", 3, END, "'n'"),
        ("$Hx", 3, END, "'x'"),
        ("$H0x", 4, END, "'x'"),
        ("$K-1", 3, END, "'-'"),
        ("$L", 3, "0 (harmonic) or 1 (linear) after $L", END),
        ("$L2", 3, "0 (harmonic) or 1 (linear) after $L", "'2'"),
        ("$L10", 4, END, "'0'"),
        ("$O", 3, "0 (off) or 1 (on) after $O", END),
        ("$O7", 3, "0 (off) or 1 (on) after $O", "'7'"),
        ("$CZ5", 3, A_PARAMETER, "'Z'"),
        ("$CD1", 3, A_PARAMETER, "'D', which has none"),
        ("$Cl1", 3, A_PARAMETER, "'l', which has none"),
        ("$C8", 3, A_PARAMETER, "'8'"),
        ("$CA", 4, "the value of autorun", END),
        ("$CA-8", 4, "the value of autorun", "'-'"),
        ("$CA8.5", 5, END, "'.'"),
        ("$CA8x", 5, END, "'x'"),
        ("$CB1x", 5, END, "'x'"),
        ("$Cd", 4, "the value of acc", END),
        ("$Cd.", 5, "the digits of acc", END),
        ("$Cdx", 4, "the value of acc", "'x'"),
        ("$Cd1.2.3", 7, END, "'.'"),
        ("$Ca1e3", 5, END, "'e'"),
        ("$CU", 4, "an exponent, one digit 0 to 7", END),
        ("$CU8", 4, "an exponent, one digit 0 to 7", "'8'"),
        ("$CU2", 5, "the levels of the pins, one digit 0 to 7", END),
        ("$CU29", 5, "the levels of the pins, one digit 0 to 7", "'9'"),
        ("$CU211", 6, END, "'1'"),
    ],
)
def test_system_lines_that_do_nothing_say_why(
    line: str, column: int, expected: str, got: str
) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.expected, remark.got) == (column, expected, got)
    assert remark.text == NOTHING


@pytest.mark.parametrize(
    ("line", "value", "consequence"),
    [
        # Manual, "autorun": anything greater is pared back to the maximum.
        ("$CA31", 30, "30 is used"),
        ("$CA256", 30, "30 is used"),
        # Manual, "Configure Menu": any non-zero number is dealt with as a one.
        ("$CB2", 1, "1 is used"),
        ("$Cj256", 1, "1 is used"),
        ("$Cu" + "9" * 5000, 1, "1 is used"),
        # Spec, "System commands": 8 bits keep the low ones.
        ("$CH256", 0, "0 is used"),
        ("$CK511", 255, "255 is used"),
        ("$CM341", 85, "85 is used"),
        ("$Ch100100", 100100 % 256, "4 is used"),
        ("$CI12345678901234567890123", 12345678901234567890123 % 256, "203 is used"),
        # What nothing can be divided by.
        ("$CL0", 1, "1 is used"),
        ("$Ca0", 200, "200 is used"),
        ("$Cb00", 3000, "3000 is used"),
        ("$Cc0", 1_000_000, "1000000 is used"),
        ("$Cm0", 38_400, "38400 is used"),
        ("$Cn0", 38_400, "38400 is used"),
        ("$Cd0", NO_RAMP, "it acts as 999: no ramp"),
        ("$Ce1000", NO_RAMP, "999 is used: no ramp"),
        ("$Cf1.239", 123, "the rest is cut off"),
        # Manual, "d_id", "hw", "sw", "RS485".
        ("$CM0", 0, "it is stored as it is"),
        ("$CM3", 3, "it is stored as it is"),
        ("$Cm57600", 57_600, "it is stored as it is"),
        ("$Cm115200", 115_200, "it is stored as it is"),
        ("$Cm230400", 230_400, "it is stored as it is"),
        ("$Cn38401", 38_401, "it is stored as it is"),
    ],
)
def test_values_that_are_not_taken_as_written_are_remarked(
    line: str, value: int, consequence: str
) -> None:
    parsed = parse(line)
    assert isinstance(parsed.command, SetParameter)
    assert parsed.command.value == value
    assert [(remark.column, remark.text) for remark in parsed.remarks] == [(4, consequence)]


@pytest.mark.parametrize(
    "line",
    ["$CJ8", "$CN3", "$Ca65536", "$Cb4294967296", "$Cc4294967296", "$Cm2000001", "$Cn4294967296"],
)
def test_values_beyond_their_bits_are_ignored_and_nothing_is_stored(line: str) -> None:
    parsed = parse(line)
    assert parsed.command is None
    (remark,) = parsed.remarks
    assert (remark.column, remark.text) == (4, "the value is ignored")


def test_a_value_can_be_wrong_twice() -> None:
    parsed = parse("$CM258")
    assert parsed.command == SetParameter(Parameter.D_ID, 2)
    assert [remark.text for remark in parsed.remarks] == ["2 is used", "it is stored as it is"]
    assert parse("$CL256").command == SetParameter(Parameter.SLOW, 1)


@given(nearly_commands)
def test_the_configure_screen_reads_parameters_as_the_prompt_does(line: str) -> None:
    if line[:1] in tuple("xXsS ") or not line:
        return
    at_prompt, inside = parse("$C" + line), parse_in(Mode.CONFIGURE, line)
    assert inside.command == at_prompt.command
    assert [(one.column + 2, one.expected, one.got, one.text) for one in inside.remarks] == [
        (one.column, one.expected, one.got, one.text) for one in at_prompt.remarks
    ]
