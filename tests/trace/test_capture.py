"""Entries as blocks: what of an entry goes where."""

from __future__ import annotations

from sacbus import __version__
from sacbus.kernel import MS, SECOND, LineRate
from sacbus.node import Report, ReportKind
from sacbus.trace.capture import Capture
from sacbus.watch import Collision, Lost, Part, Reported, Spoken, Unanswered
from sacbus.wire import ack
from tests.trace.captured import interfaces_of, packets_of, remarks_of, section_of, time_ns
from tests.trace.session import everything_said
from tests.watch.rig import LINK, M400, Rig

RATE = LineRate()


def test_a_packet_and_its_answer_are_blocks_with_their_bytes_and_exact_times() -> None:
    rig = Rig(10)
    rig.says(M400, at=5 * MS)
    entries = rig.run()
    capture = Capture()
    line = capture.line("bus", "sac", RATE, times="exact times", epoch=7 * SECOND)
    told = capture.header + line.header + b"".join(map(line.blocks, entries))
    (wire,) = interfaces_of(told)
    asked, answered = packets_of(told)
    assert section_of(told).options["shb_userappl"] == f"sacbus {__version__}"
    assert (wire.options["if_name"], wire.link_type) == ("bus", 147)
    assert wire.options["if_description"] == "sac at 38400 baud, exact times"
    assert (asked.packet_data, answered.packet_data) == (M400, ack(1, 10))
    assert [time_ns(one) - 7 * SECOND for one in (asked, answered)] == [
        5 * MS,
        5 * MS + 2_604_166 + 385_000,
    ]
    assert remarks_of(asked) == {
        "words": "move 400 full steps",
        "sender": LINK,
        "on the line": "2604166 ns",
    }
    assert remarks_of(answered) == {"sender": "node 10", "on the line": "1041666 ns"}


def test_all_that_has_bytes_has_a_block_and_nothing_else_has() -> None:
    entries = everything_said()
    capture = Capture()
    line = capture.line("bus", "sac", RATE)
    expected: list[bytes] = []
    for entry in entries:
        match entry:
            case Spoken():
                expected.append(entry.raw)
            case Collision(parts=parts):
                expected += [part.raw for part in parts]
            case _:
                assert line.blocks(entry) == b""
    told = capture.header + line.header + b"".join(map(line.blocks, entries))
    assert [one.packet_data for one in packets_of(told)] == expected


def test_each_of_a_collision_is_told_with_those_who_talked_over_it() -> None:
    parts = (Part(1_000, "a", None, b"\x02"), Part(2_000, "node 9", 9, b"\x55"))
    capture = Capture()
    line = capture.line("bus", "sac", RATE)
    blocks = line.blocks(Collision(1_000, 3_000, None, 0, parts))
    one, two = packets_of(capture.header + line.header + blocks)
    assert [time_ns(one), time_ns(two)] == [1_000, 2_000]
    assert remarks_of(one) == {"sender": "a", "collision with": "node 9"}
    assert remarks_of(two) == {"sender": "node 9", "collision with": "a"}


def test_every_lane_is_an_interface_and_so_is_every_other_line() -> None:
    said = everything_said()[0]
    capture = Capture()
    left = capture.line("left", "sac", RATE, lanes=2)
    right = capture.line("right", "other", LineRate(9_600))
    told = capture.header + left.header + right.header + right.blocks(said) + left.blocks(said)
    interfaces = interfaces_of(told)
    assert [(one.options["if_name"], one.link_type) for one in interfaces] == [
        ("left lane 0", 147),
        ("left lane 1", 147),
        ("right", 148),
    ]
    assert [one.options["if_speed"] for one in interfaces] == [38_400, 38_400, 9_600]
    assert [one.interface_id for one in packets_of(told)] == [2, 0]


def test_the_block_after_lost_lines_tells_how_many_once() -> None:
    entries = everything_said()[:2]
    capture = Capture()
    line = capture.line("bus", "sac", RATE)
    blocks = b"".join(map(line.blocks, [Lost(3), Lost(4), *entries]))
    one, two = packets_of(capture.header + line.header + blocks)
    assert (one.options.get("epb_dropcount"), two.options.get("epb_dropcount")) == (7, None)


def test_what_has_no_bytes_has_no_block() -> None:
    said = everything_said()[0]
    assert isinstance(said, Spoken)
    line = Capture().line("bus", "sac", RATE)
    report = Report(0, 10, ReportKind.WARNING, "", "", 0)
    assert [line.blocks(one) for one in (Unanswered(9, said), Reported(report))] == [b"", b""]


def test_a_name_cannot_pass_for_another_remark() -> None:
    parts = (Part(0, "a\nwords: stop", None, b"\x02"), Part(0, "b", None, b"\x55"))
    capture = Capture()
    line = capture.line("bus", "sac", RATE)
    one, _ = packets_of(capture.header + line.header + line.blocks(Collision(0, 1, None, 0, parts)))
    assert remarks_of(one) == {"sender": "a\\nwords: stop", "collision with": "b"}


def test_a_time_before_1970_is_1970() -> None:
    said = everything_said()[0]
    capture = Capture()
    line = capture.line("bus", "sac", RATE, epoch=-SECOND)
    (one,) = packets_of(capture.header + line.header + line.blocks(said))
    assert time_ns(one) == 0
