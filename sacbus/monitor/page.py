"""Entries as lines: aligned text for people, JSON objects for programs.

Owns columns, words, colours and field names (``docs/monitor.md``). Writes nothing anywhere.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from datetime import datetime
from typing import Any, Final, assert_never

import click

from sacbus.kernel import US, Ns
from sacbus.node import MASTER, Report
from sacbus.watch import (
    Collision,
    Entry,
    Lost,
    Reported,
    Spoken,
    Unanswered,
    is_fault,
)

__all__ = ["JsonPage", "TextPage", "printable"]

Clock = Callable[[Ns], datetime]
"""The wall clock's time at a time of the line."""

#: Bytes that a line of text shows of garbage, and of each part of a collision.
SHOWN: Final = 24

#: Characters of the columns: a day of time and three hours of silence stay aligned.
_TIME: Final = 12
_GAP: Final = 14
_VERDICT: Final = 6
_NOWHERE: Final = " " * len("255 -> 255")

#: What the check says, short: SAC's is a CRC.
_VERDICTS: Final = {"right": "ok", "unchecked": "no CRC", "wrong": "WRONG"}

_COLOURS: Final = {"ack": "green", "nak": "red", "garbage": "magenta"}


class TextPage:
    """A line of text for each entry. ``clock``: tell the time of day in place of seconds.

    ``verbose`` adds who sent it and its bytes.
    """

    def __init__(
        self, *, colour: bool = False, verbose: bool = False, clock: Clock | None = None
    ) -> None:
        self._colour = colour
        self._verbose = verbose
        self._clock = clock

    def heading(self) -> str:
        """What the columns are."""
        time = "time of day" if self._clock is not None else "time s"
        return (
            f"{time:>{self._width}}{'silence s':>{_GAP}}  {'from    to':<{len(_NOWHERE)}}  "
            f"{'CRC':<{_VERDICT}}  says"
        )

    @property
    def _width(self) -> int:
        return len("00:00:00.000000") if self._clock is not None else _TIME

    def line(self, entry: Entry) -> str:
        """Without its line end, and without control characters but colours."""
        match entry:
            case Spoken():
                text = self._spoken(entry)
                colour = _COLOURS.get(entry.said.kind) or ("red" if is_fault(entry) else None)
            case Unanswered(time, request):
                text = self._line(time, None, _way(request), "", f"no answer{_to(request)}")
                colour = "yellow"
            case Collision():
                parts = " / ".join(f"{one.sender}: {_hex(one.raw)}" for one in entry.parts)
                text = self._line(entry.start, entry.gap, "", "", f"collision of {parts}")
                colour = "red"
            case Reported(report):
                text = self._line(report.when, None, "", "", str(report))
                colour = "cyan"
            case Lost(lines):
                text = f"… {lines} lines of the feed were not read in time and are missing here"
                colour = "yellow"
            case _:
                assert_never(entry)
        text = printable(text)
        return click.style(text, fg=colour) if self._colour and colour else text

    def _spoken(self, entry: Spoken) -> str:
        said = entry.said
        if said.kind == "packet":
            says = f"{_body(entry)}: {said.words}" if said.data else said.words
        elif said.kind == "garbage":
            size = len(said.data)
            says = f"{said.words}, {size} byte{'s' if size != 1 else ''}: {_hex(said.data)}"
        else:
            says = f"{said.words}{_answering(entry)}"
        if self._verbose:
            sender = "" if entry.sender is None else f"{entry.sender}: "
            says += f"  [{sender}{entry.raw.hex(' ')}]"
        verdict = _VERDICTS.get(said.verdict, said.verdict)
        return self._line(entry.start, entry.gap, _way(entry), verdict, says)

    def _line(self, time: Ns, gap: Ns | None, way: str, verdict: str, says: str) -> str:
        if self._clock is None:
            when = f"{_seconds(time):>{_TIME}}"
        else:
            when = self._clock(time).strftime("%H:%M:%S.%f")
        silence = "" if gap is None else f"+{_seconds(gap)}"
        return f"{when}{silence:>{_GAP}}  {way or _NOWHERE}  {verdict:<{_VERDICT}}  {says}".rstrip()


class JsonPage:
    """A JSON object for each entry, one a line. ``clock`` adds the time of day.

    ``bus`` is the name of the bus whose reports come.
    """

    def __init__(self, *, clock: Clock | None = None) -> None:
        self.bus: str | None = None
        self._clock = clock

    def line(self, entry: Entry) -> str:
        """Without its line end."""
        return json.dumps(self._fields(entry), separators=(",", ":"))

    def _fields(self, entry: Entry) -> dict[str, Any]:
        match entry:
            case Spoken(said=said):
                fields = self._begin(said.kind, entry.start) | {
                    "end_ns": entry.end,
                    "gap_ns": entry.gap,
                    "lane": entry.lane,
                    "sender": entry.sender,
                }
                if said.kind == "garbage":
                    return fields | {"words": said.words, "bytes": entry.raw.hex()}
                fields |= {
                    "source": _address(said.source),
                    "destination": _address(said.destination),
                }
                if said.kind == "packet":
                    fields |= {
                        "body": said.body,
                        "words": said.words,
                        "verdict": said.verdict,
                    }
                else:
                    request = entry.request
                    fields |= {
                        "request_ns": None if request is None else request.start,
                        "delay_ns": entry.delay,
                        "late": entry.late,
                    }
                return fields | {"bytes": entry.raw.hex()}
            case Unanswered(time, request):
                return self._begin("no answer", time) | {
                    "source": _address(request.said.source),
                    "destination": _address(request.said.destination),
                    "body": request.said.body,
                    "request_ns": request.start,
                }
            case Collision():
                return self._begin("collision", entry.start) | {
                    "end_ns": entry.end,
                    "gap_ns": entry.gap,
                    "lane": entry.lane,
                    "senders": [
                        {
                            "sender": one.sender,
                            "node": one.node,
                            "start_ns": one.start,
                            "bytes": one.raw.hex(),
                        }
                        for one in entry.parts
                    ],
                }
            case Reported(report):
                return self._begin("report", report.when) | self._report(report)
            case Lost(lines):
                return {"event": "missed", "lines": lines}
            case _:
                assert_never(entry)

    def _begin(self, event: str, time: Ns) -> dict[str, Any]:
        fields: dict[str, Any] = {"event": event, "start_ns": time}
        if self._clock is not None:
            fields["clock"] = self._clock(time).astimezone().isoformat(timespec="microseconds")
        return fields

    def _report(self, report: Report) -> dict[str, object]:
        """As ``serve --json`` names them."""
        return {
            "bus": self.bus,
            "node": report.address,
            "what": report.kind.value,
            "line": report.line,
            "column": report.column,
            "text": report.text,
        }


def printable(text: str) -> str:
    """``text`` without control characters: what is said on a line may be anything, escapes too."""
    return "".join(one if one.isprintable() else f"\\x{ord(one):02x}" for one in text)


def _seconds(time: Ns) -> str:
    """With microseconds, truncated; exact however long it runs."""
    seconds, micros = divmod(time // US, 1_000_000)
    return f"{seconds}.{micros:06d}"


def _way(entry: Spoken) -> str:
    said = entry.said
    if said.source is None:
        return ""
    to = "all" if said.general else _name(said.destination)
    return f"{_name(said.source):>3} -> {to:<3}"


def _name(address: int | None) -> str:
    return "-" if address in (MASTER, None) else str(address)


def _address(address: int | None) -> int | None:
    """As JSON has it: a master without an address is null."""
    return None if address == MASTER else address


def _body(entry: Spoken) -> str:
    return entry.said.body


def _to(request: Spoken) -> str:
    return f" to {_body(request)}" if request.said.data else ""


def _answering(entry: Spoken) -> str:
    """What an answer answers, as far as that is known."""
    if entry.request is None:
        return " to nothing that was heard"
    after = "" if entry.delay is None else f" after {entry.delay // US} us"
    return f"{after}{', too late' if entry.late else ''}"


def _hex(data: bytes) -> str:
    more = f" … and {len(data) - SHOWN} more" if len(data) > SHOWN else ""
    return data[:SHOWN].hex(" ") + more
