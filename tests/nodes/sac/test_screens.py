"""The screens, against the manual's pictures of them."""

from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import screens
from nodes.sac.screens import EEPROM_SIZE, Flags
from sacbus.language import Defaults, Motion, Parameter, Session, Velocity, seeded_row
from tests.language.strategies import values as values_of

#: As the manual prints it ("Configure"), its blanks as the text that we have of it has them.
PICTURE = """\
Config:
A autorun      14      a sprf          200
B ramp         0      b cycle         3000
C clock        1      c xfreq         1000000
D              0      d acc           1.00
E network      0      e dec           1.00
F cw           0      f l_acc          10.47
G dir          CW     g l_dec          10.47
H ihd          8      h ops           100100
I xclk         0      i soft_ops       0
J ustep        1      j ACK            1
K pulse        30     k CRC            1
L slow         10
M d_id         85     m hw             38400
N r_id         0      n sw             38400
"""

#: Rows of the picture that have lost no blank and got none.
EXACT = ["Config:", "B", "C", "D", "E", "H", "L"]

FACTORY = {parameter: parameter.factory for parameter in Parameter}
PICTURED = {**FACTORY, Parameter.AUTORUN: 14, Parameter.USTEP: 1, Parameter.PULSE: 30}

memories = st.fixed_dictionaries({parameter: values_of(parameter) for parameter in Parameter})
FLAGS = Flags(gap=True, debug=False, throttle=False, soft_ops=False, ack=True, crc=True, source=0)


def test_the_configure_screen_is_the_manuals_but_for_blanks() -> None:
    lines = screens.configuration(PICTURED)
    pictured = PICTURE.splitlines()
    assert [line.split() for line in lines] == [line.split() for line in pictured]
    for line, picture in zip(lines, pictured, strict=True):
        assert line == picture or picture.split()[0] not in EXACT
        assert line.rstrip() == line


@given(memories)
def test_the_columns_of_the_configure_screen_never_move(memory: dict[Parameter, int]) -> None:
    for line in screens.configuration(memory)[1:]:
        assert line[:2].strip() in "ABCDEFGHIJKLMN"
        assert line[14] == " " != line[15]
        assert len(line) <= 22 or (line[21] == " " and line[22].islower() and line[38] != " ")


def test_the_direction_is_shown_as_what_it_means_and_ops_in_binary() -> None:
    lines = screens.configuration({**FACTORY, Parameter.DIR: 1, Parameter.OPS: 0})
    assert lines[7].split() == ["G", "dir", "CCW", "g", "l_dec", "10.47"]
    assert lines[8].split() == ["H", "ihd", "8", "h", "ops", "0"]
    lines = screens.configuration({**FACTORY, Parameter.DIR: 1, Parameter.CW: 1})
    assert lines[7].split()[:3] == ["G", "dir", "CW"]


def test_the_session_screen_shows_defaults_flags_and_the_encoders_mode() -> None:
    session = Session().with_velocity(Velocity(None, 42567))
    assert screens.session(session, FLAGS) == [
        "Session:",
        "RPM            7",
        "cycle          42567",
        "acc            1.00",
        "dec            1.00",
        "ramp           0",
        "dir            CW",
        "full step      1",
        "GAP            1",
        "debug          0",
        "soft_ops       0",
        "ACK            1",
        "CRC            1",
        "encoder        EnF",
        "source         0",
    ]


def test_every_flag_of_the_session_screen_is_its_own() -> None:
    plain = screens.session(Session(), FLAGS)
    other = Session(linear=True, full_step=False, defaults=Defaults(cw=False))
    turned = Flags(
        gap=False, debug=True, throttle=True, soft_ops=True, ack=False, crc=False, source=7
    )
    changed = screens.session(other, turned)
    assert plain[:5] == changed[:5]
    assert [line[15:] for line in changed[5:]] == [
        "1",
        "CCW",
        "0",
        "0",
        "1",
        "1",
        "0",
        "0",
        "EnT",
        "7",
    ]


def test_the_velocity_is_shown_in_rpm_and_as_a_cycle() -> None:
    """Manual, "V": 4567 displays 65 RPM, 65 RPM a cycle of 4615."""
    assert screens.velocity(Session().with_velocity(Velocity(None, 4567))) == ["65 RPM  cycle 4567"]
    assert screens.velocity(Session().with_velocity(Velocity(65))) == ["65 RPM  cycle 4615"]


def test_the_array_of_references_is_the_manuals() -> None:
    picture = ["x_ 0 1", "x_ 1 3", "x_ 2 7", "x_ 3 5", "x_ 4 0"]
    assert screens.references((1, 3, 7, 5, 0)) == picture
    assert screens.references((1, 3, 7, 5, 0, 9, 0)) == picture
    assert screens.references((1, 3, 7, 5)) == picture[:4]
    assert screens.references(()) == screens.references((0,)) == ["x_ 0 0"]


def test_a_timing_is_the_lines_and_that_of_loading() -> None:
    """11 characters of 260.4 us, 40 us of loading."""
    assert screens.timing(11, 40) == ["2904 us"]


@given(memories)
def test_the_eeprom_screen_shows_every_parameter_as_it_is_stored(
    memory: dict[Parameter, int],
) -> None:
    lines = screens.eeprom(memory, range(8))
    assert lines[0] == "EEPROM:"
    shown = {line[0]: line.split()[2] for line in lines[1:-1]}
    assert set(shown) == {parameter.letter for parameter in Parameter}
    for parameter, value in memory.items():
        stored = shown[parameter.letter]
        assert int(stored.replace(".", "")) == value
        assert ("." in stored) == parameter.decimal
    assert lines[-1] == "U pins         000 001 010 011 100 101 110 111"


@given(memories)
def test_the_dump_is_the_whole_eeprom(memory: dict[Parameter, int]) -> None:
    data = screens.image(memory, range(8), [seeded_row(Defaults())] * 30)
    assert len(data) == EEPROM_SIZE
    lines = screens.dump(data)
    assert [int(line[:4], 16) for line in lines] == list(range(0, EEPROM_SIZE, 16))
    assert b"".join(bytes.fromhex(line[6:]) for line in lines) == data
    # A to N are a byte each; a follows in two.
    assert data[11] == memory[Parameter.D_ID]
    assert int.from_bytes(data[13:15], "little") == memory[Parameter.SPRF]


def test_a_saved_queue_lies_behind_the_parameters_and_the_pins() -> None:
    row = Motion(600, False, 50, 6000, 100, 50, True, 6, 3000, True, pulses=True)
    data = screens.image(FACTORY, range(8), [row])
    without = screens.image(FACTORY, range(8), [])
    begin = len(without.rstrip(b"\xff"))
    assert data[:begin] == without[:begin]
    assert struct.unpack_from("<BIIIffBI", data, begin) == (15, 600, 50, 6000, 1.0, 0.5, 6, 3000)
    assert set(data[begin + 26 :]) == {0xFF}
