"""What is read back, and what is no recording."""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import SECOND
from sacbus.trace import RecordingError, read
from sacbus.trace.records import Changed
from tests.trace.rig import recorded, two_axes


@pytest.fixture(scope="module")
def written() -> bytes:
    sink = BytesIO()
    recorded(two_axes, sink=sink)
    return sink.getvalue()


def test_its_head_says_what_was_recorded(written: bytes) -> None:
    recording = read(BytesIO(written))
    (bus,) = recording.buses
    assert (bus.name, bus.protocol, bus.rate.baud, bus.lanes) == ("bus", "sac", 38_400, 1)
    assert [(one.address, one.kind) for one in recording.nodes] == [(10, "sac"), (11, "sac")]


def test_a_file_and_its_path_are_the_same(written: bytes, tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(written)
    assert list(map(type, read(path))) == list(map(type, read(str(path))))
    assert read(path).track(10).position(SECOND) == read(BytesIO(written)).track(10).position(
        SECOND
    )


def test_packets_are_understood_and_have_their_times(written: bytes) -> None:
    recording = read(BytesIO(written))
    packets = list(recording.packets())
    first, answer = packets[:2]
    assert (first.said.source, first.said.destination, first.said.data) == (1, 10, b"m400v120")
    assert (answer.said.kind, answer.start) == ("ack", answer.sent.start)
    # The NUL behind it is its sender's last byte.
    assert (first.start, first.end) == (first.sent.start, first.sent.end)


def test_states_come_at_their_times_among_the_records(written: bytes) -> None:
    recording = read(BytesIO(written))
    events = list(recording.events())
    times = [one.when for one in events]
    assert times == sorted(times)
    for node in (10, 11):
        changed = [
            (one.when, one.state) for one in events if isinstance(one, Changed) and one.node == node
        ]
        assert changed == list(recording.track(node).states(0, recording.end + 1))
    words = [state for _, state in recording.track(10).states()]
    assert words[:6] == ["STANDBY", "STOP", "ACCEL", "CRUISE", "DECEL", "STANDBY"]
    assert words[6:9] == ["OFF", "BOOT", "STANDBY"]


@given(st.data())
def test_cut_off_anywhere_it_holds_what_is_whole(written: bytes, data: st.DataObject) -> None:
    head = written.index(b"\n") + 1
    size = data.draw(st.integers(head, len(written) - 1))
    recording = read(BytesIO(written[:size]))
    whole = list(read(BytesIO(written)))
    records = list(recording)
    assert [type(one) for one in records] == [type(one) for one in whole[: len(records)]]
    assert not recording.whole
    assert all(track.segments is not None for track in recording.tracks.values())


def test_one_that_was_closed_is_whole(written: bytes) -> None:
    recording = read(BytesIO(written))
    assert list(recording)
    assert recording.whole


def test_what_newer_versions_add_is_let_pass(written: bytes) -> None:
    added = written + b'{"t":9000000000,"bus":0,"is":"weather","sun":true}\n'
    assert len(list(read(BytesIO(added)))) == len(list(read(BytesIO(written))))


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "the recording: expected a recording of sacbus, it is empty"),
        (b"hello\n", "line 1: expected a recording of sacbus, got 'hello'"),
        (b'{"sacbus":"queue"}\n', "line 1: expected a recording of sacbus"),
        (b'{"sacbus":"recording","format":9}\n', "expected format 1, got 9: read it with"),
        (b'{"sacbus":"recording","format":1,"buses":[{}]}\n', "expected the buses of a recording"),
        (b"\xff\xfe\x00", "line 1: expected a recording of sacbus"),
    ],
)
def test_what_is_no_recording_is_refused_in_a_line(data: bytes, text: str) -> None:
    with pytest.raises(RecordingError, match=re.escape(text)):
        read(BytesIO(data))


@pytest.mark.parametrize(
    "line",
    [
        b"no json\n",
        b"[]\n",
        b'{"t":1,"bus":0,"is":"sent"}\n',
        b'{"t":1,"bus":7,"is":"sent","data":"02","start":0,"lane":0,"from":10}\n',
        b'{"t":1,"bus":0,"is":"moves","node":10,"shape":999}\n',
        b'{"t":1,"bus":0,"is":"shape","shape":0,"kind":"sac","board":{}}\n',
    ],
)
def test_a_line_that_is_none_is_named(written: bytes, line: bytes) -> None:
    lines = written.splitlines(keepends=True)
    recording = read(BytesIO(b"".join((*lines[:3], line, *lines[3:]))))
    with pytest.raises(RecordingError, match="line 4: expected a record, got"):
        list(recording)


def test_a_node_that_is_not_in_it_is_named(written: bytes) -> None:
    with pytest.raises(KeyError, match="no node 99 on bus 0"):
        read(BytesIO(written)).track(99)


@pytest.mark.parametrize(
    "damaged",
    [
        b"[" * 100_000,
        b'{"is":"end","t":"x","bus":0}',
        b'{"is":"end","t":-1,"bus":0}',
        b'{"is":"end","t":1,"bus":7}',
        b'{"is":"sent","t":1,"bus":0,"start":0,"lane":0,"from":[],"data":"00"}',
    ],
)
def test_a_line_that_is_damaged_is_one_line_to_the_user(written: bytes, damaged: bytes) -> None:
    head = written.splitlines(keepends=True)[0]
    recording = read(BytesIO(head + damaged + b"\n"))
    with pytest.raises(RecordingError, match=r"^the recording, line 2: expected a record, got "):
        list(recording)
