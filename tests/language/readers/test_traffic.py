"""Messages, padding, and lines for other nodes."""

from __future__ import annotations

import pytest

from sacbus.language import Empty, Forward, Message, Parsed, SoftOp, parse


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("", Empty()),
        ("   ", Empty()),
        (" hello", Message(" hello")),
        (" m200 ", Message(" m200 ")),
        (".", Message(".")),
        (".hi there", Message(".hi there")),
        # Manual, "Communications".
        ("85m3000a2d1", Forward(85, "m3000a2d1")),
        ("85 hello", Forward(85, " hello")),
        ("0s", Forward(0, "s")),
        ("0", Forward(0, "")),
        ("00q9m5", Forward(0, "q9m5")),
        ("085.hi", Forward(85, ".hi")),
        ("255", Forward(255, "")),
        ("/m5 rest", Forward(None, "m5 rest")),
        ("/", Forward(None, "")),
        ("//5", Forward(None, "/5")),
        ("\x11", SoftOp(start=True)),
        ("\x12 ", SoftOp(start=False)),
    ],
)
def test_lines_that_are_no_commands_mean(line: str, command: object) -> None:
    assert parse(line) == Parsed(command)  # type: ignore[arg-type]
    assert parse(line.encode("latin-1")) == parse(line)


@pytest.mark.parametrize(
    ("line", "command", "got", "consequence"),
    [
        ("256m5", Forward(0, "m5"), "256", "0 is used"),
        ("00341/x", Forward(85, "/x"), "00341", "85 is used"),
        ("900000000", Forward(900000000 % 256, ""), "900000000", "0 is used"),
        (
            "12345678901234567890123",
            Forward(12345678901234567890123 % 256, ""),
            "12345678901234567...",
            "203 is used",
        ),
    ],
)
def test_an_address_keeps_its_low_8_bits(
    line: str, command: Forward, got: str, consequence: str
) -> None:
    parsed = parse(line)
    assert parsed.command == command
    (remark,) = parsed.remarks
    assert (remark.column, remark.got, remark.text) == (1, got, consequence)
