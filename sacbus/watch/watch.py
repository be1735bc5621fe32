"""What is said on a line: bytes or transmissions with their times in, entries out.

Owns what belongs together: an answer and its request, those who talked at the same time, a report
and the transmission that it came of; and when it is certain that nothing more will come. Time is an
argument: call :meth:`Watch.wake` when :meth:`Watch.wake_at` says. Knows a protocol only by its
contract.

Transmissions that overlapped are held until all of them are over (each says how many others hit
it), and told as one collision. What of them was not hit is decoded and told as ever.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from sacbus.feed import Sent
from sacbus.kernel import MS, SECOND, LineRate, Ns
from sacbus.node import Protocol, Report
from sacbus.watch.entries import Collision, Entry, Lost, Part, Reported, Spoken, Unanswered
from sacbus.watch.stream import Event, Stream, Stretch
from sacbus.watch.summary import Summary

__all__ = ["FEED_SLACK", "LINK_SLACK", "Watch"]

#: How late an answer may be beyond the protocol's figures: on a bus whose times are exact, and on a
#: link, where a USB adapter and a busy machine come on top. As mother's.
FEED_SLACK: Final[Ns] = 10 * MS
LINK_SLACK: Final[Ns] = 100 * MS

#: Bytes of line time for an answer itself; SAC's have 4, or 7 from a peer that sends whole packets.
ANSWER_ROOM: Final = 8

#: Silence after which pending noise is told. It could not become anything else.
NOISE_ENDS: Final[Ns] = 50 * MS

#: Silence after which an unfinished packet is given up where devices have no time-out: 2 s between
#: two bytes were observed to be accepted.
PACKET_ENDS: Final[Ns] = 3 * SECOND

#: How long an answer that is overdue is still known as one, when it comes at all.
LATE_UNTIL: Final[Ns] = 2 * SECOND

#: Transmissions that are held as one collision at most. More are told as several.
HELD: Final = 64


@dataclass(slots=True)
class _Open:
    """A request that waits for its answer."""

    request: Spoken
    heard_in: Stretch
    due: Ns
    told: bool = False


class _Lane:
    __slots__ = ("busy_until", "held", "stream", "told_until", "until")

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        #: When the last bytes ended, and the last entry.
        self.until: Ns | None = None
        self.told_until: Ns | None = None
        self.busy_until: Ns = 0
        #: Transmissions that others talked over, until all of them are there.
        self.held: list[Sent] = []


class Watch:
    """What a line says. ``slack``: how late an answer may be beyond the protocol's figures.

    ``lanes``: how many are heard, from number ``first`` on; a link hears that of the nodes alone.
    """

    def __init__(
        self,
        protocol: Protocol,
        rate: LineRate,
        *,
        lanes: int = 1,
        first: int = 0,
        slack: Ns = FEED_SLACK,
        summary: Summary | None = None,
    ) -> None:
        self._rate = rate
        self._slack = slack
        self._lanes = [_Lane(Stream(protocol, rate, first + one)) for one in range(lanes)]
        patience = protocol.patience(rate.span(1))
        # What a link brings may have waited on its way.
        late = max(slack - FEED_SLACK, 0)
        self._packet_ends = PACKET_ENDS if patience is None else patience + late
        #: Requests by who asked whom; of each pair only the last can be answered.
        self._open: dict[tuple[int, int], _Open] = {}
        #: Reports that wait for the transmission that they came of.
        self._reports: deque[Report] = deque()
        self.summary = summary or Summary()

    def read(self, data: bytes, now: Ns) -> list[Entry]:
        """Bytes of a link, the last of which had ended by ``now``; one lane.

        They began no later than the line's rate makes it, and no earlier than those before ended.
        """
        start = now - self._rate.span(len(data))
        entries = self._pass(start)
        earliest = self._lanes[0].until or 0
        stretch = Stretch(max(start, earliest), now, data, squeezed=start < earliest)
        return self._counted(entries + self._heard(0, stretch))

    def sent(self, sent: Sent) -> list[Entry]:
        """A transmission, as a feed tells it: in the order of their ends."""
        lane = self._lanes[sent.lane]
        entries: list[Entry] = []
        if not sent.hits or len(lane.held) >= HELD:
            entries += self._collided(sent.lane)
        entries += self._pass(sent.start)
        if sent.hits:
            lane.held.append(sent)
            if _is_complete(lane.held):
                entries += self._collided(sent.lane)
        else:
            entries += self._heard(sent.lane, _stretch(sent))
        return self._counted(entries + self._reported(sent.end))

    def reported(self, report: Report) -> list[Entry]:
        """A report, as a feed tells it: before the transmission is over in whose course it came."""
        self._reports.append(report)
        return []

    def lost(self, lines: int) -> list[Entry]:
        """So many lines of the feed were missed: nothing is known to follow anything."""
        entries: list[Entry] = []
        for number, lane in enumerate(self._lanes):
            entries += self._collided(number)
            lane.stream.forget()
            lane.told_until = None
        self._open.clear()
        return self._counted([*entries, *self._reported(None), Lost(lines)])

    def wake_at(self) -> Ns | None:
        """When something will be certain if nothing is heard until then; None: never."""
        times = [one.due for one in self._open.values() if not one.told]
        times += [due for lane in self._lanes if (due := self._gives_up(lane)) is not None]
        return min(times, default=None)

    def wake(self, now: Ns) -> list[Entry]:
        """Nothing but what has been told was over by ``now``."""
        return self._counted(self._pass(now) + self._reported(now))

    def end(self, now: Ns) -> list[Entry]:
        """Nothing more will come: what is held and what is pending."""
        entries = self._pass(now)
        for number in range(len(self._lanes)):
            entries += self._collided(number)
            entries += self._given_up(number, "unfinished")
        return self._counted(entries + self._reported(None))

    def _counted(self, entries: list[Entry]) -> list[Entry]:
        for entry in entries:
            self.summary.count(entry)
        return entries

    # ------------------------------------------------------------------ what is heard

    def _heard(self, number: int, stretch: Stretch) -> list[Entry]:
        self._busy(number, stretch.start, stretch.end)
        events = self._lanes[number].stream.hear(stretch)
        # What is spoilt was held back by the decoder, and is part of a collision told already.
        return [entry for one in events if not one.spoilt for entry in self._told(number, one)]

    def _busy(self, number: int, start: Ns, end: Ns) -> None:
        lane = self._lanes[number]
        lane.until = end if lane.until is None else max(lane.until, end)
        self.summary.busy += max(0, end - max(start, lane.busy_until)) // len(self._lanes)
        lane.busy_until = max(lane.busy_until, end)

    def _gap(self, number: int, start: Ns, end: Ns) -> Ns | None:
        """The silence before ``start``; the next one is counted from ``end``."""
        lane = self._lanes[number]
        before, lane.told_until = lane.told_until, end
        return None if before is None else max(start - before, 0)

    def _told(self, number: int, event: Event) -> list[Entry]:
        said = event.said
        spoken = Spoken(
            event.start,
            event.end,
            self._gap(number, event.start, event.end),
            number,
            event.sender,
            said,
            event.raw,
        )
        entries: list[Entry] = []
        if said.kind in ("ack", "nak"):
            spoken = self._answered(spoken, event)
        elif said.reply_after is not None and said.source is not None:
            assert said.destination is not None  # it has a source, so it is no garbage
            entries += self._asked((said.source, said.destination), spoken, event)
        entries.append(spoken)
        return entries

    # ------------------------------------------------------------ requests and answers

    def _asked(self, pair: tuple[int, int], spoken: Spoken, event: Event) -> list[Entry]:
        """A request waits from now on; one before it that did has not been answered."""
        before = self._open.pop(pair, None)
        assert spoken.said.reply_after is not None  # whoever calls has looked
        due = spoken.end + spoken.said.reply_after + self._rate.span(ANSWER_ROOM) + self._slack
        self._open[pair] = _Open(spoken, event.ended_in, due)
        if before is None or before.told:
            return []
        return [Unanswered(min(before.due, spoken.start), before.request)]

    def _answered(self, spoken: Spoken, event: Event) -> Spoken:
        said = spoken.said
        assert said.source is not None  # of an answer
        assert said.destination is not None
        waiting = self._open.pop((said.destination, said.source), None)
        if waiting is None:
            return spoken
        # Of a link, nothing is known of the silences within one read, or before one that was late.
        began_in = event.began_in
        exact = spoken.sender is not None or not (began_in.squeezed or began_in is waiting.heard_in)
        return Spoken(
            spoken.start,
            spoken.end,
            spoken.gap,
            spoken.lane,
            spoken.sender,
            said,
            spoken.raw,
            waiting.request,
            max(spoken.start - waiting.request.end, 0) if exact else None,
            waiting.told,
        )

    def _pass(self, now: Ns) -> list[Entry]:
        """Time has come to ``now``, and nothing has been heard that was over by then."""
        held = [one.start for lane in self._lanes for one in lane.held]
        if held:  # its parts may hold the answer
            now = min(now, *held)
        entries: list[Entry] = []
        for pair, waiting in list(self._open.items()):
            if not waiting.told and waiting.due <= now:
                waiting.told = True
                entries.append(Unanswered(waiting.due, waiting.request))
            if waiting.told and waiting.due + LATE_UNTIL <= now:
                del self._open[pair]
        for number, lane in enumerate(self._lanes):
            due = self._gives_up(lane)
            if due is not None and due <= now:
                words = "unfinished" if lane.stream.unfinished else "noise"
                entries += self._given_up(number, words)
        return sorted(entries, key=_time)

    def _gives_up(self, lane: _Lane) -> Ns | None:
        """When what is pending on a lane is given up; None when nothing is."""
        if lane.until is None or not lane.stream.pending:
            return None
        return lane.until + (self._packet_ends if lane.stream.unfinished else NOISE_ENDS)

    def _given_up(self, number: int, words: str) -> list[Entry]:
        event = self._lanes[number].stream.give_up(words)
        if event is None or event.spoilt:  # told as part of a collision
            return []
        return self._told(number, event)

    def _reported(self, until: Ns | None) -> list[Entry]:
        """Reports made up to ``until``; None: all."""
        told: list[Entry] = []
        while self._reports and (until is None or self._reports[0].when <= until):
            told.append(Reported(self._reports.popleft()))
        return told

    # --------------------------------------------------------------------- collisions

    def _collided(self, number: int) -> list[Entry]:
        """Those that are held, as a collision; and what of them had arrived unharmed."""
        lane = self._lanes[number]
        if not lane.held:
            return []
        held = sorted(lane.held, key=lambda sent: sent.start)
        lane.held = []
        events: list[Event] = []
        for sent in held:
            self._busy(number, sent.start, sent.end)
            events += [one for one in lane.stream.hear(_stretch(sent)) if not one.spoilt]
        start = min(begin for sent in held for begin, _ in sent.hits)
        end = max(end for sent in held for _, end in sent.hits)
        entries: list[Entry] = []
        events.sort(key=lambda event: event.start)
        for event in events:
            if event.start < start:
                entries += self._told(number, event)
        parts = tuple(Part(sent.start, sent.sender, sent.node, sent.data) for sent in held)
        entries.append(Collision(start, end, self._gap(number, start, end), number, parts))
        for event in events:
            if event.start >= start:
                entries += self._told(number, event)
        return entries


def _stretch(sent: Sent) -> Stretch:
    return Stretch(sent.start, sent.end, sent.data, sent.sender, sent.hits, ninth=sent.ninth)


def _is_complete(held: Sequence[Sent]) -> bool:
    """Whether all who talked at the same time are there: each was hit once by each other one."""
    return all(
        sum(other is not one and other.start < one.end and one.start < other.end for other in held)
        >= len(one.hits)
        for one in held
    )


def _time(entry: Entry) -> Ns:
    match entry:
        case Unanswered(time):
            return time
        case Spoken(start) | Collision(start):
            return start
        case _:
            return 0
