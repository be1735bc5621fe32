"""The Super Stepper dissector in tshark tells what sacbus itself decoded."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from nodes.superstepper import KIND
from sacbus.feed import Sent
from sacbus.kernel import MS
from sacbus.trace.capture import Capture
from sacbus.watch import Entry, Spoken, Watch
from sacbus.wire.superstepper import (
    Answer,
    ChangeSpeed,
    Expanded,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Read,
    Stop,
    Write,
    describe,
    encode,
    encode_answer,
)
from tests.trace.tshark import TSHARK, needs_tshark

pytestmark = [needs_tshark, pytest.mark.slow]

MESSAGES = (
    MoveAtSpeed(True, 4_000),
    MoveSteps(False, 10_000, 400, home=True),
    ChangeSpeed(5),
    Microsteps(3),
    Stop(),
    Expanded(),
    Write(0x10, 0x5A, eeprom=True),
    Read(7, word=True),
)
RATE = KIND.protocol.rate


def capture(path: Path) -> Path:
    """Every message, answered but for the last; an answer with flags, a NAK, and noise."""
    watch = Watch(KIND.protocol, RATE, lanes=2)
    entries: list[Entry] = []
    now = 0

    def say(lane: int, data: bytes, sender: str) -> None:
        nonlocal now, entries
        end = now + RATE.span(len(data))
        entries += watch.sent(Sent(now, end, lane, sender, None, data))
        now = end + MS

    for message in MESSAGES:
        say(0, encode(3, message), "master")
        if not isinstance(message, Read):
            say(1, encode_answer(Answer(3)), "node 3")
    now += 3_000 * MS
    say(1, encode_answer(Answer(4, value=0x1234, framing=True)), "node 4")
    say(1, encode_answer(Answer(4, positive=False)), "node 4")
    say(1, b"\x55\x01" + encode_answer(Answer(4)), "noise")
    entries += watch.end(now)
    made = Capture()
    line = made.line("bench", KIND.protocol.name, RATE, lanes=2)
    blocks = b"".join(line.blocks(entry) for entry in entries if isinstance(entry, Spoken))
    path.write_bytes(made.header + line.header + blocks)
    return path


def fields(path: Path, *names: str, more: tuple[str, ...] = ()) -> list[list[str]]:
    assert TSHARK is not None
    asked = [word for name in names for word in ("-e", f"superstepper.{name}")]
    script = f"lua_script:{KIND.protocol.dissector}"
    ran = subprocess.run(
        [TSHARK, "-X", script, "-r", path, *more, "-T", "fields", *asked],
        capture_output=True,
        check=True,
        text=True,
        timeout=60,
    )
    assert "Lua Error" not in ran.stdout + ran.stderr
    return [line.split("\t") for line in ran.stdout.splitlines()]


def test_every_message_and_answer_is_told(tmp_path: Path) -> None:
    path = capture(tmp_path / "bench.pcapng")
    told = fields(path, "type", "addr", "command", "response_to")
    messages = [one for one in told if one[0] == "message"]
    assert [one[2] for one in messages] == [describe(one) for one in MESSAGES]
    assert {one[1] for one in messages} == {"3"}
    answers = [one for one in told if one[0] in ("ack", "nak")]
    assert [one[0] for one in answers] == ["ack"] * 8 + ["nak", "ack"]
    assert [one[3] for one in answers] == ["1", "3", "5", "7", "9", "11", "13", "", "", ""]
    assert [one[0] for one in told if one[0] == "garbage"] == ["garbage"]


def test_operands_and_flags_stand_in_fields(tmp_path: Path) -> None:
    path = capture(tmp_path / "bench.pcapng")
    (move,) = fields(path, "speed", "steps", "home", "clockwise", more=("-Y", "superstepper.steps"))
    assert move[:2] == ["10000", "400"]
    assert [one.lower() in ("1", "true") for one in move[2:]] == [True, False]
    (read,) = fields(path, "value", more=("-Y", "superstepper.framing == 1"))
    assert read == ["4660"]
    whole = ("-2", "-R", "superstepper", "-Y", "superstepper.expert.no_answer")
    (silent,) = fields(path, "command", more=whole)
    assert silent == ["read the word at RAM 0x07"]
