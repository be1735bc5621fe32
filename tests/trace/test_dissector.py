"""The dissector in tshark tells what sacbus itself decoded, and when who answered whom."""

from __future__ import annotations

import random
import struct
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pytest

from nodes.sac import KIND
from sacbus.kernel import SECOND, LineRate
from sacbus.node import Said
from sacbus.trace.capture import Capture
from sacbus.trace.pcapng import interface, packet, section
from sacbus.watch import Collision, Entry, Spoken, Watch
from sacbus.wire import ack, crc8, encode
from tests.trace.session import capture_of, everything_said
from tests.trace.tshark import listed, needs_tshark, tshark
from tests.watch.rig import LINK, M400

pytestmark = [needs_tshark, pytest.mark.slow]

RATE = LineRate()
#: Of captures that begin with the IP header.
LINKTYPE_RAW = 101


def spoken(entries: list[Entry]) -> list[Spoken]:
    return [entry for entry in entries if isinstance(entry, Spoken)]


def raw_capture(frames: list[bytes], path: Path) -> Path:
    """Bytes alone, as another program's capture would have them."""
    capture = Capture()
    line = capture.line("wire", "sac", RATE)
    blocks = [packet(0, number * SECOND, data) for number, data in enumerate(frames)]
    path.write_bytes(capture.header + line.header + b"".join(blocks))
    return path


def test_all_that_is_said_in_a_session_is_told_as_sacbus_decoded_it(tmp_path: Path) -> None:
    entries = everything_said()
    kinds = {entry.said.kind for entry in spoken(entries)}
    verdicts = {entry.said.verdict for entry in spoken(entries)}
    assert kinds == {"packet", "ack", "nak", "garbage"}
    assert verdicts == {"right", "wrong", "unchecked", "no NUL", ""}
    garbage = {entry.said.words for entry in spoken(entries) if entry.said.kind == "garbage"}
    assert garbage == {"noise", "cut short", "too long", "unfinished"}
    expected: list[dict[str, str]] = []
    for entry in entries:
        match entry:
            case Spoken(said=said, sender=sender):
                expected.append(_told(said, sender or ""))
            case Collision(parts=parts):
                expected += [
                    _told(Said("collision", None, None, b"", "", "", 0), part.sender)
                    for part in parts
                ]
            case _:
                pass
    assert {"DC1", "DC2"} <= {one["sac.command"][-4:-1] for one in expected}
    assert listed(capture_of(entries, tmp_path), expected[0]) == expected


def _told(said: Said, sender: str) -> dict[str, str]:
    is_packet = said.kind == "packet"
    return {
        "_ws.col.Protocol": "SAC",
        "sac.type": said.kind,
        "sac.src": "" if said.source is None else str(said.source),
        "sac.dst": "" if said.destination is None else str(said.destination),
        "sac.broadcast": "1" if said.destination == 0 else "",
        "sac.body": said.data.decode("latin-1") if is_packet else "",
        "sac.command": said.words if is_packet else "",
        "sac.garbage": said.words if said.kind == "garbage" else "",
        "sac.crc.status": said.verdict,
        "sac.sender": sender,
    }


def test_every_answer_is_told_with_its_packet_and_the_monitors_delay(tmp_path: Path) -> None:
    entries = everything_said()
    frames: dict[int, int] = {}  # of entries, by their identity
    frame = 0
    for entry in entries:
        if isinstance(entry, Spoken):
            frame += 1
            frames[id(entry)] = frame
        elif isinstance(entry, Collision):
            frame += len(entry.parts)
    expected = dict.fromkeys(range(1, frame + 1), ("", ""))
    answered = {}
    for entry in spoken(entries):
        if entry.request is not None:
            assert entry.delay is not None  # a feed's times are exact
            time = f"{Decimal(entry.delay) / SECOND:.9f}"
            expected[frames[id(entry)]] = (str(frames[id(entry.request)]), time)
            answered[frames[id(entry.request)]] = (str(frames[id(entry)]), "")
    assert len(answered) > 10
    capture = capture_of(entries, tmp_path)
    fields = ("frame.number", "sac.response_to", "sac.response_in", "sac.response_time")
    told = listed(capture, fields)
    assert {
        int(one["frame.number"]): (one["sac.response_to"], one["sac.response_time"]) for one in told
    } == expected
    # Packets know their answers in the second pass, as in Wireshark's window.
    again = listed(capture, fields, more=("-2", "-Rsac"))
    assert {
        int(one["frame.number"]): (one["sac.response_in"], one["sac.response_time"])
        for one in again
        if one["sac.response_in"]
    } == answered


def test_what_is_wrong_is_expert_information(tmp_path: Path) -> None:
    entries = everything_said()
    capture = capture_of(entries, tmp_path)

    def frames(display_filter: str) -> int:
        return len(listed(capture, ["frame.number"], more=("-2", "-Rsac", "-Y", display_filter)))

    said = [entry.said for entry in spoken(entries)]
    assert frames("sac.expert.crc") == sum(one.verdict == "wrong" for one in said) > 0
    assert frames("sac.expert.no_nul") == sum(one.verdict == "no NUL" for one in said) > 0
    assert frames("sac.expert.nak") == sum(one.kind == "nak" for one in said) > 0
    assert frames("sac.expert.garbage") == sum(one.kind == "garbage" for one in said) > 0
    assert frames("sac.expert.collision") == 2
    stray = [one for one in spoken(entries) if one.said.kind in ("ack", "nak") and not one.request]
    assert frames("sac.expert.stray") == len(stray) > 0
    requests = {id(one.request) for one in spoken(entries) if one.request}
    silent = [
        one
        for one in spoken(entries)
        if one.said.kind == "packet" and one.said.destination != 0 and id(one) not in requests
    ]
    assert frames("sac.expert.no_answer") == len(silent) > 0
    assert frames('sac.crc.status == "wrong" && sac.dst == 10 && sac.body contains "m4"') == 1


def test_lines_that_are_sent_on_and_their_originals_know_each_other(tmp_path: Path) -> None:
    entries = [entry for entry in spoken(everything_said()) if b"V20" in entry.raw]
    assert [(one.said.source, one.said.destination, one.said.data) for one in entries] == [
        (1, 10, b"11V20"),
        (10, 11, b"V20"),
        (1, 10, b"/V20"),
        (10, 1, b"V20"),
    ]
    capture = capture_of([*entries], tmp_path)
    fields = ("sac.forward.to", "sac.forward.line", "sac.forward.in", "sac.forward.of")
    told = listed(capture, fields, more=("-2", "-Rsac"))
    assert [tuple(one.values()) for one in told] == [
        ("11", "V20", "2", ""),
        ("", "", "", "1"),
        ("", "V20", "4", ""),
        ("", "", "", "3"),
    ]


def test_messages_and_soft_ops_are_told_without_our_words(tmp_path: Path) -> None:
    frames = [
        encode(10, 1, b" hello"),
        encode(0, 10, b"\x11"),
        encode(0, 10, b"\x12"),
        encode(10, 1, b"m400"),
    ]
    capture = raw_capture(frames, tmp_path / "raw.pcapng")
    told = listed(capture, ("sac.message", "sac.soft_op", "sac.command", "_ws.col.Info"))
    assert [tuple(one.values()) for one in told] == [
        (" hello", "", "", " hello"),
        ("", "DC1, motion has begun", "", "DC1, motion has begun"),
        ("", "DC2, motion has ended", "", "DC2, motion has ended"),
        ("", "", "", "m400"),
    ]


def test_source_destination_and_words_stand_in_the_columns(tmp_path: Path) -> None:
    text = tshark("-r", capture_of(everything_said()[:2], tmp_path))
    assert [" ".join(line.split()) for line in text.splitlines()] == [
        "1 0.000000000 1 → 10 SAC 9 $O1: send soft ops in this session",
        "2 0.002728750 10 → 1 SAC 4 ACK after 385 us",
    ]


@pytest.mark.parametrize("seed", range(3))
def test_whatever_bytes_come_are_told_as_the_robust_receiver_takes_them(
    tmp_path: Path, seed: int
) -> None:
    chance = random.Random(seed)
    frames = [_frame(chance) for _ in range(1_000)]
    told = listed(
        raw_capture(frames, tmp_path / "raw.pcapng"),
        ("sac.type", "sac.dst", "sac.src", "sac.body", "sac.crc.status"),
    )
    for data, fields in zip(frames, told, strict=True):
        said = _decoded(data)
        assert fields == {
            "sac.type": ",".join(one.kind for one in said),
            "sac.dst": _listed(one.destination for one in said if one.source is not None),
            "sac.src": _listed(one.source for one in said if one.source is not None),
            # A string ends at a NUL, in Wireshark as in a device.
            "sac.body": ",".join(
                one.data.decode("latin-1").split("\0")[0] for one in said if one.kind == "packet"
            ),
            "sac.crc.status": ",".join(one.verdict for one in said if one.kind == "packet"),
        }, data.hex(" ")


def _frame(chance: random.Random) -> bytes:
    """Bytes of which many are, or nearly are, packets."""
    data = b""
    for _ in range(chance.randint(1, 4)):
        body = bytes(chance.choices(b"m132 v49", k=chance.choice((0, 1, 4, 6, 60, 248, 251))))
        whole = bytearray(
            chance.choice(
                (encode(10, 1, body), encode(3, 1, body, crc=False), ack(1, 10), b"\x02\x0a")
            )
        )
        for _ in range(chance.choice((0, 0, 1, 2))):
            whole[chance.randrange(len(whole))] = chance.choice(b"\x02\x03\x06\x15\x30")
        data += bytes(whole[: chance.choice((len(whole), len(whole), chance.randint(1, 9)))])
    return data


def _decoded(data: bytes) -> list[Said]:
    decoder = KIND.protocol.decoder()
    said = [KIND.protocol.tell(event) for event, _, _ in decoder.locate(data)]
    # A frame of the capture is all there is: what was waited for, a NUL but for noise, is missing.
    rest = decoder.pending
    if rest:
        ended = [one for one in KIND.protocol.decoder().locate(rest + b"U") if one[2] <= len(rest)]
        said += [KIND.protocol.tell(event) for event, _, _ in ended]
        rest = rest[max((end for _, _, end in ended), default=0) :]
    if rest:
        said.append(Said("garbage", None, None, rest, "", "", 0))
    return said


def _listed(addresses: object) -> str:
    assert isinstance(addresses, Iterator)
    return ",".join(map(str, addresses))


def test_the_crc_is_that_of_every_body(tmp_path: Path) -> None:
    bodies = [bytes((a, b)) for a in range(0x20, 0x7F) for b in (0x30, 0x6D, 0xB5)]
    frames = [encode(10, 1, body)[:-2] + bytes((crc8(body) ^ 0x80, 0)) for body in bodies]
    told = listed(raw_capture(frames, tmp_path / "raw.pcapng"), ("sac.crc.expected",))
    checked = [
        (int(one["sac.crc.expected"], 16), crc8(body))
        for one, body in zip(told, bodies, strict=True)
        if one["sac.crc.expected"]  # the others' wrong CRC is a control character
    ]
    assert len(checked) > 200
    assert all(told == ours for told, ours in checked)


def test_of_an_answer_whose_delay_nobody_knows_none_is_told(tmp_path: Path) -> None:
    watch = Watch(KIND.protocol, RATE)
    entries = watch.read(M400 + ack(1, 10), SECOND)  # in one read
    assert spoken(entries)[1].delay is None
    told = listed(capture_of(entries, tmp_path), ("sac.response_to", "sac.response_time"))
    assert [tuple(one.values()) for one in told] == [("", ""), ("1", "")]


def test_what_follows_lost_packets_answers_none_of_those_before(tmp_path: Path) -> None:
    capture = Capture()
    line = capture.line("wire", "sac", RATE)
    path = tmp_path / "lost.pcapng"
    path.write_bytes(
        capture.header
        + line.header
        + packet(0, 0, M400)
        + packet(0, 3_000_000, ack(1, 10), dropped=1)
    )
    assert [one["sac.response_to"] for one in listed(path, ["sac.response_to"])] == ["", ""]


def test_two_lines_in_a_capture_do_not_answer_each_other(tmp_path: Path) -> None:
    capture = Capture()
    lines = [capture.line(name, "sac", RATE) for name in ("left", "right")]
    path = tmp_path / "two.pcapng"
    path.write_bytes(
        capture.header
        + b"".join(line.header for line in lines)
        + packet(0, 0, M400)
        + packet(1, 1_000_000, M400)
        + packet(0, 3_000_000, ack(1, 10))
        + packet(1, 4_000_000, ack(1, 10))
    )
    assert [one["sac.response_to"] for one in listed(path, ["sac.response_to"])] == [
        "",
        "",
        "1",
        "2",
    ]


def test_an_answer_on_the_other_lane_of_a_line_is_its_answer(tmp_path: Path) -> None:
    capture = Capture()
    line = capture.line("wire", "sac", RATE, lanes=2)
    path = tmp_path / "lanes.pcapng"
    path.write_bytes(
        capture.header + line.header + packet(0, 0, M400) + packet(1, 3_000_000, ack(1, 10))
    )
    assert [one["sac.response_to"] for one in listed(path, ["sac.response_to"])] == ["", "1"]


def test_an_answer_that_comes_long_after_its_packet_answers_nothing(tmp_path: Path) -> None:
    path = raw_capture([M400, encode(11, 1, b""), b"\xff", ack(1, 10)], tmp_path / "late.pcapng")
    (*_, late) = listed(path, ["sac.response_to", "_ws.expert.message"])
    assert late == {
        "sac.response_to": "",
        "_ws.expert.message": "Answers nothing that was captured",
    }


def test_who_has_not_read_it_all_does_not_say_that_an_answer_is_missing(tmp_path: Path) -> None:
    capture = capture_of(everything_said()[:2], tmp_path)
    # With -2 alone, tshark 4.0 dissects only in its second pass.
    for more in ((), ("-2",)):
        told = listed(capture, ["sac.expert.no_answer"], more=more)
        assert [one["sac.expert.no_answer"] for one in told] == ["", ""]


def test_a_line_of_another_protocol_is_left_alone(tmp_path: Path) -> None:
    capture = Capture()
    line = capture.line("wire", "other", RATE)
    path = tmp_path / "other.pcapng"
    path.write_bytes(capture.header + line.header + packet(0, 0, M400))
    assert listed(path, ["sac.type"]) == [{"sac.type": ""}]
    assert LINK not in tshark("-r", path)


def _segment(sequence: int, payload: bytes) -> bytes:
    """IPv4 and TCP, without checks: from port 40000 to 7000."""
    tcp = struct.pack(">HHIIBBHHH", 40_000, 7_000, sequence, 1, 5 << 4, 0x18, 8_192, 0, 0)
    size = 20 + len(tcp) + len(payload)
    local = bytes((127, 0, 0, 1))
    ip = struct.pack(">BBHHHBBH4s4s", 0x45, 0, size, sequence, 0, 64, 6, 0, local, local)
    return ip + tcp + payload


def test_a_connection_to_a_bus_is_decoded_when_asked_for_however_it_is_split(
    tmp_path: Path,
) -> None:
    sent = M400 + b"\xff" + encode(11, 1, b"V100")
    path = tmp_path / "tcp.pcapng"
    pieces = ((0, 6), (6, 10), (10, 18), (18, len(sent)))
    path.write_bytes(
        section("test")
        + interface("lo", "IP", link_type=LINKTYPE_RAW, bits_per_second=0)
        + b"".join(packet(0, low, _segment(1 + low, sent[low:high])) for low, high in pieces)
    )
    fields = ("sac.type", "sac.body", "sac.crc.status")
    assert {one["sac.type"] for one in listed(path, fields)} == {""}
    told = listed(path, fields, more=("-d", "tcp.port==7000,sac"))
    assert [tuple(one.values()) for one in told] == [
        ("", "", ""),
        ("packet", "m400", "right"),
        ("garbage", "", ""),
        ("packet", "V100", "right"),
    ]
