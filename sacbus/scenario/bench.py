"""One bus of a scenario as it is played on: its master, the line, what can be done to its nodes.

Owns the difference between a bus that is hosted here, whether in virtual or real time, and one at
the far end of a link, of which only the line can be seen.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from typing import Final

from sacbus.bus import Port
from sacbus.bus.transmission import Transmission
from sacbus.hosted import HostedBus
from sacbus.kernel import MS, LineRate, Ns
from sacbus.links import Line as Link
from sacbus.mother import Clock
from sacbus.mother.masters import Master, find_master
from sacbus.node import Heard, Protocol, Report, ReportKind
from sacbus.panel import Panel
from sacbus.scenario.line import Line, Passed
from sacbus.scenario.tape import Tape

__all__ = ["Bench", "far_bench", "hosted_bench", "piped_bench"]

#: How often something is looked at that tells nobody when it changes.
LOOK: Final[Ns] = 1 * MS

#: Warnings that are kept in words.
KEPT: Final = 4


#: What counts as a warning: what was not obeyed, or perhaps not as it was meant.
_WARN: Final = (ReportKind.WARNING, ReportKind.REFUSED, ReportKind.OVERRUN)


class Bench:
    """One bus under a scenario. Everything is called at the time of ``clock``.

    ``talk`` puts bytes on the line as they are, ``say`` does so with ninth bits; ``unsent``, where
    it can be known, tells how many of them wait for it. ``slack`` is the master's, for answers.
    ``hosted`` is None where only the line is there.
    """

    def __init__(
        self,
        name: str,
        clock: Clock,
        protocol: Protocol,
        rate: LineRate,
        talk: Callable[[bytes], None],
        say: Callable[[bytes, bytes | None], None],
        *,
        slack: Ns | None = None,
        unsent: Callable[[], int] | None = None,
    ) -> None:
        self.name = name
        self.clock = clock
        self.line = Line(protocol)
        self.talk = talk
        self.say = say
        self.span = rate.span
        #: Who speaks to the nodes; None as long as nobody has been asked to.
        self.speaker: Master | None = None
        self._protocol = protocol
        self._rate = rate
        self._slack = slack
        self._unsent = unsent
        #: Why the line is gone; None while it is there.
        self._lost: str | None = None
        self.hosted: HostedBus | None = None
        self.look: Ns = LOOK
        #: By the addresses of the configuration, whatever a node is called by now.
        self.panels: dict[int, Panel] = {}
        #: Called after something was said on the line, or done to nodes.
        self.stirred: list[Callable[[], object]] = []
        self.shown: dict[int, bytearray] = {}
        self.warnings: Counter[int | None] = Counter()
        #: The last of them in words, with the time of each.
        self.warned: deque[tuple[Ns, str]] = deque(maxlen=KEPT)
        self.origin: Ns = 0
        #: What is recorded of it; None where nothing is.
        self.tape: Tape | None = None
        self._collided_before = 0

    @property
    def master(self) -> Master:
        """Who speaks to the nodes: made when first asked for, since bytes alone take no master."""
        if self.speaker is None:
            kind = find_master(self._protocol.name)
            assert kind is not None, "the rules have looked for a master"
            self.speaker = kind.create(
                self.clock, self.say, self._rate, slack=self._slack, unsent=self._unsent
            )
            if self._lost is not None:
                self.speaker.lose(self._lost)
        return self.speaker

    def unsent(self) -> int:
        """How many bytes wait for the line; 0 where that cannot be known."""
        return 0 if self._unsent is None else self._unsent()

    def hear(self, data: bytes) -> None:
        """The master hears what nodes say."""
        if self.speaker is not None:
            self.speaker.hear(data)

    def lose(self, why: str) -> None:
        """The master's line is gone."""
        self._lost = why
        if self.speaker is not None:
            self.speaker.lose(why)

    def begin(self, origin: Ns) -> None:
        """The scenario begins now, which is its time 0."""
        self.origin = origin
        self._collided_before = self._collided()

    def stir(self) -> None:
        """Something was said or done: who waits for what may come of it looks again."""
        for stirred in tuple(self.stirred):
            stirred()

    def counts(self, nodes: tuple[int, ...] | None = None) -> dict[str, int]:
        """What has been counted of these nodes, or of all, since the beginning."""
        table = {} if self.speaker is None else self.speaker.statistics
        chosen = [one for address, one in table.items() if nodes is None or address in nodes]
        if nodes is None:
            warnings = self.warnings.total()
        else:
            warnings = sum(self.warnings[address] for address in nodes)
        return {
            "acks": sum(one.acks for one in chosen),
            "naks": sum(one.naks for one in chosen),
            "timeouts": sum(one.timeouts for one in chosen),
            "retries": sum(one.retries for one in chosen),
            "collisions": self._collided() - self._collided_before,
            "warnings": warnings,
        }

    def busy(self, now: Ns) -> bool:
        """Whether anything is on the line; False where that cannot be known."""
        if self.hosted is None:
            return False
        medium = self.hosted.bus.medium
        return any((medium.free_at(lane) or 0) > now for lane in range(medium.lanes))

    def listen(self, address: int) -> bytearray:
        """What a terminal has shown since the last that was taken from here."""
        shown = self.shown.get(address)
        if shown is None:
            shown = self.shown[address] = bytearray()
            console = self.panels[address].console
            assert console is not None, "the rules have looked for a terminal"
            console.watch(shown.extend)
        return shown

    def _collided(self) -> int:
        if self.hosted is None:
            return 0
        medium = self.hosted.bus.medium
        return sum(medium.counters(lane).collided for lane in range(medium.lanes))


def hosted_bench(hosted: HostedBus) -> Bench:
    """A bus in this process, with its master at no distance from its line."""
    kernel, bus = hosted.host.kernel, hosted.bus

    def hear(heard: Heard, _now: Ns) -> None:
        bench.hear(heard.data)

    port = Port(bus.medium, hear, latency=0, name="mother")

    def say(data: bytes, ninth: bytes | None) -> None:
        port.talk(data, 0 if ninth is None else ninth)

    bench = Bench(
        bus.name, kernel, bus.protocol, bus.rate, port.talk, say, unsent=lambda: port.unsent
    )
    _watch(bench, hosted)
    return bench


def piped_bench(hosted: HostedBus, link: Link, slack: Ns) -> Bench:
    """A bus in this process, with its master at the far end of one of its links, in real time."""
    kernel, bus = hosted.host.kernel, hosted.bus
    # The link's end is a pty, which has no ninth bits: where there are some, bytes get on the line
    # beside it, all of them, for a stop bit of 1 stands in that place of a pty's.
    beside = Port(bus.medium, _deaf, latency=0, name="mother")
    nine = bus.rate.nine

    def send(data: bytes) -> None:
        say(data, None)

    def say(data: bytes, ninth: bytes | None) -> None:
        if nine:
            hosted.host.arrive(beside.talk, data, 0 if ninth is None else ninth)
        else:
            link.send(data)

    bench = Bench(bus.name, kernel, bus.protocol, bus.rate, send, say, slack=slack)
    _watch(bench, hosted)
    link.start(
        lambda data: hosted.host.arrive(bench.hear, data),
        lambda why: hosted.host.arrive(bench.lose, why),
    )
    return bench


def far_bench(
    name: str, clock: Clock, protocol: Protocol, link: Link, rate: LineRate, slack: Ns
) -> Bench:
    """A line at the far end of a link: what comes back is all that can be seen of it.

    On a line with ninth bits the link must be one that can mark bytes.
    """
    nine = rate.nine

    def send(data: bytes) -> None:
        say(data, None)

    def hear(data: bytes) -> None:
        now = clock.now
        begun = max(now - rate.span(len(data)), 0)
        bench.line.note(Passed(begun, now, protocol.lanes - 1, "line", data))
        bench.hear(data)

    def say(data: bytes, ninth: bytes | None) -> None:
        if nine:
            # All of them: beside marked bytes others would have the parity of the moment.
            ninth = bytes(len(data)) if ninth is None else ninth
            link.send_marked(data, ninth)
        else:
            link.send(data)
        now = clock.now
        end = now + rate.span(len(data))
        bench.line.note(Passed(now, end, 0, "mother", data, ninth=ninth))

    bench = Bench(name, clock, protocol, rate, send, say, slack=slack)
    link.start(hear, bench.lose)
    return bench


def _deaf(_heard: Heard, _now: Ns) -> None:
    """Hears nothing."""


def _watch(bench: Bench, hosted: HostedBus) -> None:
    bus = hosted.bus
    seed = bus.medium.seed
    line = bench.line
    bench.hosted = hosted
    for at in hosted.configuration.every_node:
        bench.panels[at.address] = hosted.panel(at.address)
    named = {id(panel.node): address for address, panel in bench.panels.items()}

    def over(sent: Transmission) -> None:
        sender = sent.sender
        who = named.get(id(sender)) or str(getattr(sender, "name", "line"))
        data = sent.data
        if sent.hits is not None or sent.passage is not None:
            data = sent.outcome(seed)
        ninth = sent.outcome_ninth(seed)
        collided, faults = sent.collided, sent.faults
        line.note(Passed(sent.start, sent.end, sent.lane, who, data, collided, faults, ninth))
        bench.stir()

    def report(told: Report) -> None:
        if told.kind in _WARN:
            bench.warnings[told.address] += 1
            bench.warned.append((told.when, str(told)))

    bus.medium.watchers.append(over)
    bus.report_watchers.append(report)
