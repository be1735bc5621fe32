"""Lines of text that stay aligned, and JSON with the fields that are promised."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from hypothesis import given

from nodes.superstepper import KIND as SUPER_STEPPER
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.monitor.page import JsonPage, TextPage
from sacbus.watch.entries import Collision, Entry, Lost, Spoken, Unanswered, concerns
from sacbus.wire import ack, encode, nak
from sacbus.wire.superstepper import Answer, Read, encode_answer
from sacbus.wire.superstepper import encode as encode_message
from sacbus.wire.superstepper_receivers import AnswerReceiver
from tests.bus.strategies import bursts
from tests.watch.rig import M400, Rig


def scene() -> list[Entry]:
    rig = Rig(10)
    rig.says(M400, at=5 * MS)
    rig.says(M400[:-2] + b"\x55\x00", at=20 * MS)
    rig.says(encode(99, 1, b"m400", crc=False), at=40 * MS)
    rig.says(M400 + M400, at=100 * MS)
    rig.says(b"hello\x07", at=200 * MS)
    rig.says(encode(0, 1, b""), at=300 * MS)
    rig.stranger_says(ack(1, 12), at=320 * MS)
    rig.says(encode(200, 1, b"m1"), at=12_345 * SECOND)
    rig.stranger_says(nak(1, 200), at=12_346 * SECOND)
    return [*rig.run(13_000 * SECOND), Lost(3)]


SCENE = scene()


def test_every_kind_of_entry_has_its_line_and_all_are_aligned() -> None:
    page = TextPage()
    (collision,) = (one for one in SCENE if isinstance(one, Collision))
    spoilt = " / ".join(f"{one.sender}: {one.raw.hex(' ')}" for one in collision.parts)
    report = "node 10: lost: a packet from 1 with a wrong CRC; it gets a NAK"
    lines = [page.heading(), *(page.line(one) for one in SCENE)]
    assert lines == [
        "      time s     silence s  from    to  CRC     says",
        "    0.005000                  1 -> 10   ok      m400: move 400 full steps",
        "    0.007989     +0.000385   10 -> 1            ACK after 385 us",
        "    0.020000     +0.010969    1 -> 10   WRONG   m400: move 400 full steps",
        f"    0.022343                                    {report}",
        "    0.022989     +0.000385   10 -> 1            NAK after 385 us",
        "    0.040000     +0.015969    1 -> 99   no CRC  m400: move 400 full steps",
        "    0.054812                  1 -> 99           no answer to m400",
        "    0.100000     +0.057656    1 -> 10   ok      m400: move 400 full steps",
        f"    0.102989     +0.000385                      collision of {spoilt}",
        "    0.115072                  1 -> 10           no answer to m400",
        "    0.200000     +0.095969                      noise, 6 bytes: 68 65 6c 6c 6f 07",
        "    0.300000     +0.098437    1 -> all  ok      empty line",
        "    0.320000     +0.018437   12 -> 1            ACK to nothing that was heard",
        "12345.000000 +12344.678958    1 -> 200  ok      m1: move 1 full step",
        "12345.014551                  1 -> 200          no answer to m1",
        "12346.000000     +0.997916  200 -> 1            NAK after 997916 us, too late",
        "… 3 lines of the feed were not read in time and are missing here",
    ]


def test_who_wants_to_know_more_gets_senders_and_bytes() -> None:
    page = TextPage(verbose=True)
    assert page.line(SCENE[0]).endswith(f"full steps  [/run/sac: {M400.hex(' ')}]")
    assert page.line(SCENE[1]).endswith("385 us  [node 10: 02 01 0a 06]")


def test_what_is_said_reaches_no_terminal_as_control_characters() -> None:
    rig = Rig(10)
    rig.says(encode(10, 1, b" \x1b[2J\x07\xff"), at=0)
    lines = [TextPage(verbose=True).line(one) for one in rig.run()]
    assert "\\x1b[2J\\x07ÿ" in lines[0]
    assert not any(character < " " for line in lines for character in line)


def test_garbage_is_shown_as_far_as_it_fits() -> None:
    rig = Rig()
    rig.says(b"\x55" * 100, at=0)
    (noise,) = rig.run(SECOND)
    assert TextPage().line(noise).endswith(f"noise, 100 bytes: {'55 ' * 24}… and 76 more")


def test_colours_are_for_who_asks_for_them() -> None:
    page = TextPage(colour=True)
    lines = [page.line(one) for one in SCENE]
    assert "\x1b" not in lines[0]
    assert lines[1].startswith("\x1b[32m")
    assert lines[1].endswith("\x1b[0m")
    assert lines[2].startswith("\x1b[31m")
    plain = TextPage()
    assert not any("\x1b" in plain.line(one) for one in SCENE)


def clock(time: Ns) -> datetime:
    return datetime(2024, 2, 29, 23, 59, 59, tzinfo=UTC) + timedelta(microseconds=time // US)


def test_the_time_of_day_stands_in_the_place_of_seconds() -> None:
    page = TextPage(clock=clock)
    assert page.line(SCENE[1]).startswith("23:59:59.007989     +0.000385   10 -> 1  ")
    assert page.heading().index("CRC") == page.line(SCENE[0]).index("ok")


def fields(entry: Entry, page: JsonPage | None = None) -> dict[str, Any]:
    text = (page or JsonPage()).line(entry)
    assert "\n" not in text
    found = json.loads(text)
    assert isinstance(found, dict)
    return found


def test_a_packet_and_its_answer_as_json() -> None:
    assert fields(SCENE[0]) == {
        "event": "packet",
        "start_ns": 5_000_000,
        "end_ns": 7_604_166,
        "gap_ns": None,
        "lane": 0,
        "sender": "/run/sac",
        "source": 1,
        "destination": 10,
        "body": "m400",
        "words": "move 400 full steps",
        "verdict": "right",
        "bytes": M400.hex(),
    }
    assert fields(SCENE[1]) == {
        "event": "ack",
        "start_ns": 7_989_166,
        "end_ns": 9_030_832,
        "gap_ns": 385_000,
        "lane": 0,
        "sender": "node 10",
        "source": 10,
        "destination": 1,
        "request_ns": 5_000_000,
        "delay_ns": 385_000,
        "late": False,
        "bytes": "02010a06",
    }


def test_faults_and_reports_as_json() -> None:
    found = [fields(one) for one in SCENE]
    by_event = {one["event"]: one for one in reversed(found)}
    assert by_event["no answer"] == {
        "event": "no answer",
        "start_ns": 54_812_083,
        "source": 1,
        "destination": 99,
        "body": "m400",
        "request_ns": 40_000_000,
    }
    assert by_event["garbage"] == {
        "event": "garbage",
        "start_ns": 200_000_000,
        "end_ns": 201_562_500,
        "gap_ns": 95_969_168,
        "lane": 0,
        "sender": "/run/sac",
        "words": "noise",
        "bytes": b"hello\x07".hex(),
    }
    collision = by_event["collision"]
    assert collision["gap_ns"] == 385_000
    assert [one["sender"] for one in collision["senders"]] == ["/run/sac", "node 10"]
    assert [one["node"] for one in collision["senders"]] == [None, 10]
    assert len(bytes.fromhex(collision["senders"][0]["bytes"])) == 20
    assert by_event["missed"] == {"event": "missed", "lines": 3}
    assert (found[-2]["event"], found[-2]["late"]) == ("nak", True)


def test_a_report_is_named_as_serve_names_it() -> None:
    page = JsonPage()
    page.bus = "bench"
    report = fields(SCENE[3], page)
    assert report == {
        "event": "report",
        "start_ns": 22_343_750,
        "bus": "bench",
        "node": 10,
        "what": "lost",
        "line": "",
        "column": 0,
        "text": "a packet from 1 with a wrong CRC; it gets a NAK",
    }


def test_json_has_the_time_of_day_beside_the_other() -> None:
    found = fields(SCENE[1], JsonPage(clock=clock))
    assert datetime.fromisoformat(found["clock"]) == clock(7_989_166)
    assert found["start_ns"] == 7_989_166


@pytest.mark.parametrize("verbose", [False, True])
@given(data=bursts)
def test_whatever_is_said_has_a_line(data: bytes, verbose: bool) -> None:
    rig = Rig(10)
    rig.says(data, at=0)
    for entry in [*rig.run(5 * SECOND), *rig.watch.end(5 * SECOND)]:
        assert TextPage(verbose=verbose).line(entry).isprintable()
        assert json.loads(JsonPage().line(entry))["event"]


def test_a_master_without_an_address_and_a_body_that_is_no_text() -> None:
    read = SUPER_STEPPER.protocol.decoder().receive(encode_message(0, Read(6)))
    said = SUPER_STEPPER.protocol.tell(read[0])
    asked = Spoken(0, MS, None, 0, "master", said, b"\x07\x00\x06")
    assert TextPage().line(asked).endswith("- -> 0            00 06: read the byte at RAM 0x06")
    fields = json.loads(JsonPage().line(asked))
    assert (fields["source"], fields["destination"], fields["body"]) == (None, 0, "00 06")
    answer = AnswerReceiver().receive(encode_answer(Answer(0, value=7)))
    said = SUPER_STEPPER.protocol.tell(answer[0])
    answered = Spoken(MS, 2 * MS, None, 1, "node 0", said, b"", asked, 100 * US)
    assert TextPage().line(answered).endswith("0 -> -    ok      ACK 7 after 100 us")
    fields = json.loads(JsonPage().line(answered))
    assert (fields["source"], fields["destination"]) == (0, None)
    fields = json.loads(JsonPage().line(Unanswered(MS, asked)))
    assert (fields["source"], fields["body"]) == (None, "00 06")
    # Address 0 is a module there, not everybody.
    assert not concerns(asked, {5})
