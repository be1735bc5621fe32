"""The terminal port: what is typed, what is shown, byte for byte; and that nothing can break it."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac.boot import VERSION_LINE
from sacbus.kernel import MS, SECOND
from sacbus.language import Mode, ShowQueue, ShowSession
from sacbus.language.queue_file import write_rows
from sacbus.node import ReportKind, Terminal
from sacbus.wire import GENERAL_CALL, ack
from tests.language.strategies import nearly_commands
from tests.nodes.sac.bench import NODE, Bench, packet
from tests.nodes.sac.console import Console, lines

DATA = Path(__file__).parents[2] / "data"

Vector = dict[str, Any]  # parsed JSON: its values are of any type


@pytest.fixture
def console() -> Console:
    return Console()


# ---- lines, echo, prompt ------------------------------------------------------------------------


def test_the_port_echoes_what_is_typed_and_prompts_when_the_line_is_done(console: Console) -> None:
    assert console.types("v1") == "v1"
    assert console.types("20\r") == "20\r\nSAC>"
    assert console.bench.node.snapshot(0).state == "STANDBY"
    assert console.types("vd\r") == lines("vd", "120 RPM  cycle 2500")


@pytest.mark.parametrize("end", ["\r", "\n", "\r\n"])
def test_cr_and_lf_and_both_together_are_one_end(console: Console, end: str) -> None:
    assert console.types(f"v7{end}v8{end}") == "v7\r\nSAC>v8\r\nSAC>"


@pytest.mark.parametrize(("ends", "count"), [("\r\r", 2), ("\n\n", 2), ("\n\r", 2), ("\r\n\n", 2)])
def test_other_ends_in_a_row_are_empty_lines(console: Console, ends: str, count: int) -> None:
    assert console.types(ends) == "\r\nSAC>" * count


def test_the_lf_of_an_end_may_come_much_later(console: Console) -> None:
    console.types("v7\r")
    assert console.types("\n") == ""
    assert console.types("\n") == "\r\nSAC>"


def test_a_line_of_39_characters_is_taken(console: Console) -> None:
    line = "v7".ljust(39)
    assert console.types(line + "\r") == line + "\r\nSAC>"
    assert console.types("vd\r") == lines("vd", "7 RPM  cycle 42857")


def test_the_40th_character_is_too_many(console: Console) -> None:
    line = "v7".ljust(39)
    # No key takes back what is too much: nobody would know what was left.
    assert console.types(line + " more\b\x7f\r") == line + "\r\n2big.\r\nSAC>"
    assert console.types("vd\r") == lines("vd", "100 RPM  cycle 3000")


@pytest.mark.parametrize("key", ["\b", "\x7f"])
def test_backspace_takes_the_last_character_back(console: Console, key: str) -> None:
    rubbed = "\b \b"
    assert console.types(f"v12{key}{key}7\r") == f"v12{rubbed}{rubbed}7\r\nSAC>"
    assert console.types("vd\r") == lines("vd", "7 RPM  cycle 42857")
    assert console.types(key) == ""


def test_what_is_printed_while_nobody_is_there_is_lost(console: Console) -> None:
    console.terminal.show = None
    console.terminal.type(b"v7\rq\rvd", console.bench.kernel.now)
    console.terminal.show = console.shown.extend
    assert console.types("\r") == "\r\n7 RPM  cycle 42857\r\nSAC>"
    (report,) = console.bench.told()
    assert (report.kind, report.line) == (ReportKind.IGNORED, "q")


def test_a_node_has_no_port_before_somebody_asks_for_it() -> None:
    bench = Bench()
    bench.hears(" hello", at=20 * MS)
    assert bench.node.board.terminal_port is None
    terminal: Terminal = bench.node.terminal
    assert bench.node.terminal is terminal


# ---- single pulses ------------------------------------------------------------------------------


def test_signs_act_at_once(console: Console) -> None:
    assert console.types("+") == "+"
    assert console.bench.node.snapshot(0).position_pulses == 1
    assert console.types("++-") == "++-"
    assert console.bench.node.snapshot(0).position_pulses == 2
    # They are no part of the line behind them.
    assert console.types("v7\r") == "v7\r\nSAC>"
    assert console.types("\r--\r") == "\r\nSAC>--\r\nSAC>"
    assert console.bench.node.snapshot(0).position_pulses == 0
    assert console.bench.told() == []


def test_a_sign_within_a_line_or_in_a_mode_is_a_character(console: Console) -> None:
    console.types("m-")
    assert console.bench.node.snapshot(0).position_pulses == 0
    console.types("\x7f\x7f\rqp\r")
    console.types("+")
    assert console.bench.told() == []
    console.types("8\r")
    assert console.bench.node.snapshot(0).position_pulses == 0
    assert [report.line for report in console.bench.told()] == ["+8"]


# ---- the manual's own sessions ------------------------------------------------------------------


def test_a_cycle_is_shown_with_its_rpm(console: Console) -> None:
    """Manual, "V"."""
    console.types("vc42567\r")
    assert console.types("vd\r") == lines("vd", "7 RPM  cycle 42567")
    console.types("vc4567\r")
    assert console.types("vd\r") == lines("vd", "65 RPM  cycle 4567")
    console.types("v65\rm1\r")
    assert (console.queue().rows[0].motion.rpm, console.queue().rows[0].motion.cycle_us) == (
        65,
        4615,
    )


def test_the_manuals_queue_edit_is_shown_as_the_manual_shows_it(console: Console) -> None:
    """Manual, Appendix E, "Incoming"."""
    line = "q9m-2000vc1500a1d1l0pu0s0t0"
    assert console.types(line + "\r") == line + "\r\nSAC>"
    shown = console.types("q\r").split("\r\n")
    assert shown[:3] == ["q", "Q\tSteps\t\tRPM\tCycle\tAcc\tDec\tusteps\tdeltaT", "====="]
    assert shown[11] == "9\t2000\t+CCW\t200\t1500\t1.00\t1.00\t0\t0"
    assert shown[33:] == ["=====", "Q is at 1  + pulse  * linear  s sync", "SAC>"]


def test_a_whole_queue_is_typed_and_shown(console: Console) -> None:
    """The companion's file, as edits of the queue."""
    rows = (DATA / "companion-queue.txt").read_bytes().decode().splitlines(keepends=True)
    for row in rows:
        cells = [cell.strip() for cell in row.split(",")]
        position, steps, ccw, full, _, cycle, linear, acc, dec, extra, sync, wait = cells
        console.types(
            f"q{position}m{'-' * int(ccw)}{steps}{'pf'[int(full)]}vc{cycle}l{linear}\r"
            f"q{position}a{acc}d{dec}u{extra}s{sync}t{wait}\r"
        )
    assert list(write_rows(console.queue().rows)) == rows


def test_the_manuals_xref_array_is_shown_after_each_entry(console: Console) -> None:
    """Manual, "xRef"."""
    assert console.types("xp\r") == lines("xp", "x_ 0 0")
    assert console.types("0,1\r") == lines("0,1", "x_ 0 1")
    for entry in ("1,3", "2,7", "3,5"):
        console.types(entry + "\r")
    picture = ["x_ 0 1", "x_ 1 3", "x_ 2 7", "x_ 3 5", "x_ 4 0"]
    assert console.types("4,0\r") == lines("4,0", *picture)
    assert console.types("x\r") == lines("x")
    assert console.types("XD\r") == lines("XD", *picture)


def test_the_queue_is_edited_in_its_program_mode(console: Console) -> None:
    """Manual, "Queue"."""
    before = console.types("q\r")
    assert console.types("qp\r") == "qp" + before[1:]
    shown = console.types("8m2000\r")
    assert shown.startswith("8m2000\r\nQ\tSteps")
    assert "\r\n8\t2000\tCW\t" in shown
    assert console.types("\r") == lines("")
    assert console.types("m2000\r") == lines("m2000")
    assert [report.line for report in console.bench.told()] == ["m2000"]
    assert console.types("S\r") == lines("S")
    assert console.types("x\r") == lines("x")
    assert console.mode is Mode.PROMPT
    assert [row.position for row in console.queue().rows if row.motion.steps == 2000] == [8]


def test_the_configure_screen_is_entered_and_left(console: Console) -> None:
    """Manual, "Configure Menu": the prompt stands right below it."""
    screen = console.types("$C\r")
    assert screen.startswith("$C\r\nConfig:\r\nA autorun      0      a sprf          200\r\n")
    assert "\r\nM d_id         82     m hw            38400\r\n" in screen
    assert screen.endswith("\r\nN r_id         0      n sw            38400\r\nSAC>")
    assert console.types("X\r") == lines("X")
    assert console.types("cc\r")[2:] == screen[2:]


MODES = [("qp", Mode.QUEUE), ("xp", Mode.REFERENCES), ("$C", Mode.CONFIGURE)]


@pytest.mark.parametrize(("opens", "mode"), MODES)
def test_s_stops_the_motor_in_every_mode_and_an_empty_line_does_nothing(
    console: Console, opens: str, mode: Mode
) -> None:
    bench = console.bench
    console.types(f"{opens}\r")
    for line, state in (("S", "STANDBY"), ("s", "DECEL")):
        bench.hears("m", at=bench.kernel.now + SECOND)
        console.until(bench.kernel.now + 5 * SECOND)
        assert console.types("\r") == lines("")
        assert bench.snapshot(bench.kernel.now).state == "CRUISE"
        assert console.types(f"{line}\r") == lines(line)
        assert bench.snapshot(bench.kernel.now).state == state
    assert console.mode is mode
    assert console.types("x\r") == lines("x")
    assert console.mode is Mode.PROMPT
    assert bench.told() == []


def test_system_commands_that_show_something_end_all_motion(console: Console) -> None:
    for line in ("$C\rX\r", "$E\r"):
        console.types("m\r")
        assert console.bench.snapshot(console.bench.kernel.now).state == "ACCEL"
        console.types(line)
        assert console.bench.snapshot(console.bench.kernel.now).state == "STANDBY"


def test_session_flags_are_shown(console: Console) -> None:
    shown = console.types("g\rv7\rcf\r").split("\r\n")
    assert "GAP            0" in shown
    assert "RPM            7" in shown
    assert "encoder        EnF" in shown


def test_debug_shows_the_hidden_positions_timings_and_a_dump(console: Console) -> None:
    console.types("b\r")
    # 5 characters at 38 400 baud, and 16 us; 8, and 40 us where the ramps change.
    assert console.types("m200\r") == lines("m200", "1318 us")
    assert console.types("xm40a2d\r") == lines("xm40a2d", "2123 us")
    assert console.types("mv120\r") == lines("mv120", "1578 us")
    assert console.types("vd\r") == lines("vd", "100 RPM  cycle 3000")
    rows = console.queue().rows
    assert [row.position for row in rows] == list(range(32))
    assert (rows[0].motion.steps, rows[0].motion.rpm) == (None, 120)
    assert (rows[31].motion.steps, rows[31].motion.acc100) == (40, 200)
    dump = console.types("$E\r").split("\r\n")
    assert len(dump) == 66
    assert dump[1].startswith("0000  00 00 01 ")
    console.types("b\r")
    assert console.types("m200\r") == lines("m200")
    assert console.types("$E\r").startswith("$E\r\nEEPROM:\r\nA autorun      0\r\n")


# ---- the network --------------------------------------------------------------------------------


def typed_vectors() -> list[Vector]:
    text = (DATA / "wire-vectors.jsonl").read_text(encoding="utf-8")
    return [vector for vector in map(json.loads, text.splitlines()) if "typed" in vector]


@pytest.mark.parametrize("vector", typed_vectors(), ids=lambda vector: str(vector["name"]))
def test_a_typed_line_goes_where_the_recorded_device_sent_it(vector: Vector) -> None:
    console = Console()
    typed = vector["typed"]
    shown = console.types(typed)
    assert b"".join(console.bench.answers).hex() == vector["tx_hex"]
    echo = typed[:39].removesuffix("\n") + "\r\n"
    recorded = vector["terminal"].replace("\r\n", "\n").replace("\n", "\r\n")
    if vector["name"] == "send_hello":  # to the firmware a text to itself, to a SAC no command
        recorded = ""
    assert shown == echo + recorded + "SAC>"


def test_who_types_for_everybody_does_not_act_on_it() -> None:
    console = Console(NODE, 10)
    console.types("0m200\r")
    console.bench.run()
    now = console.bench.kernel.now
    assert console.bench.position(now, NODE) == 0
    assert console.bench.position(now, 10) == 200


def test_addresses_above_255_keep_their_low_8_bits(console: Console) -> None:
    assert console.types("341m1\r") == lines("341m1", "85> m1")
    assert console.bench.answers == [packet("m1", 85, NODE)]


def test_nodes_talk_to_each_other() -> None:
    """Manual, "Communications": `85 hello`, and `/` to answer."""
    bench = Bench(82, 85)
    shown = {address: bytearray() for address in bench.nodes}
    for address, node in bench.nodes.items():
        node.terminal.show = shown[address].extend
    for address, line in (
        (82, b"85 hello\r"),
        (85, b"/ reply\r"),
        (85, b"/.dot\r"),
        (85, b"/v7\r"),
    ):
        bench.nodes[address].terminal.type(line, bench.kernel.now)
        bench.bus.touch(bench.nodes[address])
        # A device that has answered is deaf for a while.
        bench.kernel.run_until(bench.kernel.now + 20 * MS)
    bench.nodes[82].terminal.type(b"vd\r", bench.kernel.now)
    assert shown[82].decode() == (
        "85 hello\r\n85>  hello\r\nSAC>"
        "\r\n85:82> reply\r\nSAC>"
        "\r\n85:82> .dot\r\nSAC>"
        "vd\r\n7 RPM  cycle 42857\r\nSAC>"
    )
    assert shown[85].decode() == (
        "82:85> hello\r\nSAC>"
        "/ reply\r\n82>  reply\r\nSAC>"
        "/.dot\r\n82> .dot\r\nSAC>"
        "/v7\r\n82> v7\r\nSAC>"
    )


def test_what_comes_while_a_line_is_typed_stands_above_it(console: Console) -> None:
    console.types("v1")
    console.bench.sends(packet(" hello", GENERAL_CALL, 7), at=console.bench.kernel.now)
    shown = console.types("7\r")
    assert shown == "7\r\nSAC>\r\n7:0> hello\r\nSAC>"
    console.types("85hel")
    console.bench.sends(packet("v5", NODE, 7), at=console.bench.kernel.now)
    console.bench.run()
    assert console.types("lo\r") == lines("lo", "85> hello")
    console.types("ab")
    begin = len(console.shown)
    console.bench.sends(packet("vd", NODE, 7), at=console.bench.kernel.now)
    console.bench.run()
    assert bytes(console.shown[begin:]) == b"\r\n5 RPM  cycle 60000\r\nSAC>ab"


def test_a_query_from_the_network_is_answered_on_the_terminal_alone(console: Console) -> None:
    bench = console.bench
    at_the_terminal = console.types("q\r")
    begin = len(console.shown)
    bench.hears("q", at=SECOND)
    bench.run()
    assert console.shown[begin:].decode() == at_the_terminal[1:]
    assert bench.answers == [ack(1, NODE)]
    assert bench.told() == []


def test_text_that_is_typed_without_an_address_goes_nowhere(console: Console) -> None:
    console.types(" hello\r.hello\r")
    assert console.bench.answers == []
    assert [(one.kind, one.line) for one in console.bench.told()] == [
        (ReportKind.IGNORED, " hello"),
        (ReportKind.IGNORED, ".hello"),
    ]


# ---- boots and settings -------------------------------------------------------------------------


def test_a_warm_boot_shows_one_prompt_and_drops_what_was_typed(console: Console) -> None:
    assert console.types("$R\r") == lines("$R")
    console.types("qp\r8m")
    begin = len(console.shown)
    console.bench.hears("$R", at=SECOND)
    console.bench.run()
    assert console.shown[begin:] == b"\r\nSAC>"
    assert console.mode is Mode.PROMPT
    assert console.types("vd\r") == lines("vd", "100 RPM  cycle 3000")


def test_a_cold_boot_shows_its_version_waits_a_second_and_prompts(console: Console) -> None:
    node, kernel = console.bench.node, console.bench.kernel
    console.types("$CL20\rv1")
    begin = len(console.shown)
    for on in (False, True):
        node.power(on=on, now=kernel.now)
        console.bench.bus.touch(node)
        assert console.types("") == ""
    assert console.shown[begin:].decode() == f"\r\n{VERSION_LINE}\r\n"
    kernel.run_until(kernel.now + SECOND)
    assert console.shown[begin:].decode() == f"\r\n{VERSION_LINE}\r\nSAC>"
    # No key has come, so its memory is what it was.
    assert "\r\nL slow         20\r\n" in console.types("cc\r")
    assert console.types("vd\r") == lines("vd", "100 RPM  cycle 3000")


def test_a_key_within_the_second_restores_the_factorys_memory_and_is_no_more_than_that(
    console: Console,
) -> None:
    console.types("$CA14\r")
    node = console.bench.node
    for on in (False, True):
        node.power(on=on, now=console.bench.kernel.now)
    console.bench.bus.touch(node)
    begin = len(console.shown)
    console.types("+")
    console.bench.run()
    assert console.shown[begin:] == b"SAC>"
    assert node.snapshot(0).position_pulses == 0
    assert "A autorun      0 " in console.types("cc\r")


def test_settings_of_the_session_show_on_its_screen(console: Console) -> None:
    shown = console.types("$n\r$O1\r$K0\r$H0\r$L1\r$P\rcf\r").split("\r\n")
    for row in ("encoder        EnT", "soft_ops       1", "ACK            0", "CRC            0"):
        assert row in shown
    for row in ("acc            10.47", "ramp           1", "full step      0"):
        assert row in shown


def test_the_configure_screen_is_shown_again_with_what_was_entered(console: Console) -> None:
    console.types("$C\r")
    shown = console.types("A14\r")
    assert shown.startswith("A14\r\nConfig:\r\nA autorun      14     a sprf          200\r\n")
    assert console.types("U23\r").startswith("U23\r\nConfig:\r\n")
    assert console.types("G2\rX\r").count("Config:") == 1
    assert "\r\nU pins         000 001 011 011 100 101 110 111\r\n" in console.types("$E\r")
    assert "\r\nG dir          CCW    g" in console.types("cc\r")


def test_the_dump_has_the_queue_that_was_saved(console: Console) -> None:
    console.types("b\r")
    before = console.types("$E\r").split("\r\n")
    console.types("q1m600vc6000s\rqs\r")
    after = console.types("$E\r").split("\r\n")
    assert before[4] == "0030  96 00 00 00 00 01 02 03 04 05 06 07 FF FF FF FF"
    # Position 1: held for sync, 600 steps.
    assert after[4] == "0030  96 00 00 00 00 01 02 03 04 05 06 07 08 58 02 00"


# ---- anything at all ----------------------------------------------------------------------------

keys = st.binary(max_size=60) | st.lists(
    st.one_of(
        nearly_commands.map(lambda line: line.encode("latin-1", "replace")),
        st.sampled_from([b"qp", b"xp", b"$C", b"x", b"8m2000", b"0,3", b"+", b"\b", b"", b"b"]),
    ),
    max_size=8,
).map(b"\r\n".join)


def outcome(chunks: list[bytes]) -> object:
    console = Console()
    for chunk in chunks:
        console.terminal.type(chunk, 0)
    console.bench.bus.touch(console.bench.node)
    console.bench.kernel.run_until(5 * SECOND)
    screens = [console.bench.node.board.answer(query) for query in (ShowQueue(), ShowSession())]
    return bytes(console.shown), console.bench.transcript(), screens


@given(keys, st.data())
def test_any_keys_do_the_same_however_they_are_cut_up(typed: bytes, data: st.DataObject) -> None:
    cuts = sorted(data.draw(st.lists(st.integers(0, len(typed)), max_size=5)))
    edges = [0, *cuts, len(typed)]
    chunks = [typed[begin:end] for begin, end in pairwise(edges)]
    assert outcome(chunks) == outcome([typed])


@given(st.lists(keys, max_size=4), st.lists(st.binary(max_size=46), max_size=4))
def test_nothing_that_is_typed_or_sent_raises(typed: list[bytes], sent: list[bytes]) -> None:
    console = Console()
    node = console.bench.node
    for turn in range(max(len(typed), len(sent))):
        for line in typed[turn : turn + 1]:
            console.types(line)
        for body in sent[turn : turn + 1]:
            node.board.messages.network_line(body, 7, NODE, console.bench.kernel.now)
            console.bench.bus.touch(node)
    assert console.types(b"\r\rX\r\r").endswith("SAC>")
    assert console.mode is Mode.PROMPT
