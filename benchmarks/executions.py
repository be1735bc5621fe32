"""What nodes executed on a line with bit errors, by the recording of it.

Owns the way from records to counts, for ``benchmarks.protection``. Of each packet of mother's a
recording has what was sent, what arrived, what was answered, and which nodes moved from then on, by
which command. That a node executed something shows in that it moved, in that it acknowledged, or in
that it reports a line that does nothing: damaged lines mostly are no motion. Bit errors are the
line's, so what arrived of a transmission arrived at everybody.

What is kept while reading is what belongs to one packet, and the counts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from sacbus.movement import Segment
from sacbus.node import ReportKind
from sacbus.trace import Recording
from sacbus.trace.records import Moved, Record, Sent, Told
from sacbus.wire import ACK, MOTHER, ack, nak
from sacbus.wire.times import ANSWER_BYTES

__all__ = ["RAMPS", "Executions"]

#: How recorded commands end: the ramps that all nodes were given before the packets.
RAMPS: Final = "a999d999"

#: What a node reports of a line that it accepted and cannot execute.
REFUSED: Final = ReportKind.REFUSED.value

#: Bytes before a packet's body: STX, destination, source; and behind: ETX, verdict, NUL.
HEADER: Final = 3
TRAILER: Final = 3


@dataclass(slots=True)
class _Slot:
    """A packet of mother's, with what is recorded from its beginning to that of the next."""

    packet: Sent
    records: list[Record] = field(default_factory=list)

    @property
    def node(self) -> int:
        """Whom it was sent to."""
        return self.packet.data[1]

    @property
    def line(self) -> bytes:
        """What was sent."""
        return self.packet.data[HEADER:-TRAILER]

    def heard(self) -> bytes:
        """What came to mother."""
        return b"".join(one.arrived for one in self.records if type(one) is Sent)

    def executed(self) -> dict[int, str]:
        """Who executed something, with the command that it moved by; empty for no motion."""
        found: dict[int, str] = {}
        for one in self.records:
            if type(one) is Moved and one.segment.command:
                found[one.node] = one.segment.command
            elif type(one) is Sent and isinstance(one.sender, int) and _accepts(one.data):
                found.setdefault(one.sender, "")
            elif type(one) is Told and one.node is not None and one.kind == REFUSED:
                found.setdefault(one.node, "")
        return found


def _accepts(answer: bytes) -> bool:
    return len(answer) == ANSWER_BYTES and answer[-1] == ACK


class Executions:
    """Counts of a recording in which mother sends packets to one node after another."""

    def __init__(self, recording: Recording) -> None:
        #: What was sent: packets by destination and body.
        self.sent: Counter[tuple[int, bytes]] = Counter()
        #: Packets by what became of them, and executions by nodes not meant.
        self.counts: Counter[str] = Counter()
        #: Executions by node, whether it was meant, and whether it was what had been sent.
        self.by_node: Counter[tuple[int, bool, bool]] = Counter()
        #: Every execution that was not as sent: what was sent, what arrived, who did what.
        self.wrong: list[str] = []
        #: The last that each node told of its motion.
        self._last: dict[int, Segment] = {}
        for slot in self._slots(recording):
            self._count(slot)
        self._end = recording.end

    def position(self, node: int) -> int:
        """Where a node stood in the end, in pulses; KeyError when it was not recorded."""
        return self._last[node].position(self._end)

    def _slots(self, recording: Recording) -> Iterator[_Slot]:
        """One after the other, each once the next has been read."""
        slot: _Slot | None = None
        pending: list[Record] = []
        for record in recording:
            if type(record) is Moved:
                self._last[record.node] = record.segment
            if type(record) is not Sent or record.sender != "mother":
                pending.append(record)
                continue
            # It is recorded when it is over: what came while it was sent stands before it.
            if slot is not None:
                slot.records = [one for one in pending if one.when <= record.start]
                yield slot
            pending = [one for one in pending if one.when > record.start]
            slot = _Slot(record)
        if slot is not None:
            slot.records = pending
            yield slot

    def _count(self, slot: _Slot) -> None:
        """Count what became of a packet."""
        counts, node, sent, arrived = self.counts, slot.node, slot.packet.data, slot.packet.arrived
        self.sent[node, slot.line] += 1
        heard, executed = slot.heard(), slot.executed()
        counts["heard"] += heard == ack(MOTHER, node)
        if not executed:
            counts["refused" if heard == nak(MOTHER, node) else "lost"] += 1
            return
        # With the ETX, which may have become a character of the line.
        text = slice(HEADER, 1 - TRAILER)
        command = slot.line.decode("latin-1").rstrip() + RAMPS
        right = arrived[text] == sent[text] and set(executed.values()) == {command}
        for one in executed:
            self.by_node[one, one == node, right] += 1
        kind, part = _kind(slot, executed, right=right)
        counts[kind] += 1
        if part is None:
            counts["unknown"] += heard != ack(MOTHER, node)
            return
        counts["by others"] += sum(one != node for one in executed)
        counts["visible"] += arrived != sent
        counts["there"] += arrived[part] != sent[part]
        self.wrong.append(
            f"{kind}: sent {sent.hex(' ')}, arrived {arrived.hex(' ')}, {_who(executed)}"
        )


def _who(executed: dict[int, str]) -> str:
    """Who did what, in words."""
    node, command = next(iter(executed.items()))
    others = f" and {len(executed) - 1} others" if len(executed) > 1 else ""
    return f"node {node}{others}: {command or 'no motion'}"


def _kind(slot: _Slot, executed: dict[int, str], *, right: bool) -> tuple[str, slice | None]:
    """The class of what was executed, and the part of the packet in which its damage must show."""
    if executed.keys() != {slot.node}:
        return "everybody" if len(executed) > 1 else "other node", slice(1, 2)
    behind = HEADER + len(slot.line)
    body, verdict = slice(HEADER, behind + 1), slice(behind + 1, behind + 2)
    if slot.packet.arrived[verdict] in (b"\x00", b"\x03"):
        return ("unchecked", verdict) if right else ("unchecked wrong", body)
    return ("as sent", None) if right else ("undetected", body)
