"""What was said on a line, as a capture: a pcapng block for every entry that has bytes.

Owns what of an entry goes where: its bytes, as they came, are the packet; the time is that of its
first bit; what bytes alone do not tell stands in its comment, a line ``KEY: VALUE`` each.
A protocol's dissector reads comments and does without them (``docs/wireshark.md``). Writes nothing
anywhere.
"""

from __future__ import annotations

from typing import Final, assert_never

from sacbus import __version__
from sacbus.kernel import LineRate, Ns
from sacbus.node import KindError, find_protocol
from sacbus.trace.pcapng import LINKTYPE_USER1, interface, packet, section
from sacbus.watch import Collision, Entry, Lost, Reported, Spoken, Unanswered

__all__ = ["Capture", "CapturedLine"]


class Capture:
    """A capture of one or more lines. ``header`` is what its file begins with."""

    header: Final = section(f"sacbus {__version__}")

    def __init__(self) -> None:
        self._interfaces = 0

    def line(
        self,
        name: str,
        protocol: str,
        rate: LineRate,
        *,
        lanes: int = 1,
        times: str = "",
        epoch: Ns = 0,
    ) -> CapturedLine:
        """A line whose entries come from now on; its ``header`` must be written before them.

        ``times`` says in words what its times are. ``epoch``: ns from 1970 to its time 0.
        """
        first = self._interfaces
        self._interfaces += lanes
        description = f"{protocol} at {rate.baud} baud" + (f", {times}" if times else "")
        names = [name] if lanes == 1 else [f"{name} lane {lane}" for lane in range(lanes)]
        link_type = _link_type(protocol)
        header = b"".join(
            interface(one, description, link_type=link_type, bits_per_second=rate.baud)
            for one in names
        )
        return CapturedLine(header, first, epoch)


class CapturedLine:
    """One line of a capture, an interface for each of its lanes."""

    def __init__(self, header: bytes, first: int, epoch: Ns) -> None:
        self.header = header
        self._first = first
        self._epoch = epoch
        #: Lines or packets that are missing before the next block; it will say so.
        self.dropped = 0
        #: Blocks that have been made.
        self.count = 0

    def blocks(self, entry: Entry) -> bytes:
        """The block of a packet, an answer or garbage, one for each part of a collision.

        Nothing for what has no bytes of its own. An answer that did not come is seen by its
        absence.
        """
        match entry:
            case Spoken():
                return self._block(entry.lane, entry.start, entry.raw, _remarks(entry))
            case Collision(lane=lane, parts=parts):
                blocks = b""
                for part in parts:
                    others = ", ".join(one.sender for one in parts if one is not part)
                    remarks = {"sender": part.sender, "collision with": others}
                    blocks += self._block(lane, part.start, part.raw, remarks)
                return blocks
            case Lost(lines):
                self.dropped += lines
                return b""
            case Unanswered() | Reported():
                return b""
            case _:
                assert_never(entry)

    def _block(self, lane: int, start: Ns, raw: bytes, remarks: dict[str, str]) -> bytes:
        dropped, self.dropped = self.dropped, 0
        self.count += 1
        # Counted back from its arrival, a first byte may have begun before anybody listened.
        time = max(self._epoch + start, 0)
        # One comment: each counts as a remark of its own in Wireshark's "Expert Information".
        comment = "\n".join(f"{key}: {_in_one_line(text)}" for key, text in remarks.items())
        return packet(self._first + lane, time, raw, (comment,), dropped=dropped)


def _link_type(protocol: str) -> int:
    """What tells Wireshark which dissector reads it; bytes of others must not get to that one."""
    try:
        own = find_protocol(protocol).link_type
    except KindError:
        own = None
    return LINKTYPE_USER1 if own is None else own


def _remarks(entry: Spoken) -> dict[str, str]:
    """What is known of it beyond its bytes."""
    said = entry.said
    remarks = {}
    if said.kind == "packet":
        remarks["words"] = said.words
    elif said.kind == "garbage":
        remarks["garbage"] = said.words
    if entry.sender is not None:
        remarks["sender"] = entry.sender
    remarks["on the line"] = f"{entry.end - entry.start} ns"
    if entry.request is not None and entry.delay is None:
        remarks["delay"] = "not known"
    return remarks


def _in_one_line(text: str) -> str:
    """A path may hold a line end, which would begin another remark."""
    return text if text.isprintable() else text.encode("unicode_escape").decode()
