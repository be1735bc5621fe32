"""The table of the persistent parameters, against the manual's screen and the system defaults."""

from __future__ import annotations

from sacbus.language import Beyond, Defaults, Mode, Parameter, Parsed, SetParameter, parse_in

# Manual, "Configure": the screen, with the factory values of the text where the screen shows others
# (autorun 0, ustep 0, pulse 1).
SCREEN = """
A autorun   0   a sprf     200
B ramp      0   b cycle    3000
C clock     1   c xfreq    1000000
E network   0   d acc      1.00
F cw        0   e dec      1.00
G dir       0   f l_acc    10.47
H ihd       8   g l_dec    10.47
I xclk      0   h ops      36
J ustep     0   i soft_ops 0
K pulse     1   j ACK      1
L slow      10  k CRC      1
M d_id      85  m hw       38400
N r_id      0   n sw       38400
"""


def test_letters_names_and_factory_values_are_those_of_the_screen() -> None:
    words = SCREEN.split()
    shown = set(zip(words[::3], words[1::3], words[2::3], strict=True))
    table = {
        (
            parameter.letter,
            parameter.title,
            f"{parameter.factory / 100:.2f}" if parameter.decimal else str(parameter.factory),
        )
        for parameter in Parameter
        if parameter is not Parameter.OVERRIDE
    }
    assert table == shown


def test_every_factory_value_can_be_typed() -> None:
    for parameter in Parameter:
        stored = SetParameter(parameter, parameter.factory)
        assert parse_in(Mode.CONFIGURE, stored.entry()) == Parsed(stored)


def test_the_factorys_defaults_of_a_session_are_those_of_the_table() -> None:
    assert Defaults() == Defaults(
        cycle_us=Parameter.CYCLE.factory,
        acc100=Parameter.ACC.factory,
        dec100=Parameter.DEC.factory,
        linear_acc100=Parameter.L_ACC.factory,
        linear_dec100=Parameter.L_DEC.factory,
        linear=bool(Parameter.RAMP.factory),
        sprf=Parameter.SPRF.factory,
        cw=Parameter.DIR.factory == Parameter.CW.factory,
        full_step=not Parameter.OVERRIDE.factory,
    )


def test_flags_are_one_bit_and_8_bit_values_keep_their_low_ones() -> None:
    for parameter in Parameter:
        assert (parameter.largest == 1) == (parameter.beyond is Beyond.ONE)
        assert (parameter.largest == 255) == (parameter.beyond is Beyond.LOW_BITS)
        assert parameter.zero is None or 0 < parameter.zero <= parameter.largest
