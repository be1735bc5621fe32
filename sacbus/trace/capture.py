"""What was said on a line, as a capture: a pcapng block for every entry that has bytes.

Owns what of an entry goes where: its bytes, as they came, are the packet; the time is that of its
first bit; what bytes alone do not tell stands in comments, each ``KEY: VALUE``. ``sac.lua``, the
dissector, reads the comments and does without them (``docs/wireshark.md``). Writes nothing
anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, assert_never

from sacbus import __version__
from sacbus.kernel import LineRate, Ns
from sacbus.trace.pcapng import LINKTYPE_USER0, LINKTYPE_USER1, interface, packet, section
from sacbus.watch import Collision, Entry, Lost, Reported, Spoken, Unanswered

__all__ = ["Capture", "CapturedLine"]

#: The dissector takes USER0 for SAC; bytes of other protocols must not get to it.
_LINK_TYPES: Final = {"sac": LINKTYPE_USER0}


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
        link_type = _LINK_TYPES.get(protocol, LINKTYPE_USER1)
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
        #: What has been missed since the last block.
        self._dropped = 0

    def missed(self, count: int) -> None:
        """So many lines or packets are missing before the next block."""
        self._dropped += count

    def blocks(self, entry: Entry) -> bytes:
        """The block of a packet, an answer or garbage, one for each part of a collision.

        Nothing for what has no bytes of its own. An answer that did not come is seen by its
        absence.
        """
        match entry:
            case Spoken():
                return self._block(entry.lane, entry.start, entry.raw, list(_comments(entry)))
            case Collision(lane=lane, parts=parts):
                blocks = b""
                for part in parts:
                    others = ", ".join(one.sender for one in parts if one is not part)
                    comments = [f"sender: {part.sender}", f"collision with: {others}"]
                    blocks += self._block(lane, part.start, part.raw, comments)
                return blocks
            case Lost(lines):
                self.missed(lines)
                return b""
            case Unanswered() | Reported():
                return b""
            case _:
                assert_never(entry)

    def _block(self, lane: int, start: Ns, raw: bytes, comments: list[str]) -> bytes:
        dropped, self._dropped = self._dropped, 0
        # Counted back from its arrival, a first byte may have begun before anybody listened.
        time = max(self._epoch + start, 0)
        return packet(self._first + lane, time, raw, comments, dropped=dropped)


def _comments(entry: Spoken) -> Iterator[str]:
    """What is known of it beyond its bytes."""
    said = entry.said
    if said.kind in ("packet", "garbage"):
        yield f"words: {said.words}"
    if entry.sender is not None:
        yield f"sender: {entry.sender}"
    yield f"on the line: {entry.end - entry.start} ns"
    if entry.request is not None and entry.delay is None:
        yield "delay: not known"
