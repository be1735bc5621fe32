"""Whether what is expected comes: one judge for each kind of expectation.

Owns when a judge looks and when it has seen enough. A judge is begun once and calls its ``verdict``
once, with nothing if all is as expected, and with what came otherwise. Synchronous; the bench's
clock is all the time it knows.

What a node does tells nobody when it changes, so while it moves it is looked at each millisecond,
when the node itself wants to wake, and when the time is over: the end of a command is seen at its
very instant, a position that is passed at speed only if it lies in bounds for a millisecond. While
it rests it is looked at when something is said on the line or done to a node.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final, assert_never
from typing import Protocol as Contract

from sacbus.bus.duration import time_text
from sacbus.kernel import MS, Ns
from sacbus.node import Said
from sacbus.panel import Panel
from sacbus.scenario.bench import Bench
from sacbus.scenario.expectations import (
    VELOCITY_SLACK,
    Counted,
    Expectation,
    NodeIs,
    PacketSeen,
    Shown,
    Silent,
    Straight,
    Together,
    count_words,
)
from sacbus.scenario.line import Passed
from sacbus.scenario.motion import deviation, start_skew
from sacbus.scenario.quantity import Bounds
from sacbus.trace import RESTS

__all__ = ["Judge", "judge"]

#: How often a node that rests is looked at all the same: somebody may type at its terminal who is
#: not in the scenario.
REST: Final[Ns] = 100 * MS

Verdict = Callable[[str | None], None]


class Judge(Contract):
    """Looks for what is expected, from :meth:`begin` on."""

    def begin(self, since: Ns) -> None:
        """Begin; the expectation's time 0 was ``since``, which in real time may be a little ago."""
        ...


def judge(expected: Expectation, bench: Bench, verdict: Verdict) -> Judge:
    """The judge of an expectation; ``verdict`` is called with None, or with what came instead."""
    match expected:
        case NodeIs():
            return _Looks(bench, verdict, expected, _NodeLook(bench, expected))
        case Counted():
            return _Looks(bench, verdict, expected, _CountLook(bench, expected))
        case Shown():
            return _Looks(bench, verdict, expected, _ShownLook(bench, expected))
        case Together() | Straight():
            return _MotionJudge(bench, verdict, expected)
        case PacketSeen():
            return _PacketJudge(bench, verdict, expected)
        case Silent():
            return _SilenceJudge(bench, verdict, expected)
        case _:
            assert_never(expected)


class _Look(Contract):
    """One look. It is taken often and told of once, so its words are made only then."""

    def fits(self) -> bool:
        """Whether all is as expected."""
        ...

    def got(self) -> str:
        """What there is instead."""
        ...

    def next_at(self) -> Ns | None:
        """When something changes next at the latest, if that is known."""
        ...

    def rests(self) -> bool:
        """Whether nothing can change before something is done to a node, or said on the line."""
        ...


class _Looks:
    """Looks again and again: until it fits, or, with ``lasting``, for as long as it must."""

    def __init__(
        self, bench: Bench, verdict: Verdict, timed: NodeIs | Counted | Shown, look: _Look
    ) -> None:
        self._bench = bench
        self._verdict = verdict
        self._look = look
        self._lasting: Ns = 0 if isinstance(timed, Shown) else timed.lasting
        self._span: Ns = self._lasting or timed.within
        self._until: Ns = 0
        #: The number of the appointment that counts.
        self._turn = 0
        self._resting = False

    def begin(self, since: Ns) -> None:
        self._until = since + self._span
        self._bench.stirred.append(self._stir)
        self._see(0)

    def _stir(self) -> None:
        """Something was done or said: look once that is over, if nothing else would bring it."""
        if self._resting:
            self._resting = False
            self._turn += 1
            self._bench.clock.at(self._bench.clock.now, self._see, self._turn)

    def _see(self, turn: int) -> None:
        if turn != self._turn:
            return
        clock = self._bench.clock
        now = clock.now
        fits = self._look.fits()
        if fits is not bool(self._lasting) or now >= self._until:
            self._turn += 1
            self._bench.stirred.remove(self._stir)
            self._verdict(None if fits else self._look.got())
            return
        self._resting = self._look.rests()
        when = now + (REST if self._resting else self._bench.look)
        changes = self._look.next_at()
        if changes is not None and now < changes < when:
            when = changes
        self._turn += 1
        clock.at(min(when, self._until), self._see, self._turn)


class _NodeLook:
    def __init__(self, bench: Bench, expected: NodeIs) -> None:
        self._clock = bench.clock
        self._panels = {address: bench.panels[address] for address in expected.nodes}
        self._late = self._panels[expected.nodes[0]]
        self._expected = expected
        velocity = expected.velocity
        if velocity is not None and velocity.low == velocity.high:
            velocity = Bounds(velocity.low - VELOCITY_SLACK, velocity.high + VELOCITY_SLACK)
        self._velocity = velocity

    def fits(self) -> bool:
        now = self._clock.now
        # Of many that are waited for it is mostly the same one that is late.
        if not self._is_so(self._late, now):
            return False
        for panel in self._panels.values():
            if not self._is_so(panel, now):
                self._late = panel
                return False
        return True

    def got(self) -> str:
        now = self._clock.now
        return "; ".join(
            self._words(address, panel)
            for address, panel in self._panels.items()
            if not self._is_so(panel, now)
        )

    def _is_so(self, panel: Panel, now: Ns) -> bool:
        expected = self._expected
        node = panel.node
        # The state alone costs a fraction of a snapshot.
        if expected.state is not None and node.state(now) != expected.state:
            return False
        if expected.position is None and self._velocity is None and not expected.pins:
            return True
        seen = node.snapshot(now)
        return (
            (expected.position is None or seen.position_steps in expected.position)
            and (self._velocity is None or seen.rpm in self._velocity)
            and all(panel.level(pin) == level for pin, level in expected.pins.items())
        )

    def next_at(self) -> Ns | None:
        times = [panel.node.wake_at() for panel in self._panels.values()]
        return min((one for one in times if one is not None), default=None)

    def rests(self) -> bool:
        now = self._clock.now
        return all(
            panel.node.wake_at() is None and panel.node.state(now) in RESTS
            for panel in self._panels.values()
        )

    def _words(self, address: int, panel: Panel) -> str:
        expected = self._expected
        seen = panel.node.snapshot(self._clock.now)
        parts = []
        if expected.position is not None:
            parts.append(f"position {seen.position_steps:g}")
        if self._velocity is not None:
            parts.append(f"velocity {seen.rpm:g}")
        parts += [f"{pin} {panel.level(pin)}" for pin in expected.pins]
        who = f"node {address}: " if len(self._panels) > 1 else ""
        return f"{who}{', '.join([*parts, f'state {seen.state}'])}"


class _CountLook:
    def __init__(self, bench: Bench, expected: Counted) -> None:
        self._bench = bench
        self._expected = expected

    def fits(self) -> bool:
        counts = self._bench.counts(self._expected.nodes)
        return all(counts[name] in bounds for name, bounds in self._expected.counts.items())

    def got(self) -> str:
        counts = self._bench.counts(self._expected.nodes)
        return count_words({name: counts[name] for name in self._expected.counts})

    def next_at(self) -> Ns | None:
        return None

    def rests(self) -> bool:
        return False


class _ShownLook:
    def __init__(self, bench: Bench, expected: Shown) -> None:
        self._shown = bench.listen(expected.node)
        self._text = expected.text.encode("latin-1", "replace")

    def fits(self) -> bool:
        at = self._shown.find(self._text)
        if at < 0:
            return False
        del self._shown[: at + len(self._text)]
        return True

    def got(self) -> str:
        return repr(self._shown[-200:].decode("latin-1"))

    def next_at(self) -> Ns | None:
        return None

    def rests(self) -> bool:
        return False


class _MotionJudge:
    """Asks the recording once, for what was until then."""

    def __init__(self, bench: Bench, verdict: Verdict, expected: Together | Straight) -> None:
        self._bench = bench
        self._verdict = verdict
        self._expected = expected

    def begin(self, since: Ns) -> None:
        bench, expected = self._bench, self._expected
        assert bench.tape is not None, "a bus is recorded whose motion is looked at"
        found = bench.tape.tracks(bench.name)
        tracks = {node: found[node] for node in expected.nodes}
        match expected:
            case Together(most=most):
                self._verdict(self._together(start_skew(tracks, since), most))
            case Straight(most=farthest):
                away = deviation(tracks, since)
                if away is None:
                    self._verdict("no motion")
                else:
                    self._verdict(None if away <= farthest else f"{away:.3f} steps")

    def _together(self, found: tuple[Ns, dict[int, Ns]] | None, most: Ns) -> str | None:
        if found is None:
            return "one that has not moved"
        skew, starts = found
        if skew <= most:
            return None
        first = min(starts.values())
        later = ", ".join(f"{node} +{time_text(at - first)}" for node, at in starts.items())
        return f"{time_text(skew)} ({later})"


class _PacketJudge:
    """Packets that end from now on, as they arrive; a pattern is matched against the whole body."""

    def __init__(self, bench: Bench, verdict: Verdict, expected: PacketSeen) -> None:
        self._bench = bench
        self._verdict = verdict
        self._expected = expected
        protocol = bench.line.protocol
        self._tell = protocol.tell
        self._patience = protocol.patience(bench.span(1))
        self._decoders = [protocol.decoder(lane) for lane in (0, 1)]
        #: When what was last on each lane ended.
        self._heard_until: list[Ns] = [0, 0]
        self._pattern = None if expected.pattern is None else re.compile(expected.pattern)
        self._seen = 0
        self._others = 0
        self._over = False

    def begin(self, since: Ns) -> None:
        line = self._bench.line
        line.watchers.append(self._passed)
        self._bench.clock.at(since + self._expected.within, self._late)
        for passed in line.tail:
            if passed.end > since and not self._over:
                self._passed(passed)

    def _passed(self, passed: Passed) -> None:
        lane = passed.lane
        silence, self._heard_until[lane] = passed.start - self._heard_until[lane], passed.end
        if self._patience is not None and silence >= self._patience:
            self._decoders[lane] = self._bench.line.protocol.decoder(lane)
        for event in self._decoders[lane].receive(passed.data, passed.ninth):
            if self._fits(self._tell(event)):
                self._seen += 1
                if self._seen == self._expected.count:
                    self._end(None)
                    return
            else:
                self._others += 1

    def _fits(self, said: Said) -> bool:
        wanted = self._expected
        return (
            said.kind == wanted.kind
            and wanted.source in (None, said.source)
            and wanted.destination in (None, said.destination)
            and wanted.body in (None, said.data)
            and (self._pattern is None or self._pattern.fullmatch(said.body) is not None)
        )

    def _late(self) -> None:
        others = f"{self._others} others" if self._others else "nothing else"
        seen = f"{self._seen} of it" if self._seen else "none"
        self._end(f"{seen} and {others}")

    def _end(self, got: str | None) -> None:
        if not self._over:
            self._over = True
            self._bench.line.watchers.remove(self._passed)
            self._verdict(got)


class _SilenceJudge:
    """Nothing begins, or goes on, from now on. What is on the line at the end is waited for."""

    def __init__(self, bench: Bench, verdict: Verdict, expected: Silent) -> None:
        self._bench = bench
        self._verdict = verdict
        self._expected = expected
        self._until: Ns = 0
        self._over = False

    def begin(self, since: Ns) -> None:
        clock = self._bench.clock
        self._until = since + self._expected.lasting
        self._bench.line.watchers.append(self._passed)
        clock.at(self._until, self._end_of_time)

    def _passed(self, passed: Passed) -> None:
        source = self._expected.source
        # What faults left nothing of has not been on the line.
        if passed.data and passed.start < self._until and source in (None, passed.sender):
            self._end(f"{len(passed.data)} bytes of {passed.sender}")

    def _end_of_time(self) -> None:
        clock = self._bench.clock
        if not self._over and self._bench.busy(clock.now):
            clock.at(clock.now + self._bench.span(1), self._end_of_time)
            return
        self._end(None)

    def _end(self, got: str | None) -> None:
        if not self._over:
            self._over = True
            self._bench.line.watchers.remove(self._passed)
            self._verdict(got)
