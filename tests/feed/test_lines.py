"""The feed's format: what is written is read again, and what is no feed is said to be none."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.feed import Hello, Line, Missed, Reached, Sent, Stopped, Way, decode, encode
from sacbus.node import Report, ReportKind

times = st.integers(0, 10**15)
HELLO = Hello(
    version="0.1.0",
    bus="bench",
    protocol="sac",
    baud=38_400,
    bits=10,
    lanes=1,
    speed=1.0,
    nodes=((10, "sac"), (11, "sac")),
    links=(Way("pty", "/run/sac", "/dev/pts/7"), Way("tcp", "socket://127.0.0.1:7000", None)),
    time=12,
    clock=1_700_000_000_000_000_000,
)
lines: st.SearchStrategy[Line] = st.one_of(
    st.just(HELLO),
    st.builds(
        Sent,
        times,
        times,
        st.integers(0, 1),
        st.text(),
        st.none() | st.integers(4, 255),
        st.binary(),
        st.lists(st.tuples(times, times)).map(tuple),
        st.none() | st.lists(st.integers(0, 1)).map(bytes),
        st.lists(st.text()).map(tuple),
        st.none() | st.binary(),
    ),
    st.builds(
        Report,
        times,
        st.none() | st.integers(0, 255),
        st.sampled_from(ReportKind),
        st.text(),
        st.text(),
        st.integers(0, 80),
    ),
    st.builds(Reached, times, times),
    st.builds(Missed, st.integers(1, 9)),
    st.just(Stopped()),
)


@given(lines)
def test_what_is_written_is_read_again_from_one_line(line: Line) -> None:
    text = encode(line, "bench")
    assert text.count(b"\n") == 1
    assert text.endswith(b"\n")
    assert decode(text) == line


def test_a_transmission_is_told_as_documented() -> None:
    plain = encode(Sent(5, 1_041_671, 0, "node 10", 10, bytes.fromhex("02010a06")), "bench")
    assert json.loads(plain) == {
        "event": "transmission",
        "start_ns": 5,
        "end_ns": 1_041_671,
        "lane": 0,
        "sender": "node 10",
        "node": 10,
        "collided": False,
        "data": "02010a06",
    }
    hit = encode(Sent(5, 9, 0, "/run/sac", None, b"\x41", ((6, 7),), b"\1"), "bench")
    fields = json.loads(hit)
    assert (fields["collided"], fields["hits_ns"], fields["ninth"]) == (True, [[6, 7]], "1")
    lost = encode(Sent(5, 9, 0, "a", None, b"", faults=("drop", "delay"), sent=b"\x41"), "bench")
    fields = json.loads(lost)
    assert (fields["data"], fields["sent"], fields["faults"]) == ("", "41", ["drop", "delay"])


def test_a_report_is_told_as_serve_prints_it() -> None:
    report = Report(2_343_750, 11, ReportKind.REFUSED, "no such command", "?4", 1)
    assert json.loads(encode(report, "bench")) == {
        "event": "report",
        "bus": "bench",
        "time_us": 2343.75,
        "node": 11,
        "what": "refused",
        "line": "?4",
        "column": 1,
        "text": "no such command",
    }


def test_fields_and_events_that_are_not_known_are_let_pass() -> None:
    fields = json.loads(encode(Reached(5, 6), "bench")) | {"mood": "good"}
    assert decode(json.dumps(fields).encode()) == Reached(5, 6)
    assert decode(b'{"event":"weather"}') is None


@pytest.mark.parametrize(
    "text",
    [b"", b"\xff", b"hello", b"[]", b"7", b"{}", b'{"event":"transmission"}', b'{"event":"time"'],
)
def test_what_is_no_line_of_a_feed_is_said_to_be_none(text: bytes) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 (that it is one is the contract)
        decode(text)


def test_a_format_that_is_not_ours_is_refused_with_its_number() -> None:
    fields = json.loads(encode(HELLO, "bench")) | {"format": 2}
    with pytest.raises(ValueError, match="a feed of format 2, this version reads 1"):
        decode(json.dumps(fields).encode())
