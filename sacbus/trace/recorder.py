"""The recorder: what happens on buses, as JSON Lines, one record a line.

Owns the text of a recording and when it is written. The text of a run is the same each time: it
holds bus time and no other, no path, and its keys in one order. ``reading.py`` reads it back, and
docs/recordings.md describes it.

Lines are collected and written some hundred at a time, and whenever a second of bus time has gone
by since the last were; whoever records in real time calls :meth:`Recorder.flush` now and then for
what came last. So what is killed leaves all but the last of it.
"""

from __future__ import annotations

import errno
import json
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import count
from types import TracebackType
from typing import BinaryIO, Final, Self, TypeVar, assert_never

from sacbus.bus import FaultOn, Port, Transmission
from sacbus.hosted import HostedBus
from sacbus.kernel import SECOND, Ns
from sacbus.node import Node, Report
from sacbus.panel import Deed, Drive, Power, Turn
from sacbus.trace.records import FORMAT

__all__ = ["Recorder", "RecordingCutOff"]

_W = TypeVar("_W")

#: Lines that are written together.
TOGETHER: Final = 512

#: Bus time that a line waits for others at most, as long as others come.
OFTEN: Final[Ns] = SECOND

#: Lines that are kept for who asks what was last.
TAIL: Final = 256

#: Shapes of motion that are referred to; beyond it they are written anew.
SHAPES: Final = 65_536


class RecordingCutOff(OSError):
    """A recording that cannot be written on; its text is a line for users.

    ``name``: the file, empty when it has none. ``kept``: up to which bus time all is in it, ns;
    None: nothing is. ``reason``: the system's word for it, and ``errno`` its number.
    """

    def __init__(self, name: str, kept: Ns | None, reason: str, number: int | None = None) -> None:
        self.name = name
        self.kept = kept
        self.reason = reason
        what = f"the recording{f' {name}' if name else ''}"
        if kept is None:
            text = f"{what} could not be begun: {reason}, nothing is kept, record elsewhere"
        else:
            until = f"{kept / SECOND:.6f} s"
            text = f"{what} ends at {until}: {reason}, what came before is kept, record elsewhere"
        super().__init__(text)
        self.errno = number

    def __reduce__(self) -> tuple[type[RecordingCutOff], tuple[object, ...]]:
        """How it is copied, and comes out of another process."""
        return type(self), (self.name, self.kept, self.reason, self.errno)


class Recorder:
    """Records some buses into ``sink`` from now on, until it is closed; the sink is the caller's.

    ::

        with path.open("wb") as sink, Recorder(bus, sink) as recorder:
            ...

    A sink that cannot be written to ends the recording, not the bus: it is reported there,
    :attr:`fault` says so, and ``cut_off`` is called with that at once, in the middle of whatever
    was recorded; raising is up to it. Such a sink is best one without a buffer
    (``path.open("wb", buffering=0)``): a buffer tries to write what is in it once more when it is
    closed, and raises again.
    """

    def __init__(
        self,
        buses: HostedBus | Sequence[HostedBus],
        sink: BinaryIO,
        *,
        cut_off: Callable[[RecordingCutOff], object] | None = None,
    ) -> None:
        several = [buses] if isinstance(buses, HostedBus) else list(buses)
        self._first = several[0]
        self._sink = sink
        self._cut_off = cut_off
        #: Up to when all is in the sink; None: nothing has been written.
        self._kept: Ns | None = None
        self._lines: list[str] = []
        self._tail: deque[str] = deque(maxlen=TAIL)
        self._written: Ns = 0
        #: Shapes of motion by kind and text, with their numbers, which go up for ever.
        self._shapes: dict[tuple[str, str], int] = {}
        self._numbers = count()
        self._closed = False
        #: Why nothing can be written any more; None: it can.
        self.fault: RecordingCutOff | None = None
        self._places: list[_Place] = []
        self._head = _text(
            {
                "sacbus": "recording",
                "format": FORMAT,
                "buses": [_about(number, bus) for number, bus in enumerate(several)],
            }
        )
        self._lines.append(self._head)
        self._begin(several)

    def _begin(self, buses: Sequence[HostedBus]) -> None:
        self._places += [_Place(self, number, bus) for number, bus in enumerate(buses)]
        try:
            for place in self._places:
                place.begin()
                # What it tells at its beginning may be enough to be written, and to be cut off.
                if self.fault is not None:
                    break
        finally:
            if self.fault is not None:
                self._let_go()

    # ---- what whoever records adds ----

    def mark(self, text: str, *, bus: int = 0, **details: object) -> None:
        """A remark, now; ``details`` are as JSON has them."""
        self._add(bus, {"is": "mark", "text": text, **({"details": details} if details else {})})

    def outcome(self, node: int, body: bytes, result: str, attempts: int, *, bus: int = 0) -> None:
        """What became of a request of mother's."""
        self._add(
            bus,
            {
                "is": "outcome",
                "node": node,
                "body": body.decode("latin-1"),
                "result": result,
                "attempts": attempts,
            },
        )

    # ---- what was last ----

    @property
    def head(self) -> str:
        """The first line, which says what the others are about."""
        return self._head

    @property
    def tail(self) -> list[str]:
        """The last lines, oldest first."""
        return list(self._tail)

    # ---- writing ----

    def flush(self) -> None:
        """Write what has been recorded so far."""
        if not self._lines or self.fault is not None:
            self._lines.clear()
            return
        self._lines.append("")
        data = "\n".join(self._lines).encode()
        self._lines.clear()
        try:
            while data:  # a sink without a buffer may take a part of it
                taken = self._sink.write(data)
                if not taken:  # nor does a pipe that does not block, while it is full
                    raise BlockingIOError(errno.EAGAIN, "it takes nothing at present")
                data = data[taken:]
            self._sink.flush()
        except OSError as fault:
            self._end(fault)
        else:
            self._kept = self._first.bus.kernel.now

    def _end(self, fault: OSError) -> None:
        """Nothing can be written any more: who records and who looks on are told."""
        name = getattr(self._sink, "name", "")
        named = name if isinstance(name, str) else ""  # one without a name has a number
        self.fault = RecordingCutOff(named, self._kept, fault.strerror or str(fault), fault.errno)
        self.fault.__cause__ = fault
        self._let_go()
        self._first.tell(str(self.fault))
        if self._cut_off is not None:
            self._cut_off(self.fault)

    def close(self) -> None:
        """End the recording; what is written says that it is whole. Harmless when repeated."""
        if self._closed:
            return
        self._closed = True
        if self.fault is None:
            for place in self._places:
                place.add('"is":"end"')
            self._let_go()
            self.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _fault: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self.close()

    def put(self, line: str, now: Ns) -> None:
        """Take a line, made at ``now``."""
        lines = self._lines
        lines.append(line)
        self._tail.append(line)
        if len(lines) >= TOGETHER or now - self._written >= OFTEN:
            self._written = now
            self.flush()

    def shape(self, kind: str, text: str, bus: int, now: Ns) -> int:
        """The number of a shape of motion; it is written before it is first referred to."""
        shapes = self._shapes
        number = shapes.get((kind, text))
        if number is None:
            if len(shapes) >= SHAPES:
                shapes.clear()
            number = shapes[kind, text] = next(self._numbers)
            about = f'"is":"shape","shape":{number},"kind":{json.dumps(kind)}'
            self.put(f'{{"t":{now},"bus":{bus},{about},{text}}}', now)
        return number

    def _add(self, bus: int, record: Mapping[str, object]) -> None:
        self._places[bus].add(_text(record)[1:-1])

    def _let_go(self) -> None:
        for place in self._places:
            place.let_go()


class _Place:
    """One recorded bus: what it tells, and how that is put."""

    def __init__(self, recorder: Recorder, number: int, hosted: HostedBus) -> None:
        self.hosted = hosted
        self._recorder = recorder
        self._number = number
        self._kernel = hosted.bus.kernel
        self._seed = hosted.bus.medium.seed
        #: Senders by their identity, as they are named: a node by its address, in JSON.
        self._names: dict[int, str] = {}
        #: Those that are no nodes, which must live as long as their identity names them.
        self._talkers: list[object] = []
        self._links = 0
        self._stop: list[Callable[[], object]] = []

    def begin(self) -> None:
        """Watch, from now on; a node in motion is told of at once."""
        hosted = self.hosted
        now = hosted.now()
        bus = hosted.bus
        self._stop += [
            _watch(bus.medium.watchers, self._sent),
            _watch(bus.medium.fault_watchers, self._faulty),
            _watch(bus.report_watchers, self._told),
            _watch(hosted.deeds, self._done),
        ]
        for at, node in hosted.configured:
            self._names[id(node)] = str(at.address)
            movement = node.movement
            if movement is not None:
                self._stop.append(partial(movement.watch, None, now))
                movement.watch(partial(self._moved, at.address, at.kind), now)

    def let_go(self) -> None:
        """Watch no longer."""
        for stop in self._stop:
            stop()
        self._stop.clear()

    def add(self, rest: str) -> None:
        """A record that happens now."""
        now = self._kernel.now
        self._recorder.put(f'{{"t":{now},"bus":{self._number},{rest}}}', now)

    def _sent(self, sent: Transmission) -> None:
        name = self._names.get(id(sent.sender)) or self._name(sent.sender)
        data = sent.data
        text = (
            f'"is":"sent","start":{sent.start},"lane":{sent.lane},"from":{name},'
            f'"data":"{data.hex()}"'
        )
        if sent.hits is not None or sent.passage is not None:
            text += self._damage(sent)
        if sent.ninth is not None:
            text += f',"ninth":"{sent.ninth.hex()}"'
        self.add(text)

    def _damage(self, sent: Transmission) -> str:
        """What became of one that another overlapped, or faults touched, as far as it differs."""
        found: dict[str, object] = {}
        arrived = sent.outcome(self._seed)
        if arrived != sent.data:
            found["arrived"] = arrived.hex()
        if sent.end != sent.start + sent.rate.span(len(sent.data)):
            found["end"] = sent.end
        if sent.hits is not None:
            found["collided"] = True
        passage = sent.passage
        if passage is not None:
            found["faults"] = passage.by
            if passage.missed:
                found["missed"] = ["links" if one is None else one for one in passage.missed]
            if passage.receivers:
                found["heard"] = {
                    str(one): passage.heard_by(one, self._seed).hex() for one in passage.receivers
                }
        return f",{_text(found)[1:-1]}" if found else ""

    def _name(self, sender: object) -> str:
        """How a talker that is no node is called: paths differ from run to run."""
        self._talkers.append(sender)
        if isinstance(sender, FaultOn):
            name = json.dumps(sender.name)
        elif isinstance(sender, Port) and sender.name == "mother":
            name = '"mother"'
        else:
            self._links += 1
            name = f'"link {self._links}"'
        self._names[id(sender)] = name
        return name

    def _faulty(self, on: FaultOn) -> None:
        """A fault was put on, or taken off: then it tells how often it acted."""
        details: dict[str, object] = {"fault": repr(on.fault)} if on.is_on else {"count": on.count}
        record = {"is": "fault", "name": on.name, "on": on.is_on, "details": details}
        self.add(_text(record)[1:-1])

    def _told(self, report: Report) -> None:
        record: dict[str, object] = {
            "is": "report",
            "node": report.address,
            "kind": report.kind.value,
            "text": report.text,
        }
        if report.line:
            record["line"] = report.line
        if report.column:
            record["column"] = report.column
        self.add(_text(record)[1:-1])

    def _moved(self, address: int, kind: str, now: Ns, shape: str, values: str) -> None:
        recorder, bus = self._recorder, self._number
        number = recorder.shape(kind, shape, bus, now)
        recorder.put(
            f'{{"t":{now},"bus":{bus},"is":"moves","node":{address},"shape":{number},{values}}}',
            now,
        )

    def _done(self, node: Node, deed: Deed) -> None:
        """Something was done to a node from outside."""
        address = self._names[id(node)]
        match deed:
            case Drive(pin, level):
                self.add(f'"is":"pin","node":{address},"pin":{json.dumps(pin)},"level":{level}')
            case Turn(detents):
                self.add(f'"is":"turn","node":{address},"detents":{detents}')
            case Power(on):
                self.add(f'"is":"power","node":{address},"on":{"true" if on else "false"}')
            case _:
                assert_never(deed)


def _about(number: int, hosted: HostedBus) -> dict[str, object]:
    """What the first line says of a bus."""
    bus = hosted.bus
    return {
        "bus": number,
        "name": bus.name,
        "protocol": bus.protocol.name,
        "baud": bus.rate.baud,
        "bits": bus.rate.bits,
        "lanes": bus.medium.lanes,
        "seed": bus.medium.seed,
        "nodes": [
            {"address": at.address, "kind": at.kind, "settings": dict(sorted(at.settings.items()))}
            for at, _ in hosted.configured
        ],
    }


def _text(stored: Mapping[str, object]) -> str:
    return json.dumps(stored, separators=(",", ":"))


def _watch(watchers: list[_W], watcher: _W) -> Callable[[], object]:
    """Have a watcher told; what is given ends that."""
    watchers.append(watcher)
    return partial(watchers.remove, watcher)
