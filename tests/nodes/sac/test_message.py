"""The message processor: what a line is, where it goes, and what is reported of it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import MS, SECOND
from sacbus.node import ReportKind
from sacbus.wire import GENERAL_CALL, MOTHER, ack, crc8
from tests.nodes.sac.bench import NODE, Bench, packet

AT = 20 * MS
ACKED = ack(MOTHER, NODE)


def reports(bench: Bench) -> list[tuple[str, str, int]]:
    return [(report.kind.value, report.line, report.column) for report in bench.told()]


# ---- lines that a SAC does not know -------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "column"),
    [
        ("hello", 1),
        ("w5", 1),
        ("Y", 1),
        ("m200x", 5),
        ("m200l2", 6),
        ("mv100q", 6),
        ("m--5", 3),
        ("S5", 2),
        ("yy", 2),
        ("+-x", 3),
        ("v1x", 3),
        ("a1.2.3", 5),
        ("d-1", 2),
        ("m4294967296", 2),
        ("\x80\xff", 1),
        ("\tm200", 1),
    ],
)
def test_an_unknown_line_is_acknowledged_does_nothing_and_is_reported_with_its_place(
    line: str, column: int
) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ACKED]
    assert reports(bench) == [("refused", packet_line(line), column)]
    (report,) = bench.told()
    assert (report.when, report.address) == (AT, NODE)
    assert report.text
    assert bench.position(SECOND) == 0


def packet_line(line: str) -> str:
    """The line as the bench sends it: with a space behind it where its CRC wants one."""
    while crc8(line.encode("latin-1")) in (0, 2, 3):
        line += " "
    return line


@given(st.binary(max_size=46))
def test_no_line_whatsoever_is_refused_on_the_wire(body: bytes) -> None:
    bench = Bench()
    bench.node.board.messages.network_line(body, MOTHER, NODE, 0)
    assert bench.node.snapshot(0).counters["nak"] == 0
    running = bench.node.snapshot(0).current
    for report in bench.told():
        # What the line says, or what the command that it starts cannot do.
        assert report.line in (body.decode("latin-1"), running)
        assert 0 <= report.column <= len(body) + 1


@pytest.mark.parametrize(
    ("line", "column", "kind"),
    [("m200v0", 6, "warning"), ("m200a.001", 6, "warning"), ("m200u999", 6, "warning")],
)
def test_what_is_obeyed_with_a_value_of_its_own_is_a_warning(
    line: str, column: int, kind: str
) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert [(report[0], report[2]) for report in reports(bench)] == [(kind, column)]
    assert bench.position(bench.kernel.now) >= 200


@pytest.mark.parametrize("line", ["", " ", "   ", "\x11", "\x12"])
def test_nothing_and_padding_and_soft_ops_are_nothing_to_report(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ACKED]
    assert bench.told() == []


# ---- queries, and what belongs to the terminal ---------------------------------------------------


@pytest.mark.parametrize("line", ["q", "xd", "cc", "cf", "vd", "$E"])
def test_a_query_that_nobody_can_see_the_answer_of_is_told_as_ignored(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ACKED]
    assert reports(bench) == [("ignored", packet_line(line), 0)]


@pytest.mark.parametrize("line", ["qp", "XP", "$C"])
def test_a_screen_is_not_opened_from_the_network(line: str) -> None:
    bench = Bench()
    shown = bytearray()
    bench.node.terminal.show = shown.extend
    bench.hears("m", at=AT)
    bench.hears(line, at=AT + SECOND)
    bench.hears("x5", at=AT + 2 * SECOND)
    bench.run()
    # The motor went on, and x5 was no line of a mode.
    assert bench.answers == [ACKED] * 3
    assert reports(bench) == [("ignored", packet_line(line), 0)]
    assert bench.position(bench.kernel.now) > 200
    assert shown == b""


@pytest.mark.parametrize(("line", "state"), [("$E", "STANDBY"), ("q", "CRUISE")])
def test_a_system_command_that_shows_something_ends_all_motion(line: str, state: str) -> None:
    bench = Bench()
    shown = bytearray()
    bench.node.terminal.show = shown.extend
    bench.hears("m", at=AT)
    bench.hears(line, at=AT + SECOND)
    assert bench.snapshot(AT + SECOND).state == state
    assert shown.endswith(b"\r\nSAC>")


# ---- messages -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "text"),
    [
        (" hello", "1:82> hello"),
        (".hello", "1:82> .hello"),
        (" m200", "1:82> m200"),
        (" 85m200", "1:82> 85m200"),
        (". ", "1:82> ."),
    ],
)
def test_text_is_for_the_terminal_and_never_executed(line: str, text: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ACKED]
    (report,) = bench.told()
    assert (report.kind, report.text) == (ReportKind.MESSAGE, text)
    assert bench.position(SECOND) == 0


def test_a_message_to_everybody_shows_that_it_was() -> None:
    bench = Bench()
    bench.sends(packet(" hello", GENERAL_CALL, 7), at=AT)
    bench.run()
    assert [report.text for report in bench.told()] == ["7:0> hello"]


# ---- sending on ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "to", "rest"),
    [
        ("85m200", 85, "m200"),
        ("085m200", 85, "m200"),
        ("0s", 0, "s"),
        ("85 hello", 85, " hello"),
        ("85.hi", 85, ".hi"),
        ("/m200", 7, "m200"),
        ("/ hi", 7, " hi"),
        ("/85m200", 7, "85m200"),
        ("85", 85, ""),
        ("/", 7, ""),
    ],
)
def test_a_line_with_an_address_is_sent_on_as_a_packet_of_the_nodes_own(
    line: str, to: int, rest: str
) -> None:
    bench = Bench()
    bench.sends(packet(line, NODE, 7), at=AT)
    bench.run()
    assert bench.answers == [ack(7, NODE), packet(rest, to, NODE)]
    assert bench.position(SECOND) == 0


def test_what_is_sent_on_is_printed_as_the_recorded_device_does() -> None:
    bench = Bench()
    shown = bytearray()
    bench.node.terminal.show = shown.extend
    bench.sends(packet("85hi", NODE, 7), at=AT)
    bench.run()
    assert shown == b"85> hi\r\nSAC>"


@pytest.mark.parametrize("line", [" 85m200", "-85m200"])
def test_a_space_or_a_minus_in_front_prevents_it(line: str) -> None:
    bench = Bench()
    bench.hears(line, at=AT)
    bench.run()
    assert bench.answers == [ACKED]


def test_an_address_above_255_keeps_its_low_8_bits_and_is_warned_of() -> None:
    bench = Bench()
    bench.hears("341m200", at=AT)
    bench.run()
    assert bench.answers == [ACKED, packet("m200", 85, NODE)]
    assert reports(bench) == [("warning", packet_line("341m200"), 1)]


def test_what_the_sender_sends_to_everybody_it_does_not_act_on_itself() -> None:
    bench = Bench(NODE, 10)
    bench.hears("0m200v100", at=AT)
    bench.run()
    assert bench.position(bench.kernel.now, NODE) == 0
    assert bench.position(bench.kernel.now, 10) == 200


def test_a_slash_in_a_broadcast_goes_to_the_last_who_spoke_to_the_node_alone() -> None:
    bench = Bench()
    bench.sends(packet("/a", GENERAL_CALL, 9), at=AT)
    bench.run()
    # Nobody has yet: it goes to everybody.
    assert bench.answers == [packet("a", GENERAL_CALL, NODE)]
    bench.sends(packet("v100", NODE, 7), at=bench.kernel.now + AT)
    bench.run()
    bench.sends(packet("/b", GENERAL_CALL, 9), at=bench.kernel.now + AT)
    bench.run()
    assert bench.answers[1:] == [ack(7, NODE), packet("b", 7, NODE)]


def test_two_nodes_that_send_each_other_on_come_to_an_end() -> None:
    bench = Bench(10, 11)
    bench.hears("11" + "/" * 10, at=AT, to=10)
    bench.run()
    bodies = [said.data[3:-3] for said in bench.heard if len(said.data) > 4]
    assert bodies == [b"/" * count for count in range(10, -1, -1)]
