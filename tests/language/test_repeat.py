from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    Command,
    Empty,
    Parameter,
    SetParameter,
    SoftOp,
    parse,
    repeatable,
)
from tests.language.strategies import BY_TYPE, commands, nearly_commands, nearly_moves

# Spec, "Mother", Transactions: the list, entry by entry.
REPEATABLE = """
q9m-2000vc1500a1d1l0pu0s0t0 Q30m200 q1s q01S0 q9v100 q9ad q12m q12m-
QS qr Qc
v100 VC3000 v vd a1.5 A d.5 D
$CA8 $CB1 $Cb3000 $Cd1.25 $Ce.5 $Cu1 $CU21 $Cm38400 $CC0
$H0 $H1 $H $K0 $K $L0 $L1 $O0 $O1 $F $P
S s y
LS1 lf30 LN0 ln65535 LN
"""

NOT_REPEATABLE = """
m m200 M-200v100 m200s xm400ads XM x5 X30 xd xl xp xp1,3 + - +-+ N n Z z G g B b
$n $U $R $E $C $ $CA $CD1 $Cl1 $CZ5 $CA8x $ca8 $h0 $f $L $L2 $O $O7 $F1
Q q9 q0m200 q31m200 q300m200 q9x q9m200q QP q9l2 QSS qs1 q9u300
L LA L5 L0 LS LF lx1 LS0 LS31 LS123 LN65536 LN123456 l65536
Y S5 STOP cc CF k v12x v99999999999 a.
85s 0S /s .s
"""


@pytest.mark.parametrize("line", REPEATABLE.split())
@pytest.mark.parametrize("tail", ["", " ", "  rest"])
def test_what_mother_may_send_twice(line: str, tail: str) -> None:
    assert repeatable((line + tail).encode())


@pytest.mark.parametrize("line", NOT_REPEATABLE.split())
@pytest.mark.parametrize("tail", ["", " "])
def test_what_mother_may_not_send_twice(line: str, tail: str) -> None:
    assert not repeatable((line + tail).encode())


@pytest.mark.parametrize("body", [b"", b" ", b"  "])
def test_the_empty_body_of_a_scan_may_be_repeated(body: bytes) -> None:
    assert repeatable(body)


@pytest.mark.parametrize("body", [b" s", b" v100", b".s", b"\x11", b"\x12", b"\xff", b"s\x00"])
def test_messages_soft_ops_and_noise_may_not_be_repeated(body: bytes) -> None:
    assert not repeatable(body)


#: What was found of each type of command so far.
REPEATED: dict[type[Command], bool] = {}


@given(commands)
def test_a_type_of_command_may_be_repeated_whatever_its_fields(command: Command) -> None:
    repeated = REPEATED.setdefault(type(command), repeatable(command.text().encode("latin-1")))
    assert repeatable(command.text().encode("latin-1")) == repeated


def test_every_type_of_command_is_in_one_of_the_lists() -> None:
    listed = {type(parse(line).command) for line in (REPEATABLE + NOT_REPEATABLE).split()}
    # Nothing, and what is no word.
    assert set(BY_TYPE) - listed <= {Empty, SoftOp}


@pytest.mark.parametrize("parameter", Parameter)
def test_every_parameter_may_be_stored_twice(parameter: Parameter) -> None:
    assert repeatable(SetParameter(parameter, parameter.factory).text().encode())


@given(st.integers(1, 30), nearly_moves)
def test_an_edit_made_of_a_motion_command_may_be_repeated(position: int, move: str) -> None:
    if parse(move).command is not None:
        assert repeatable(f"q{position}{move}".encode())


@given(st.binary(max_size=60) | nearly_commands.map(str.encode))
def test_any_bytes_have_an_answer_and_only_commands_may_be_repeated(line: bytes) -> None:
    if repeatable(line):
        assert parse(line).command is not None
