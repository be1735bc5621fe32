"""A scenario as it is played: which step begins when, and what becomes of each.

Owns the order of the steps and the gathering of failures. Synchronous: it is called by the clock of
its benches, the same in virtual time, in real time and over a link; ``run.py`` moves that clock.

A step begins by an event of its own, after whatever made it begin has been dealt with to its end.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial

from sacbus.bus import FaultOn
from sacbus.kernel import SECOND, Ns
from sacbus.mother.masters import Came
from sacbus.scenario.asking import Polling, outcome_of
from sacbus.scenario.bench import Bench
from sacbus.scenario.expectations import Counted, Shown
from sacbus.scenario.judges import judge
from sacbus.scenario.result import Failure, Met, Result
from sacbus.scenario.values import (
    Disturb,
    Lift,
    Mark,
    Pause,
    Pin,
    Poll,
    Power,
    Raw,
    Scenario,
    Send,
    Step,
    Turn,
    Type,
)

__all__ = ["Play", "predecessors"]


def predecessors(steps: tuple[Step, ...]) -> list[int | None]:
    """By step, that whose end it waits for; None: it begins by the clock or with the play.

    A name is that of the nearest step above; or else of the first one below.
    """
    named: dict[str, list[int]] = {}
    for index, step in enumerate(steps):
        if step.name:
            named.setdefault(step.name, []).append(index)
    above: dict[str, int] = {}
    found: list[int | None] = []
    for index, step in enumerate(steps):
        if step.at is not None:
            found.append(None)
        elif not isinstance(step.after, str):
            found.append(index - 1 if index else None)
        elif step.after in above:
            found.append(above[step.after])
        else:
            below = (other for other in named.get(step.after, ()) if other != index)
            found.append(next(below, None))
        if step.name:
            above[step.name] = index
    return found


class Play:
    """One run of a scenario on its benches, by the names of the buses; the first is the default."""

    def __init__(self, scenario: Scenario, benches: Mapping[str, Bench]) -> None:
        self.result = Result(scenario)
        self.over = False
        #: Called once, when it is over.
        self.when_over: Callable[[], object] | None = None
        self._scenario = scenario
        self._benches = benches
        self._first = next(iter(benches.values()))
        self._clock = self._first.clock
        self._origin: Ns = 0
        self._followers: defaultdict[int, list[int]] = defaultdict(list)
        #: The faults that are on, by the names of the steps that put them on.
        self._faults: defaultdict[str, list[FaultOn]] = defaultdict(list)
        self._open = set(range(len(scenario.steps)))
        #: Polls that go on to the end.
        self._background: set[int] = set()

    def begin(self) -> None:
        """Time 0 is now."""
        self._origin = self.result.origin = self._clock.now
        for bench in self._benches.values():
            bench.begin(self._origin)
        steps = self._scenario.steps
        for index, (step, before) in enumerate(zip(steps, predecessors(steps), strict=True)):
            for deed in (step.does, step.after):
                if isinstance(deed, Shown):
                    self._bench(deed.bus).listen(deed.node)
            if before is not None:
                self._followers[before].append(index)
            else:
                begin = self._origin + (step.at or 0) + step.wait
                self._clock.at(begin, self._meet, index, begin)
        if self._scenario.end is not None:
            self._clock.at(self._origin + self._scenario.end, self._end)
        elif not steps:
            self._end()

    # ---- the order of steps ----

    def _meet(self, index: int, since: Ns) -> None:
        """A step's time has come, which was ``since``; what it waits for first may not have."""
        if self.over:
            return
        step = self._scenario.steps[index]
        if step.after is None or isinstance(step.after, str):
            self._do(index, since)
            return

        def met(got: str | None) -> None:
            if got is None:
                now = self._clock.now
                self._clock.at(now, self._do, index, now)
            else:
                self._settle(index, str(step.after), got)

        judge(step.after, self._bench(step.after.bus), met).begin(since)

    def _do(self, index: int, since: Ns) -> None:
        if self.over:
            return
        step = self._scenario.steps[index]
        match step.does:
            case Send() as send:
                self._send(index, send, 0)
            case Poll() as poll:
                self._begin_poll(index, poll)
            case Raw(data, bus, ninth):
                bench = self._bench(bus)
                bench.say(data, ninth)
                self._out_at(self._clock.now + bench.span(len(data)), index, bench)
            case Disturb(fault, bus):
                hosted = self._bench(bus).hosted
                assert hosted is not None, "the rules have looked"
                self._faults[step.name].append(hosted.fault(fault))
                self._settle(index)
            case Lift(name):
                for on in self._faults.pop(name, ()):
                    on.off()
                self._settle(index)
            case Mark(text):
                if self._first.tape is not None:
                    self._first.tape.recorder.mark(text)
                self._settle(index)
            case Pause():
                self._settle(index)
            case Type() | Pin() | Turn() | Power() as deed:
                self._handle(deed)
                self._settle(index)
            case expected:
                self.result.expectations += 1
                wanted = str(expected)
                verdict = partial(self._settle, index, wanted)
                judge(expected, self._bench(expected.bus), verdict).begin(since)

    def _handle(self, deed: Type | Pin | Turn | Power) -> None:
        bench = self._bench(deed.bus)
        for address in deed.nodes:
            panel = bench.panels[address]
            match deed:
                case Type(keys=keys):
                    assert panel.console is not None, "the rules have looked for a terminal"
                    panel.console.type(keys)
                case Pin(levels=levels):
                    for pin, level in levels.items():
                        panel.drive(pin, level)
                case Turn(detents=detents):
                    panel.turn(detents)
                case Power(on=on):
                    panel.power(on=on)
        bench.stir()

    def _settle(
        self, index: int, expected: str = "", got: str | None = None, at: Ns | None = None
    ) -> None:
        """A step is over, and what came of it if that was not as expected.

        ``at``: when it was over, if that has been noticed late, as in real time it is.
        """
        if index not in self._open or self.over:
            return
        if got is not None:
            self._fail(index, expected, got)
        elif expected:
            step = self._scenario.steps[index]
            when = self._clock.now - self._origin
            self.result.looked.append(Met(when, expected, step.name, step.place))
        self._open.discard(index)
        self._release(index, self._clock.now if at is None else at)

    def _release(self, index: int, at: Ns) -> None:
        for follower in self._followers[index]:
            begin = at + self._scenario.steps[follower].wait
            self._clock.at(begin, self._meet, follower, begin)
        if self._open <= self._background and self._scenario.end is None:
            self._clock.at(at, self._end)

    def _end(self) -> None:
        if self.over:
            return
        for index in sorted(self._open - self._background):
            what = self._scenario.steps[index].does
            self._fail(index, f"{_called(what)} to be over by the end", "that it was not")
        self.over = True
        self.result.ended = self._clock.now - self._origin
        self.result.counts = {name: bench.counts() for name, bench in self._benches.items()}
        self.result.nodes = {
            (name, address): panel.snapshot()
            for name, bench in self._benches.items()
            for address, panel in bench.panels.items()
        }
        if self.when_over is not None:
            self.when_over()

    def _fail(self, index: int, expected: str, got: str) -> None:
        step = self._scenario.steps[index]
        bench = self._bench(getattr(step.does, "bus", ""))
        failure = Failure(
            self._clock.now - self._origin,
            expected,
            got,
            step.name,
            step.place,
            bench.line.words(self._origin),
            self._states(bench, step.does),
        )
        self.result.failures.append(failure)
        self.result.looked.append(failure)
        if bench.tape is not None:
            bench.tape.failed(expected, got, step.name, bench.name)

    def _states(self, bench: Bench, deed: object) -> tuple[str, ...]:
        """The nodes that a step is about, as they are now; the last warnings if it counts them."""
        nodes = getattr(deed, "nodes", None) or ()
        found = []
        if isinstance(deed, Counted) and "warnings" in deed.counts:
            for when, text in bench.warned:
                found.append(f"{(when - self._origin) / SECOND:.6f} s  {text}")
        for address in nodes[:4]:
            if address in bench.panels:
                seen = bench.panels[address].snapshot()
                command = f", {seen.current}" if seen.current else ""
                found.append(
                    f"node {address}: {seen.state} at {seen.position_steps:g}, "
                    f"{seen.rpm:g} RPM{command}"
                )
        return tuple(found)

    def _bench(self, name: str) -> Bench:
        return self._benches[name] if name else self._first

    # ---- the master ----

    def _send(self, index: int, send: Send, number: int) -> None:
        bench = self._bench(send.bus)
        line = send.lines[number]

        def done(came: Came) -> None:
            if self.over:
                return
            self._record(bench, came)
            wanted = ""
            if send.outcome not in ("any", outcome_of(came)):
                wanted = f"{line!r} to end in {send.outcome}"
            elif send.says is not None and came.words != send.says:
                wanted = f"{line!r} to be answered {send.says!r}"
            if wanted:
                # A little later, when the answer is in the tail of the line too.
                self._clock.at(self._clock.now, self._settle, index, wanted, str(came))
            elif number + 1 < len(send.lines):
                self._send(index, send, number + 1)
            else:
                self._settle(index)

        bench.master.ask(line, done, accept_duplicates=send.accept_duplicates)

    def _record(self, bench: Bench, came: Came) -> None:
        if bench.tape is None:
            return
        bench.tape.recorder.outcome(
            came.line.node,
            came.line.command.encode("latin-1"),
            came.outcome,
            came.attempts,
            bus=bench.tape.number(bench.name),
        )

    def _begin_poll(self, index: int, poll: Poll) -> None:
        failed, over = partial(self._poll_failed, index), partial(self._settle, index)
        polling = Polling(self._bench(poll.bus), poll, failed, over)
        if poll.lasting is None:
            self._background.add(index)
        polling.begin(lambda: not self.over)
        if poll.lasting is None:
            self._release(index, self._clock.now)

    def _poll_failed(self, index: int, expected: str, got: str) -> None:
        if not self.over:
            self._fail(index, expected, got)

    def _out_at(self, when: Ns, index: int, bench: Bench) -> None:
        """Raw bytes should be out then; they are not while the line was taken."""

        def out() -> None:
            now = self._clock.now
            if waiting := bench.unsent():
                self._out_at(now + bench.span(waiting), index, bench)
            elif bench.busy(now):
                self._out_at(now + bench.span(1), index, bench)
            else:
                self._settle(index, at=when)

        self._clock.at(when, out)


def _called(deed: object) -> str:
    """What a step is called where it has not come about."""
    match deed:
        case Send(lines=lines) | Poll(lines=lines):
            return f"{lines[0]!r}"
        case Raw() | Type() | Pin() | Turn() | Power() | Disturb() | Lift() | Pause() | Mark():
            return f"the {type(deed).__name__.lower()}"
        case _:
            return str(deed)
