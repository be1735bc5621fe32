"""A bus in virtual time in the hands of a test: it says when time passes, and what must come of it.

Owns the two ways in which time passes. A plain test moves the kernel itself (:meth:`run_for`,
:meth:`until`, :meth:`expect`, :meth:`send`); in an async test the loop does whenever the test
awaits, so what would move it behind the loop's back is refused there. What a failure is told with
is owned too: :meth:`told`.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine, Mapping
from contextlib import suppress
from types import TracebackType
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Self, TypeVar

from sacbus.bus import Fault, fault_from
from sacbus.bus.fault import FaultOn
from sacbus.host import VirtualLoop
from sacbus.hosted import HostedBus
from sacbus.kernel import SECOND, Kernel, Ns
from sacbus.mother import Acknowledged, BadRequest, Mother, MotherError, SacMaster, Sent
from sacbus.node import Report
from sacbus.scenario.bench import Bench, hosted_bench
from sacbus.scenario.expectations import Expectation
from sacbus.scenario.judges import judge
from sacbus.scenario.quantity import nanoseconds
from sacbus.scenario.tape import Tape
from sacbus.testing.node import VirtualNode, state_words
from sacbus.testing.wanted import wanted
from sacbus.trace import Track

if TYPE_CHECKING:
    from sacbus.testing.port import VirtualPort

__all__ = ["FaultInTest", "VirtualBus"]

_T = TypeVar("_T")

#: Nodes whose state a failure is told with; those that move, or are not as they were, first.
STATES: Final = 12

#: Reports of nodes and line that a failure is told with: the last ones.
REPORTS: Final = 8


class VirtualBus:
    """A bus and its nodes in virtual time.

    ::

        def test_a_move(bus):
            bus.send(10, "m400v120")
            bus.expect(node=10, position=400, state="STANDBY", within="5 s")

        @pytest.mark.asyncio
        async def test_the_same(bus, mother):
            await mother.send(10, "m400v120")
            await bus.expected(node=10, position=400, state="STANDBY", within="5 s")

    Times are texts with their unit, ``"250 ms"``. Bus time begins with 0.
    """

    def __init__(
        self, hosted: HostedBus, run: Callable[[Coroutine[Any, Any, Any]], Any], tape: BinaryIO
    ) -> None:
        """``run`` runs a coroutine in the bus's time; the motion is recorded into ``tape``."""
        #: The bus itself, for all that is not here.
        self.hosted = hosted
        self._run = run
        self._kernel: Kernel = hosted.host.kernel
        self._bench: Bench = hosted_bench(hosted)
        self._tape = self._bench.tape = Tape([hosted], tape)
        self._bench.begin(0)
        bench = self._bench
        #: The master: its coroutines for async tests, its statistics for all.
        self.mother = Mother(
            self._kernel,
            bench.talk,
            rate=hosted.bus.rate,
            unsent=bench.unsent,
            arrive=self._ask,
        )
        with suppress(BadRequest):  # on a line of another protocol she hears nothing either
            hosted.check_mother()
            bench.speaker = SacMaster(self.mother.caller)
        #: All nodes by their configured addresses.
        self.nodes: Mapping[int, VirtualNode] = {
            address: VirtualNode(self, address, panel) for address, panel in bench.panels.items()
        }
        hosted.deeds.append(lambda *_: bench.stir())
        self._reports: deque[Report] = deque(maxlen=REPORTS)
        hosted.bus.report_watchers.append(self._reports.append)

    # ---- looking ----

    @property
    def now(self) -> Ns:
        """Bus time, ns."""
        return self._kernel.now

    @property
    def instant(self) -> str:
        """Bus time for people."""
        return f"{self.now / SECOND:.6f} s"

    def time(self) -> float:
        """Bus time in seconds; may stand in for ``time.monotonic``."""
        return self.now / SECOND

    def node(self, address: int) -> VirtualNode:
        """The node that is configured at ``address``; LookupError when there is none."""
        try:
            return self.nodes[address]
        except KeyError:
            have = ", ".join(map(str, self.nodes)) or "none"
            raise LookupError(f"no node {address} on this bus; its nodes: {have}") from None

    def track(self, address: int) -> Track:
        """Where a node has been until now. Read anew each time, which costs with time."""
        return self._tape.tracks(self._bench.name)[address]

    @property
    def counts(self) -> Mapping[str, int]:
        """Acks, naks, timeouts and retries of mother's, collisions and warnings."""
        return self._bench.counts()

    def told(self) -> list[str]:
        """What was last on the line, what was reported, and what the nodes are like."""
        lines = [f"at {self.instant}"]
        packets = self._bench.line.words(0)
        lines += ["last on the line:", *(f"  {one}" for one in packets or ["nothing"])]
        if self._reports:
            lines += ["last reports:"]
            lines += [f"  {one.when / SECOND:.6f} s  {one}" for one in self._reports]
        seen = [(node.address, node.snapshot) for node in self.nodes.values()]
        seen.sort(key=lambda one: one[1].state == "STANDBY" and one[1].position_steps == 0)
        lines += ["nodes:", *(f"  {state_words(*one)}" for one in seen[:STATES])]
        if len(seen) > STATES:
            lines.append(f"  and {len(seen) - STATES} more")
        return lines

    def __repr__(self) -> str:
        return f"<bus {self._bench.name!r} at {self.instant}>"

    # ---- doing ----

    def raw(self, data: bytes | str) -> None:
        """Put bytes on the line as mother, without a transaction; a text is hexadecimal."""
        self._bench.talk(bytes.fromhex(data) if isinstance(data, str) else data)

    def fault(self, fault: Fault | None = None, /, **words: object) -> FaultInTest:
        """Put a fault on the line, until it is taken :meth:`off` or its ``with`` block ends.

        A value of ``sacbus.bus``, or the words of a scenario: ``fault(bit_errors=1e-4)``.
        FaultError for what is none.
        """
        return FaultInTest(self.hosted.fault(fault_from(words) if fault is None else fault))

    def serial(self, *, baud: int | None = None, timeout: float | None = 1.0) -> VirtualPort:
        """A serial port on this line, of pyserial's shape, for a plain test.

        Its reads and its ``flush`` let bus time pass. ``baud`` other than the line's: garbage.
        """
        from sacbus.testing.port import VirtualPort  # noqa: PLC0415 (pyserial is for this alone)

        return VirtualPort(self.hosted, self._step, baud=baud, timeout=timeout)

    # ---- time, in a plain test ----

    def run_for(self, time: str) -> None:
        """Let ``time`` pass."""
        self._kernel_alone("await asyncio.sleep(...)").run_until(self.now + nanoseconds(time))

    def sleep(self, seconds: float) -> None:
        """Let seconds pass; may stand in for ``time.sleep``."""
        self._kernel_alone("await asyncio.sleep(...)").run_until(self.now + round(seconds * SECOND))

    def until(self, condition: Callable[[], object], *, within: str) -> None:
        """Let time pass until ``condition()`` is true; AssertionError when it is not in time.

        It is asked at each event of the bus, and a millisecond after the last time at the latest.
        """
        __tracebackhide__ = True
        self._kernel_alone("await bus.reached(...)")
        limit = self.now + nanoseconds(within)
        while not condition():
            if self.now >= limit:
                raise _never(condition, within)
            self._step(min(limit, self.now + self._bench.look))

    def expect(self, expected: Expectation | None = None, /, **keys: object) -> None:
        """Let time pass until what is expected has come; AssertionError when it does not.

        A value of ``sacbus.scenario``, or the keys of a scenario's ``expect``, with ``from_`` and
        ``for_`` for Python's own words: ``expect(node=10, position=400, within="3 s")``.
        ConfigError for what cannot be expected.
        """
        __tracebackhide__ = True
        self._kernel_alone("await bus.expected(...)")
        one = self._wanted(expected, keys)
        came: list[str | None] = []
        judge(one, self._bench, came.append).begin(self.now)
        while not came:
            self._step()
        self._settle(one, came[0])

    def send(self, node: int, line: str, *, accept_duplicates: bool = False) -> Acknowledged:
        """Send a line to a node as mother and wait for its answer; errors as of ``Mother.send``.

        BadRequest on a bus of another protocol than hers.
        """
        outcome = self._outcome(
            lambda done: self.mother.caller.call(
                node, line.encode("latin-1"), done, accept_duplicates=accept_duplicates
            )
        )
        assert isinstance(outcome, Acknowledged), "only a broadcast is not acknowledged"
        return outcome

    def broadcast(self, line: str) -> None:
        """Send a line to all nodes as mother, and wait until the next packet may follow."""
        self._outcome(lambda done: self.mother.caller.broadcast(line.encode("latin-1"), done))

    def run(self, main: Coroutine[Any, Any, _T]) -> _T:
        """Run a coroutine in this bus's time, in a test that is none."""
        try:
            self._kernel_alone("await it")
        except RuntimeError:
            main.close()
            raise
        result: _T = self._run(main)
        return result

    # ---- time, in an async test ----

    async def reached(self, condition: Callable[[], object], *, within: str) -> None:
        """As :meth:`until`, in an async test."""
        __tracebackhide__ = True
        self._loop_of_ours()
        limit = self.now + nanoseconds(within)
        while not condition():
            if self.now >= limit:
                raise _never(condition, within)
            woken = asyncio.get_running_loop().create_future()
            when = min(limit, self.now + self._bench.look)
            due = self._kernel.next_at()
            # Behind all that is due at that instant, and each instant once.
            when = when if due is None else max(min(when, due), self.now + 1)
            self._kernel.at(when, _wake, woken)
            await woken

    async def expected(self, expected: Expectation | None = None, /, **keys: object) -> None:
        """As :meth:`expect`, in an async test."""
        __tracebackhide__ = True
        self._loop_of_ours()
        one = self._wanted(expected, keys)
        came: asyncio.Future[str | None] = asyncio.get_running_loop().create_future()

        def verdict(got: str | None) -> None:
            if not came.done():
                came.set_result(got)

        judge(one, self._bench, verdict).begin(self.now)
        self._settle(one, await came)

    # ---- inside ----

    def close(self) -> None:
        """End the recording; the bus is its host's to close. RecordingCutOff if it is not whole."""
        recorder = self._tape.recorder
        recorder.close()
        if recorder.fault is not None:
            raise recorder.fault

    def _wanted(self, expected: Expectation | None, keys: Mapping[str, object]) -> Expectation:
        return wanted(expected, keys, self.hosted.configuration)

    def _settle(self, one: Expectation, got: str | None) -> None:
        __tracebackhide__ = True
        if got is not None:
            self._tape.failed(str(one), got, "", self._bench.name)
            raise AssertionError(f"expected {one}, got {got}, at {self.instant}")

    def _outcome(
        self, ask: Callable[[Callable[[Acknowledged | Sent | MotherError], None]], None]
    ) -> Acknowledged | Sent:
        __tracebackhide__ = True
        self.hosted.check_mother()
        self._kernel_alone("await mother.send(...) or mother.broadcast(...)")
        came: list[Acknowledged | Sent | MotherError] = []
        ask(came.append)
        while not came:
            self._step()
        outcome = came[0]
        if isinstance(outcome, MotherError):
            raise outcome
        return outcome

    def _step(self, limit: Ns | None = None) -> None:
        """Run all events of the next instant that has any, or go to ``limit`` if it comes first."""
        when = self._kernel.next_at()
        if limit is not None and (when is None or when > limit):
            when = limit
        assert when is not None, "whoever waits for the bus has appointed the end of the wait"
        self._kernel.run_until(when)

    def _kernel_alone(self, instead: str) -> Kernel:
        """The kernel, for who moves it; RuntimeError where a loop does that."""
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return self._kernel
        raise RuntimeError(f"in an async test time passes while it is awaited: {instead}")

    def _loop_of_ours(self) -> None:
        loop = asyncio.get_running_loop()
        if not isinstance(loop, VirtualLoop) or loop.kernel is not self._kernel:
            raise RuntimeError(
                "this loop is not in the bus's time: let the async test itself have the fixture "
                "bus among its arguments, or run the coroutine with bus.run(...)"
            )

    def _ask(self, callback: Callable[..., object], *arguments: object) -> None:
        """Mother's coroutines: in another loop their answers would never come."""
        self._loop_of_ours()
        callback(*arguments)


class FaultInTest:
    """A fault that is on the line. ``count``: how often it has acted."""

    def __init__(self, on: FaultOn) -> None:
        self._on = on

    @property
    def count(self) -> int:
        """How often it has acted, in its own terms: bits, bytes, transmissions."""
        return self._on.count

    def off(self) -> None:
        """Take it off. May be called again."""
        self._on.off()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _fault: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self.off()


def _wake(woken: asyncio.Future[None]) -> None:
    if not woken.done():
        woken.set_result(None)


def _never(condition: Callable[[], object], within: str) -> AssertionError:
    name = getattr(condition, "__name__", "")
    what = "what is waited for" if name in ("", "<lambda>") else name
    return AssertionError(f"{what} did not come within {within}")
