"""A master's words to SS-MST67 modules: what lines come to, and what is said of wrong ones."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from sacbus.cli import root
from sacbus.mother import BadRequest
from sacbus.mother.superstepper_words import COMMANDS, Word, meaning, read_line
from sacbus.wire.superstepper import (
    Answer,
    ChangeSpeed,
    Decay,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Rate,
    Read,
    Status,
    Stop,
    Write,
    encode,
)

LINES: list[tuple[str, int, Message]] = [
    ("3 move-at-speed 4000", 3, MoveAtSpeed(True, 4_000)),
    (
        "0 move-at-speed 4000 --ccw --at-once --rate slow",
        0,
        MoveAtSpeed(False, 4_000, Rate.SLOW, accelerate=False),
    ),
    ("31 move-steps 1600 --speed 2500", 31, MoveSteps(True, 2_500, 1_600)),
    ("3 move-steps --speed=0x10 --ccw 5", 3, MoveSteps(False, 16, 5)),
    ("3 home --speed 10000", 3, MoveSteps(False, 10_000, 0xFFFF, home=True)),
    (
        "  3  home --speed 10000 --cw --most 7 --rate medium ",
        3,
        MoveSteps(True, 10_000, 7, Rate.MEDIUM, home=True),
    ),
    ("3 change-speed 65535", 3, ChangeSpeed(65_535)),
    ("3 microsteps 8 --decay mixed", 3, Microsteps(3, Decay.MIXED)),
    ("03 stop", 3, Stop()),
    ("3 stop --at-once --off", 3, Stop(decelerate=False, enabled=False)),
    ("3 read 0x1f", 3, Read(0x1F)),
    ("3 read 3 --word", 3, Read(3, word=True)),
    ("3 write 0x10 66 --eeprom", 3, Write(0x10, 66, eeprom=True)),
    ("3 status", 3, Read(6)),
    ("3 steps-run", 3, Read(7, word=True)),
]


@pytest.mark.parametrize(("line", "address", "message"), LINES, ids=[one[0] for one in LINES])
def test_a_line_is_the_message_that_it_says(line: str, address: int, message: Message) -> None:
    order = read_line(line)
    assert (order.address, order.message) == (address, message)
    assert order.text == " ".join(line.split()[1:])


def test_each_command_of_the_table_stands_in_a_line_here() -> None:
    assert {line.split()[1] for line, _, _ in LINES} == set(COMMANDS)


WRONG: list[tuple[str, str]] = [
    ("", "expected an address from 0 to 31 and a command, as in 3 stop, got ''"),
    ("stop 3", "expected an address from 0 to 31 and a command, as in 3 stop, got 'stop'"),
    ("32 stop", "expected an address from 0 to 31 and a command, as in 3 stop, got '32'"),
    ("0000000099 stop", "expected an address from 0 to 31 and a command, as in 3 stop, got '0"),
    ("3m400", "expected an address from 0 to 31 and a command, as in 3 stop, got '3m400'"),
    ("3", f"expected a command ({', '.join(COMMANDS)}), got none"),
    ("3 halt", f"expected a command ({', '.join(COMMANDS)}), got 'halt'"),
    ("3 stop 5", "expected nothing behind stop, got '5'"),
    ("3 write 5", "expected PLACE and BYTE behind write, got '5'"),
    ("3 move-steps --speed 9", "expected STEPS behind move-steps, got nothing"),
    ("3 move-steps 5", "expected --speed with a number from 0 to 65535, got none"),
    ("3 move-steps 5 --speed", "--speed: expected a number from 0 to 65535, got nothing"),
    (
        "3 move-steps -5 --speed 9",
        "steps: expected a number from 0 to 65535, got '-5': steps count up, --ccw turns the other",
    ),
    (
        "3 move-at-speed -5",
        "speed: expected a number from 0 to 65535, got '-5': a speed has no sign, --ccw turns the",
    ),
    ("3 write 0 -5", "byte: expected a number from 0 to 255, got '-5'"),
    ("3 move-steps 5 -x --speed 9", "move-steps: expected --speed, --rate, --ccw, got '-x'"),
    ("3 move-steps 65536 --speed 9", "steps: expected a number from 0 to 65535, got '65536'"),
    ("3 home --speed x", "--speed: expected a number from 0 to 65535, got 'x'"),
    ("3 home --speed 9 --rate quick", "--rate: expected fast, medium or slow, got 'quick'"),
    ("3 status --now", "status: expected no options, got '--now'"),
    ("3 stop --off=1", "--off: expected no value, got '1'"),
    ("3 microsteps 3", "per-step: expected 1, 2, 4 or 8, got '3'"),
    ("3 read 0 --word --eeprom", "a word is read of RAM alone, leave --word or --eeprom out"),
]


@pytest.mark.parametrize(("line", "told"), WRONG, ids=[one[0] for one in WRONG])
def test_a_wrong_line_is_told_with_what_is_expected(line: str, told: str) -> None:
    with pytest.raises(BadRequest) as wrong:
        read_line(line)
    assert str(wrong.value).startswith(f"line {line!r}: {told}")


@given(st.text(st.sampled_from("03 -=x1stopreadmv\t\x00é") | st.characters(), max_size=30))
def test_any_text_is_a_line_or_is_refused(text: str) -> None:
    try:
        order = read_line(text)
    except BadRequest:
        return
    encode(order.address, order.message)


@pytest.mark.parametrize("line", [one[0] for one in LINES] + [one[0] for one in WRONG if one[0]])
def test_the_command_line_takes_the_same_lines(line: str) -> None:
    # A line that is understood fails only where it is to be opened.
    ended = CliRunner().invoke(root, ["ss", "/no/such/port", *line.split()])
    try:
        read_line(line)
    except BadRequest:
        assert ended.exit_code == 2, ended.output
    else:
        assert "/no/such/port" in str(ended.exception)


def test_an_answer_says_what_its_command_has_asked() -> None:
    def told(command: str, answer: Answer) -> str:
        return meaning(COMMANDS[command], answer).words

    assert told("stop", Answer(3)) == "ACK"
    assert meaning(COMMANDS["stop"], Answer(3)).mere
    assert not meaning(COMMANDS["stop"], Answer(3, overrun=True)).mere
    assert not meaning(COMMANDS["status"], Answer(3)).mere
    assert told("stop", Answer(3, overrun=True)) == "ACK (it has seen: overrun)"
    assert told("read", Answer(3, value=66)) == "66 (0x42)"
    assert told("steps-run", Answer(3, value=1_600)) == "1600 steps"
    assert told("status", Answer(3)) == "at rest"
    both = Status(busy=True, changing_speed=True)
    assert told("status", Answer(3, value=both.byte)) == "busy, changing speed"
    fields = COMMANDS["status"].meaning(Answer(3, value=both.byte)).fields
    assert fields == {"status": {"busy": True, "home_complete": False, "changing_speed": True}}


def test_the_page_lists_all_that_answers_say() -> None:
    page = (Path(__file__).parents[2] / "docs" / "superstepper.md").read_text(encoding="utf-8")
    rows = {
        name: cell
        for names, cell in re.findall(r"^\| (`[a-z`, -]+`) \| (.*) \|$", page, re.MULTILINE)
        for name in re.findall(r"`(.+?)`", names)
        if name in COMMANDS
    }
    assert set(rows) == set(COMMANDS)
    told = {name: re.findall(r"`(.+?)`", cell) for name, cell in rows.items()}

    def says(name: str, value: int) -> str:
        return COMMANDS[name].meaning(Answer(3, value=value)).words

    statuses = [says("status", status) for status in range(8)]
    assert {word for one in statuses for word in one.split(", ")} == {*told["status"][:-1]}
    assert statuses[-1] == told["status"][-1]
    for name in ("read", "steps-run"):
        assert {says(name, int(one.split()[0])) for one in told[name]} == {*told[name]}
    for name in COMMANDS.keys() - {"status", "read", "steps-run"}:
        assert [says(name, 0)] == told[name]
    both = Answer(3, framing=True, overrun=True)
    assert f"`(it has seen: {', '.join(both.flags)})`" in page


def test_a_word_of_a_command_is_a_number_a_choice_or_a_flag() -> None:
    number, choice, flag = Word("--most", most=7), Word("per-step", choices=("1", "2")), Word("--x")
    assert [one.flag for one in (number, choice, flag)] == [False, False, True]
    assert [one.key for one in (number, choice, flag)] == ["most", "per_step", "x"]
    assert (number.read("0x7"), choice.read("2")) == (7, "2")
    for word, text in ((number, "8"), (number, "-1"), (choice, "3"), (number, "9" * 5_000)):
        with pytest.raises(ValueError, match="expected"):
            word.read(text)
