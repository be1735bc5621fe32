"""Which packets tell of a command, and what they tell."""

from __future__ import annotations

import pytest

from sacbus.mother.soft_ops import SoftOpHeard, soft_op
from sacbus.wire import Packet, Verdict


@pytest.mark.parametrize("verdict", [Verdict.RIGHT, Verdict.UNCHECKED])
@pytest.mark.parametrize(("body", "begins"), [(b"\x11", True), (b"\x12", False)])
def test_a_start_and_an_end_are_told_to_everybody(
    body: bytes, begins: bool, verdict: Verdict
) -> None:
    assert soft_op(Packet(0, 85, body, verdict), 7) == SoftOpHeard(85, begins, 7)


@pytest.mark.parametrize(
    ("dest", "body"), [(1, b"\x11"), (0, b""), (0, b"\x13"), (0, b"\x11\x11"), (0, b" hello")]
)
def test_nothing_else_is_one(dest: int, body: bytes) -> None:
    assert soft_op(Packet(dest, 85, body, Verdict.RIGHT), 7) is None
