"""Counts, delays and load."""

from __future__ import annotations

from sacbus.kernel import MS, SECOND
from sacbus.watch.entries import Lost
from sacbus.watch.summary import Summary
from sacbus.wire import encode
from tests.watch.rig import M400, Rig


def busy_line() -> Summary:
    rig = Rig(10)
    for number in range(3):
        rig.says(M400, at=number * 20 * MS)
    rig.says(encode(10, 1, b"?4 as before.."), at=60 * MS)
    rig.says(M400[:-2] + b"\x55\x00", at=80 * MS)
    rig.says(encode(99, 1, b"m400"), at=100 * MS)
    rig.says(M400 + M400, at=120 * MS)
    rig.says(b"hello", at=200 * MS)
    rig.run(SECOND)
    summary = rig.watch.summary
    summary.elapsed = SECOND
    return summary


def test_everything_is_counted() -> None:
    fields = busy_line().as_fields()
    assert fields == {
        "packets": 7,
        "wrong": 1,
        "acks": 4,
        "naks": 1,
        "unanswered": 2,
        "garbage": 1,
        "collisions": 1,
        # Of the wrong packet, of a line that the node does not understand, of the space in it.
        "reports": 3,
        "missed": 0,
        # Three of 385 us and one of 9 characters more.
        "ack_delay_ns": 385_000,
        "load": round((5 * 10 + 20 + 20 + 5 + 5 * 4) * 10 / 38_400, 6),
        "elapsed_ns": SECOND,
    }


def test_it_is_told_in_one_line() -> None:
    summary = busy_line()
    summary.count(Lost(3))
    assert summary.as_text() == (
        "7 packets (1 wrong), 4 ACK, 1 NAK, 2 unanswered, 1 garbage, 1 collisions, 3 reports, "
        "3 lines missed, ACK after 385 us (median), line 3.0% busy"
    )


def test_of_nothing_there_is_no_median_and_no_load() -> None:
    summary = Summary()
    assert (summary.ack_delay, summary.load) == (None, 0)
    assert summary.as_text() == (
        "0 packets, 0 ACK, 0 NAK, 0 unanswered, 0 garbage, 0 collisions, line 0.0% busy"
    )
