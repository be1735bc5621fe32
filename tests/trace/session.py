"""A session on a bus with all that can be said on a line, and what was decoded of it."""

from __future__ import annotations

from pathlib import Path

from sacbus.kernel import MS, SECOND, LineRate, Ns
from sacbus.trace.capture import Capture
from sacbus.watch import Entry
from sacbus.wire import encode
from tests.watch.rig import M400, Rig

__all__ = ["EVERYTHING", "capture_of", "everything_said"]

#: What the program writes, in this order; each has the line for itself but for answers.
EVERYTHING = (
    encode(10, 1, b"$O1"),  # soft ops on: its next moves are told to everybody
    M400,
    encode(11, 1, b"m400v300", crc=False),
    M400[:-2] + b"\x55\x00",  # wrong CRC: a NAK
    M400[:-1] + b"\x55",  # right CRC, no NUL
    encode(0, 1, b"V100"),  # a general call
    encode(10, 1, b"11V20"),  # sent on to 11
    encode(10, 1, b"/V20"),  # sent on to whoever spoke to it last
    encode(11, 1, b" hello"),  # a message
    encode(11, 1, b".hello"),
    encode(11, 1, b""),
    encode(11, 1, b"no command"),
    encode(11, 1, b"\xb5\x07"),
    encode(99, 1, b"m1"),  # nobody is there
    encode(11, 1, b"m132"),  # its CRC is STX
    encode(11, 1, b"m13"),  # its CRC is NUL
    encode(11, 1, b"m349"),  # its CRC is ETX
    encode(1, 200, b"\x06"),  # an ACK as a whole packet
    b"\xff\xfe\x33",  # noise
    M400,
    M400[:5],  # cut short by the next
    M400,
    M400 + M400,  # talks over the answer: a collision
    b"\x02" + bytes(300),  # too long
)
#: The last of all, when every move has ended: it is never finished.
UNFINISHED = M400[:6]


def everything_said(step: Ns = 150 * MS) -> list[Entry]:
    """What the watch tells of it all, nodes 10 and 11 being there."""
    rig = Rig(10, 11)
    for number, data in enumerate(EVERYTHING):
        rig.says(data, at=5 * MS + number * step)
    ended = len(EVERYTHING) * step + 60 * SECOND
    rig.says(UNFINISHED, at=ended)
    return rig.run(ended + 10 * SECOND)


def capture_of(entries: list[Entry], directory: Path) -> Path:
    """A file with these entries of a bus."""
    capture = Capture()
    line = capture.line("bus", "sac", LineRate())
    path = directory / "capture.pcapng"
    path.write_bytes(capture.header + line.header + b"".join(map(line.blocks, entries)))
    return path
