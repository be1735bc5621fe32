from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import (
    Command,
    Forward,
    Message,
    Move,
    Next,
    SinglePulses,
    SoftOp,
    parse,
    repeatable,
)
from tests.language.strategies import commands, nearly_moves

# Spec, "Mother", Transactions: the list, entry by entry.
REPEATABLE = """
q9m-2000vc1500a1d1l0pu0s0t0 Q30m200 q1s q01S0 q9v100 q9ad q12m q12m-
QS qr Qc
v100 VC3000 v vd a1.5 A d.5 D
$CA8 $CB1 $Cb3000 $Cd1.25 $Ce.5 $Cu1 $CU21 $Cm38400 $CC0
$H0 $H1 $H $K0 $K $L0 $L1 $O0 $O1 $F $P
S s y
LS1 lf30 LN0 ln65535
"""

NOT_REPEATABLE = """
m m200 M-200v100 m200s xm400ads XM x5 X30 xd xl xp + - +-+ N n Z z G g B b
$n $U $R $E $C $ $CA $CD1 $Cl1 $CZ5 $CA8x $ca8 $h0 $f $L $L2 $O $O7 $F1
Q q9 q0m200 q31m200 q300m200 q9x q9m200q QP q9l2 QSS qs1
L LA L5 L0 LS LF LN lx1 LS123 LN123456
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


@given(commands)
def test_of_the_commands_only_those_that_set_may_be_repeated(command: Command) -> None:
    once_only = Move, Next, SinglePulses, SoftOp, Message, Forward
    body = command.text().encode("latin-1")
    assert repeatable(body) == (not isinstance(command, once_only))


@given(st.integers(1, 30), nearly_moves)
def test_a_queue_edit_may_be_repeated_exactly_when_it_is_one(position: int, move: str) -> None:
    well_formed = parse(move).command is not None
    assert repeatable(f"q{position}{move}".encode()) == well_formed


@given(st.binary(max_size=60))
def test_any_bytes_have_an_answer(line: bytes) -> None:
    assert repeatable(line) in (True, False)
