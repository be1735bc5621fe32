"""A whole node under all at once: lines on both ports, noise, pins, the encoder, power, time.

A Hypothesis state machine, held against a ledger (``ledger.py``) after every event. Whatever comes,
nothing raises, and what the manual promises holds: a command that nothing interferes with makes
exactly its steps, and nothing moves without one; at most 30 commands wait, and run in their order;
session and queue change only by the lines that change them; the line hears nothing but answers,
soft ops and what the node was told to send on; and all of it is the same when nobody looks.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from nodes.sac import SacSettings
from sacbus.bus import Transmission
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.wire import ETX, encode
from tests.language.strategies import commands, nearly_commands
from tests.nodes.sac.bench import Bench
from tests.nodes.sac.ledger import Ledger, WatchedNode

#: Commands whose motion is over soon, so that most come to their end.
short_moves = st.builds(
    "{}{}{}v{}a{}d{}{}".format,
    st.sampled_from(["m", "m", "m", "xm"]),
    st.sampled_from(["", "-"]),
    st.integers(1, 40),
    st.sampled_from([9, 60, 300, 1200]),
    st.sampled_from(["", ".5", "5", "999"]),
    st.sampled_from(["", ".5", "5", "999"]),
    st.sampled_from(["", "", "s", "u7", "u200", "p", "l1", "l0", "t5000"]),
)
#: What lets short motion interfere with itself, and single lines of every kind.
short_lines = st.sampled_from(
    [
        *("S", "s", "N", "n", "y", "g", "b", "z", "l", "la", "l2", "l0", "xl", "xd", "q", "cf"),
        *("cc", "vd", "qc", "qr", "qs", "qp", "xp", "x3", "x31", "ls2", "lf4", "ln2", "+", "-"),
        *("++-", "xp0,1", "xp1,2", "xp2,0", "q1m5v300", "q2s", "q2m0", "q3m-7v300a999d999u3"),
        *("mv60", "m-v120", "xm", "v300", "a5", "d5", "vc900", "$P", "$F", "$U", "$n", "$L1"),
        *("$L0", "$K0", "$K1", "$H0", "$H1", "$O1", "$O0", "$R", "$E", "$C", "X", "$CA3"),
        *("$CA1", "$CJ2", "$CM90", "$Ca400", "$Ci1", "$CE1", "$CC0", "85m5", "0m5", "/hello"),
        *("82q", "7", "85 hi", "/ hi", "m200 7", "\x11", ""),
    ]
)
commanded = commands.map(lambda command: command.text())
lines = st.one_of(short_moves, short_moves, short_lines, nearly_commands, commanded).filter(
    lambda line: len(line) <= 46
)
bodies = lines.map(lambda line: line.encode("latin-1", "replace"))
#: Where something changes in the device's own times, and other spans.
spans = st.sampled_from([1, 40 * US, MS, 30 * MS, SECOND]) | st.integers(1, 20 * SECOND)

#: Instants with events that a wait goes through at most: quick motion may be endless.
EVENTS = 40


@dataclass(frozen=True)
class Act:
    """What somebody did to the node, or its line, and when."""

    at: Ns
    deed: str
    what: bytes | str = b""
    level: int = 0


def do(act: Act, bench: Bench) -> None:
    """Do it, now."""
    node, now = bench.node, bench.kernel.now
    match act.deed:
        case "send":
            assert isinstance(act.what, bytes)
            bench.port.talk(act.what)
        case "type":
            assert isinstance(act.what, bytes)
            node.terminal.type(act.what, now)
        case "drive":
            assert isinstance(act.what, str)
            node.pins.drive(act.what, act.level, now)
        case "power":
            node.power(on=bool(act.level), now=now)
        case "watch":
            node.terminal.show = lambda _text: None
            if act.level:
                node.pins.watch(lambda _pin, _level, _when: None, now)
        case _:
            raise AssertionError(act)
    bench.bus.touch(node)


class WatchedBench(Bench):
    """A bench whose node has a ledger."""

    ledger: Ledger

    def add(self, address: int, settings: SacSettings) -> WatchedNode:
        node = WatchedNode(address, settings, self.bus.rate, self.bus.tell)
        self.ledger = Ledger(node, self.bus.rate.baud)
        self.bus.add(node)
        self.nodes[address] = node
        self.bus.medium.tap(self, self)
        return node

    def begun(self, sent: Transmission) -> None:
        if isinstance(sent.sender, WatchedNode):
            self.ledger.says(sent.start, sent.data)


class WholeNode(RuleBasedStateMachine):
    """One node on a bench; every rule does one thing to it."""

    @initialize(
        ustep=st.integers(0, 3),
        soft_ops=st.booleans(),
        linear=st.booleans(),
        auto=st.booleans(),
        ppm=st.sampled_from([0, 0, 50, -100_000]),
        receiver=st.sampled_from(["device", "robust"]),
        watched=st.booleans(),
    )
    def switch_on(
        self,
        ustep: int,
        soft_ops: bool,
        linear: bool,
        auto: bool,
        ppm: int,
        receiver: str,
        watched: bool,
    ) -> None:
        self.settings = SacSettings(
            ustep=ustep,
            soft_ops=soft_ops,
            linear=linear,
            auto_micro=auto,
            ppm=ppm,
            receiver=receiver,
        )
        self.bench = WatchedBench(settings=self.settings)
        self.node = self.bench.node
        self.ledger = self.bench.ledger
        self.acts: list[Act] = []
        self.shown: list[bytes] = []
        self.does("watch", level=int(watched))
        self.node.terminal.show = self.shown.append

    def does(self, deed: str, what: bytes | str = b"", level: int = 0) -> None:
        self.settle()
        act = Act(self.bench.kernel.now, deed, what, level)
        self.acts.append(act)
        do(act, self.bench)

    def settle(self) -> None:
        """Let come what the last deed leads to at once, so that the next one has its place."""
        self.passes(0)

    def passes(self, span: Ns) -> None:
        """Let time pass, with a look at the node before and after every event."""
        kernel, ledger = self.bench.kernel, self.ledger
        until = kernel.now + span
        for _ in range(EVENTS):
            due = kernel.next_at()
            if due is None or due > until:
                kernel.run_until(until)
                ledger.passed(until)
                return
            if due > kernel.now:
                kernel.run_until(due - 1)
                ledger.passed(due - 1)
            kernel.run_until(due)
            ledger.happened(due)

    # ---- time ----

    @rule(span=spans)
    def wait(self, span: Ns) -> None:
        self.passes(span)

    @rule()
    def wait_for_what_is_due(self) -> None:
        due = self.bench.kernel.next_at()
        self.passes(0 if due is None else due - self.bench.kernel.now)

    # ---- the line of the bus ----

    @rule(
        body=bodies,
        source=st.sampled_from([1, 1, 90]),
        general=st.sampled_from([False] * 5 + [True]),
    )
    def send(self, body: bytes, source: int, general: bool) -> None:
        self.talks(encode(0 if general else self.node.address, source, body))

    @rule(body=bodies)
    def send_with_a_wrong_crc(self, body: bytes) -> None:
        data = bytearray(encode(self.node.address, 1, body))
        data[-2] ^= 0x55
        self.talks(bytes(data))

    @rule(noise=st.binary(max_size=60))
    def make_noise(self, noise: bytes) -> None:
        self.talks(noise)

    def talks(self, data: bytes) -> None:
        self.ledger.may_refuse(data.count(ETX))
        self.does("send", data)
        self.passes(self.bench.span(len(data)) + 3 * MS)

    # ---- the terminal ----

    @rule(
        typed=st.lists(bodies, min_size=1, max_size=4), end=st.sampled_from([b"\r", b"\n", b"\r\n"])
    )
    def type_lines(self, typed: list[bytes], end: bytes) -> None:
        self.does("type", b"".join(line + end for line in typed))

    @rule(keys=st.binary(max_size=50))
    def type_anything(self, keys: bytes) -> None:
        self.does("type", keys)

    @rule(
        count=st.integers(25, 70), line=st.sampled_from([b"m3v300", b"m1v60", b"m2v1200a999d999"])
    )
    def type_more_than_the_queue_takes(self, count: int, line: bytes) -> None:
        self.does("type", (line + b"\r") * count)

    # ---- pins and power ----

    @rule(pin=st.sampled_from(["sync", "rst"]), level=st.integers(0, 1))
    def drive(self, pin: str, level: int) -> None:
        self.settle()
        released = self.node.commands.held is not None
        self.does("drive", pin, level)
        if not (released and self.node.engine.started == self.bench.kernel.now):
            self.ledger.acted(self.bench.kernel.now)

    @rule(level=st.integers(0, 1))
    def drive_estop(self, level: int) -> None:
        self.settle()
        falls = level == 0 and not self.ledger.estop_is_low
        self.ledger.estop(level)
        self.does("drive", "estop", level)
        if falls:  # what comes while it is low waits until it is high
            self.ledger.stands()
        self.ledger.acted(self.bench.kernel.now)

    @rule(hz=st.sampled_from([0, 1_000_000, 999_999]))
    def feed_xclk(self, hz: int) -> None:
        self.does("drive", "xclk", hz)
        self.ledger.acted(self.bench.kernel.now)

    @rule(clockwise=st.booleans())
    def turn_the_encoder(self, clockwise: bool) -> None:
        first, second = ("enA", "enB") if clockwise else ("enB", "enA")
        for pin, level in ((first, 0), (second, 0), (first, 1), (second, 1)):
            self.does("drive", pin, level)
            self.ledger.turned(self.bench.kernel.now)

    @rule(key=st.booleans())
    def switch_off_and_on(self, key: bool) -> None:
        """With a key in the second after it, the factory's memory is restored."""
        self.settle()
        self.ledger.disturb()
        for level in (0, 1):
            self.does("power", level=level)
            self.ledger.acted(self.bench.kernel.now)
        if key:
            self.does("type", b" ")
            self.passes(SECOND)

    # ---- what holds ----

    @invariant()
    def what_is_shown_is_bytes(self) -> None:
        assert all(type(text) is bytes and text for text in self.shown)
        self.shown.clear()

    @invariant()
    def every_pin_has_a_level(self) -> None:
        pins, now = self.node.pins, self.bench.kernel.now
        levels = {pin: pins.level(pin, now) for pin in pins.outputs}
        assert set(levels.values()) <= {0, 1}

    def teardown(self) -> None:
        """The same again, and nobody looks before the end."""
        if sys.exception() is not None or not hasattr(self, "bench"):
            return
        self.settle()
        unwatched = Bench(settings=self.settings)
        for act in self.acts:
            unwatched.kernel.run_until(act.at)
            do(act, unwatched)
        unwatched.kernel.run_until(self.bench.kernel.now)
        assert unwatched.transcript() == self.bench.transcript()


TestWholeNode = pytest.mark.slow(WholeNode.TestCase)
TestWholeNode.settings = settings(max_examples=60, stateful_step_count=40)
