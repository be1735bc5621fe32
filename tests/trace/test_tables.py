"""CSV: rows that other programs can read."""

from __future__ import annotations

import csv
from io import StringIO

from sacbus.kernel import MS
from sacbus.trace.tables import EVENTS, POSITIONS, write_events, write_positions
from tests.trace.rig import recorded, two_axes


def test_events_are_a_row_each_in_order() -> None:
    recording = recorded(two_axes)
    out = StringIO()
    written = write_events(recording, out)
    head, *rows = csv.reader(StringIO(out.getvalue()))
    assert tuple(head) == EVENTS
    assert len(rows) == written
    times = [int(row[0]) for row in rows]
    assert times == sorted(times)
    events = [tuple(row[1:]) for row in rows]
    assert (
        "bus",
        "mother",
        "sent",
        "020a016d3430307631323003c200",
        "1>10 move 400 full steps at 120 RPM",
    ) in events
    assert ("bus", "10", "sent", "02010a06", "10>1 ACK") in events
    assert ("bus", "11", "pin", "0", "sync") in events
    assert ("bus", "10", "power", "0", "") in events
    assert ("bus", "10", "state", "CRUISE", "") in events
    assert ("bus", "", "mark", "", "sync falls") in events


def test_positions_are_those_of_the_track() -> None:
    recording = recorded(two_axes)
    out = StringIO()
    written = write_positions(recording, out, 50 * MS)
    head, *rows = csv.reader(StringIO(out.getvalue()))
    assert tuple(head) == POSITIONS
    assert len(rows) == written == 2 * (recording.end // (50 * MS) + 1)
    for when, _, node, pulses, steps, rpm, state in rows:
        at, track = int(when), recording.track(int(node))
        assert (int(pulses), float(steps), state) == (
            track.position(at),
            track.steps(at),
            track.state(at),
        )
        assert rpm == f"{track.rpm(at):.3f}"
