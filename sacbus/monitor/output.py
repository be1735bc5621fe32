"""Where the monitor's entries go: standard output for them, standard error for words about them.

Owns the choice of what is shown, and the form: lines, a capture (``pcap.py``), or both. Texts are
written by a thread (``sacbus.writer``), so that a reader who does not read holds up nothing but the
monitor's own reading.
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta

import click

from sacbus.kernel import US, Ns
from sacbus.monitor.page import JsonPage, TextPage, printable
from sacbus.monitor.pcap import Looked, PcapOutput
from sacbus.monitor.wanted import Wanted
from sacbus.watch import Entry, Summary, concerns, is_fault
from sacbus.writer import Writer

__all__ = ["Output", "WallClock"]

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class WallClock:
    """Times of the line as local times of day, from one moment whose both times are known."""

    def __init__(self) -> None:
        self._time: Ns = 0
        self._clock = 0
        self._speed = 1.0

    def set(self, time: Ns, clock: int, speed: float = 1.0) -> None:
        """At ``time`` of the line it was ``clock``, ns since 1970; the line's time runs as fast."""
        self._time, self._clock, self._speed = time, clock, speed

    @property
    def offset(self) -> Ns:
        """What that moment's time of the line lacks to its time of day, ns since 1970."""
        return self._clock - self._time

    def __call__(self, time: Ns) -> datetime:
        """Local time, to the microsecond."""
        micros = self._clock // US + round((time - self._time) / self._speed / US)
        return (_EPOCH + timedelta(microseconds=micros)).astimezone()


class Output:
    """What the user sees. To be made in a running event loop.

    ``lost`` is told once when nothing can be written any more.
    """

    def __init__(self, wanted: Wanted, lost: Callable[[OSError], None]) -> None:
        self.clock = WallClock()
        #: Whether there has been anything to look at.
        self.begun = False
        clock = self.clock if wanted.clock else None
        self._wanted = wanted
        self._text = TextPage(colour=_is_terminal(), verbose=wanted.verbose, clock=clock)
        self._json = JsonPage(clock=clock) if wanted.as_json else None
        self._pcap = None if wanted.pcap is None else PcapOutput(wanted.pcap, lost)
        self._captures_alone = wanted.pcap == _standard_output()
        self._writer = Writer(lost, self._missed)

    def begin(self, words: str, fields: dict[str, object], line: Looked) -> None:
        """What is looked at from now on: words for people, fields for programs; the line itself."""
        self.begun = True
        if self._pcap is not None:
            self._pcap.begin(line, self.clock.offset)
        if self._captures_alone:
            self._remark(words)
            return
        if self._json is None:
            self._remark(f"{words}\n{self._text.heading()}")
        else:
            self._json.bus = line.bus
            self._write("monitor", fields)

    def show(self, entries: Iterable[Entry]) -> None:
        """Those that are wanted."""
        page = self._json or self._text
        for entry in entries:
            if not self._is_wanted(entry):
                continue
            if self._pcap is not None:
                self._pcap.show(entry)
            if not self._captures_alone:
                self._writer.say(f"{page.line(entry)}\n")

    async def room(self) -> None:
        """Wait while much waits to be written."""
        await self._writer.room()
        if self._pcap is not None:
            await self._pcap.room()

    def remark(self, words: str) -> None:
        """Something about the monitor itself."""
        if self._json is None:
            self._remark(words)
        else:
            self._write("remark", {"text": words})

    def end(self, summary: Summary) -> None:
        """Nothing more comes but this."""
        if self._json is not None:
            self._write("summary", summary.as_fields())
        self.close()
        if self._json is None:
            self._remark(summary.as_text())

    def close(self) -> None:
        """Nothing more comes at all."""
        self._writer.close()
        if self._pcap is not None:
            self._pcap.close()

    def _is_wanted(self, entry: Entry) -> bool:
        wanted = self._wanted
        return (not wanted.nodes or concerns(entry, wanted.nodes)) and (
            not wanted.errors or is_fault(entry)
        )

    def _write(self, event: str, fields: dict[str, object]) -> None:
        self._writer.say(json.dumps({"event": event, **fields}, separators=(",", ":")) + "\n")

    def _missed(self, count: int) -> str:
        if self._wanted.as_json:
            return json.dumps({"event": "missed", "lines": count}) + "\n"
        return f"… {count} lines were not read in time and are missing here\n"

    @staticmethod
    def _remark(words: str) -> None:
        click.echo("\n".join(printable(line) for line in words.splitlines()), err=True)


def _is_terminal() -> bool:
    return sys.stdout.isatty()


def _standard_output() -> int | None:
    try:
        return sys.stdout.fileno()
    except io.UnsupportedOperation:  # replaced, as in tests
        return None
