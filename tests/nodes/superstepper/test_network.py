"""The serial port, byte for byte: messages, answers, time-outs, flags, in both modes."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.kernel import MS, US
from sacbus.node import ReportKind
from sacbus.wire import packets
from sacbus.wire.superstepper import Answer, MoveAtSpeed, Read, decode_answer, encode
from tests.nodes.superstepper.bench import Bench, Said

#: Header of address 3 with each opcode: 3 << 3 | opcode.
TRANSCRIPTS = [
    ("move at speed", "18 0c 0f a0", "83 00 00 00 83"),
    ("move steps", "19 04 0f a0 00 0a", "83 00 00 00 83"),
    ("change speed", "1a 0f a0", "83 00 00 00 83"),
    ("microsteps", "1b 07", "83 00 00 00 83"),
    ("stop", "1c 03", "83 00 00 00 83"),
    ("expanded", "1d", "83 00 00 00 83"),
    ("write", "1e 00 10 5a", "83 00 00 00 83"),
    ("read a byte of RAM", "1f 00 02", "83 00 00 0a 8d"),
    ("read a word of RAM", "1f 02 03", "83 00 7d 00 00"),
    ("read a byte of EEPROM", "1f 01 00", "83 00 00 19 9c"),
    ("read a word of EEPROM, which is a byte", "1f 03 01", "83 00 00 03 86"),
]


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
@pytest.mark.parametrize(("what", "sent", "answered"), TRANSCRIPTS, ids=[t[0] for t in TRANSCRIPTS])
def test_every_opcode_is_answered(what: str, sent: str, answered: str, *, nine: bool) -> None:
    bench = Bench(3, nine=nine)
    assert bench.exchange(sent) == answered
    assert not bench.bus.reports


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_an_answer_comes_the_turnaround_after_the_last_bit(*, nine: bool) -> None:
    bench = Bench(3, nine=nine)
    bench.exchange("1f 00 02")
    end = bench.span(3)
    assert end == 3 * (11 if nine else 10) * 1_000_000_000 // 9_600
    assert [one.at for one in bench.heard] == [end + 100 * US]
    quick = Bench(3, nine=nine, turnaround_us=0)
    quick.exchange("1f 00 02")
    assert [one.at for one in quick.heard] == [end]


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_an_address_without_a_module_is_silent(*, nine: bool) -> None:
    bench = Bench(3, 4, nine=nine)
    for address in (0, 2, 5, 31):
        assert bench.exchange(encode(address, Read(2)).hex()) == ""


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_two_modules_on_a_bus_obey_their_own_messages(*, nine: bool) -> None:
    bench = Bench(3, 4, nine=nine)
    assert bench.exchange("18 04 0f a0") == "83 00 00 00 83"
    assert bench.exchange("20 00 1f 40") == "84 00 00 00 84"
    bench.run(100 * MS)
    left, right = (node.snapshot(bench.now) for node in bench.nodes)
    assert (left.address, right.address) == (3, 4)
    assert left.rpm == 150
    assert right.rpm == -75
    assert bench.ask(3, Read(2)) == Answer(3, value=10)
    assert bench.ask(4, Read(3, word=True)) == Answer(4, value=32_000)


def test_a_master_who_does_not_wait_has_two_answers_at_once() -> None:
    bench = Bench(3, 4)
    bench.talk(bytes.fromhex("1f 00 02 27 02 03"))
    bench.run(30 * MS)
    assert [decode_answer(one.data) for one in bench.heard] == [None, None]
    assert bench.bus.medium.counters(1).collided == 2


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_a_message_that_does_not_come_whole_gets_a_nak_and_is_not_executed(*, nine: bool) -> None:
    bench = Bench(3, nine=nine)
    assert bench.exchange("18 04 0f") == "03 00 00 00 03"
    # 10 byte times, which are more than 5 ms at 9600 baud, from the end of the last byte on.
    assert bench.heard == [
        Said(bench.span(3) + 10 * bench.span(1), bytes.fromhex("03 00 00 00 03"))
    ]
    assert bench.node.state(bench.now) == "STANDBY"
    assert bench.node.snapshot(bench.now).counters["nak"] == 1
    # The next one begins anew.
    assert bench.exchange("1f 00 02") == "83 00 00 0a 8d"


def test_a_quick_line_waits_five_ms() -> None:
    bench = Bench(3, baud=57_600)
    bench.exchange("18 04 0f")
    assert bench.heard[0].at == bench.span(3) + 5 * MS


def test_bytes_with_pauses_below_the_time_out_are_one_message() -> None:
    bench = Bench(3)
    for byte in bytes.fromhex("1f 00 02"):
        bench.talk(bytes((byte,)))
        bench.run(10 * MS)
    bench.run(20 * MS)
    assert [one.data.hex(" ") for one in bench.heard] == ["83 00 00 0a 8d"]


def test_anothers_message_that_does_not_come_whole_is_nobodys() -> None:
    bench = Bench(3)
    assert bench.exchange("28 04") == ""
    assert bench.exchange("1f 00 02") == "83 00 00 0a 8d"


def test_in_8_bit_mode_a_lost_byte_shifts_everything_until_the_time_out() -> None:
    bench = Bench(3)
    # The header of the second is taken for the last operand of the first.
    bench.talk(bytes.fromhex("18 04 0f 1f 00 02"))
    bench.run(40 * MS)
    answers = [decode_answer(one.data) for one in bench.heard]
    assert answers[0] == Answer(3)
    course = bench.node.commands.command
    assert course == MoveAtSpeed(clockwise=True, speed=0x0F1F, accelerate=False)
    # 00 02 begin a message for address 0: nobody's, and over after its time-out.
    assert bench.exchange("1f 00 02") == "83 00 00 0a 8d"


def test_an_emergency_stop_of_sacs_is_another_message_here() -> None:
    bench = Bench(0)
    bench.execute(MoveAtSpeed(True, 4_000, accelerate=False))
    bench.exchange(packets.encode(packets.GENERAL_CALL, packets.MOTHER, b"S").hex())
    assert bench.node.commands.status(bench.now).changing_speed
    assert bench.bus.reports[0].text == "speed 1 is below the 100 that its rate allows"


def test_in_9_bit_mode_the_next_header_puts_all_right() -> None:
    bench = Bench(3, nine=True)
    bench.talk(bytes.fromhex("18 04 0f 1f 00 02"), bytes((1, 0, 0, 1, 0, 0)))
    bench.run(40 * MS)
    assert [one.data.hex(" ") for one in bench.heard] == ["83 00 00 0a 8d"]
    assert bench.node.commands.command is None
    # Operands without a header are nothing, whatever they look like.
    bench.heard.clear()
    bench.talk(bytes.fromhex("1f 00 02"), bytes(3))
    bench.run(40 * MS)
    assert bench.heard == []


def test_a_framing_error_is_told_in_the_next_answer() -> None:
    bench = Bench(3)
    sent = bytes.fromhex("28 04 0f a0")
    while not bench.node.network.framing_errors:
        # A stranger talks over a message for somebody else: half of the bytes lose their stop bit.
        bench.talk(sent)
        bench.kernel.at(bench.now + 100 * US, bench.bus.medium.transmit, "stranger", b"\x55", 0)
        bench.run(100 * MS)
    bench.heard.clear()
    assert bench.exchange("1f 00 02") == "c3 00 00 0a cd"
    answer = decode_answer(bench.heard[0].data)
    assert answer == Answer(3, value=10, framing=True)
    # It has been told.
    assert bench.exchange("1f 00 02") == "83 00 00 0a 8d"


def test_what_comes_while_it_answers_is_held_as_far_as_its_uart_holds_it() -> None:
    bench = Bench(3)
    # Two bytes are held and read when the answer is out; the third has no room.
    bench.talk(bytes.fromhex("1f 00 02 1c 03 1c"))
    bench.run(60 * MS)
    answers = [decode_answer(one.data) for one in bench.heard]
    assert answers == [Answer(3, value=10), Answer(3, overrun=True)]
    assert bench.heard[1].data.hex(" ") == "a3 00 00 00 a3"
    first, second = (one.at for one in bench.heard)
    assert second == first + bench.span(5) + 100 * US
    assert [one.kind for one in bench.bus.reports] == [ReportKind.LOST]


@given(
    data=st.binary(min_size=1, max_size=60),
    marks=st.binary(min_size=60, max_size=60),
    nine=st.booleans(),
    pause=st.integers(0, 30),
)
@settings(max_examples=150)
def test_random_bytes_never_raise_and_leave_it_obedient(
    data: bytes, marks: bytes, pause: int, *, nine: bool
) -> None:
    bench = Bench(3, 4, nine=nine)
    bench.node.movement.watch(lambda *_: None, 0)
    cut = len(data) // 2
    ninth = bytes(mark & 1 for mark in marks)
    bench.talk(data[:cut], ninth[:cut])
    bench.run(pause * MS)
    bench.talk(data[cut:], ninth[cut : len(data)])
    bench.run(200 * MS)
    for node in bench.nodes:
        node.snapshot(bench.now)
    bench.heard.clear()
    bench.talk(encode(3, Read(0x17)))
    bench.run(30 * MS)
    (said,) = bench.heard
    answer = decode_answer(said.data)
    assert answer is not None
    assert (answer.address, answer.positive) == (3, True)
