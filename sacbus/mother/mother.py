"""Mother for coroutines: connect to a line, send a command, get an answer or a typed error.

Owns the meeting of the transactions (``caller.py``) with asyncio and with a link; no rule of its
own. The same class drives a bus hosted in this process and a line outside.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final, TypeVar

from sacbus.kernel import MS, LineRate, Ns
from sacbus.language.line import quoted, short
from sacbus.links import open_line
from sacbus.mother.caller import SLACK, Caller
from sacbus.mother.clock import Clock
from sacbus.mother.errors import BadRequest, MotherError, Stopped
from sacbus.mother.loop import LoopClock
from sacbus.mother.outcome import Acknowledged, Done, Outcome, Sent
from sacbus.mother.scan import EVERY_ADDRESS, ScanProgress, scan
from sacbus.mother.statistics import NodeStatistics
from sacbus.wire.times import MOTHER_GAP

if TYPE_CHECKING:
    from sacbus.mother.group import Group, Member
    from sacbus.mother.streamed import Streamed
    from sacbus.toolpath import Block, Machine

__all__ = ["LINK_SLACK", "Mother", "addressed_line"]

#: How late an answer may be on a link out of this process: a USB adapter's 16 ms latency timer
#: both ways, and a busy machine.
LINK_SLACK: Final[Ns] = 100 * MS

_Good = TypeVar("_Good", Acknowledged, Sent)

_ADDRESSED: Final = re.compile(r"0*([0-9]+)(.*)", re.DOTALL)


class Mother:
    """Address 1: sends commands, waits for ACKs, keeps count.

    One request is outstanding at a time, in the order of the calls; any number of tasks may call.
    """

    def __init__(
        self,
        clock: Clock,
        send: Callable[[bytes], None],
        *,
        rate: LineRate | None = None,
        slack: Ns = SLACK,
        unsent: Callable[[], int] | None = None,
        arrive: Callable[..., None] | None = None,
        gap: Ns = MOTHER_GAP,
        set_dtr: Callable[..., bool] | None = None,
    ) -> None:
        """Have ``send`` put bytes on a line, with ``slack`` for answers beyond the line's figures.

        ``arrive(callback, *arguments)`` brings ``clock`` up to date before it calls back: a host's,
        when mother sits on a bus in this process. ``gap`` as :class:`Caller` has it.
        ``set_dtr(asserted=…)`` sets the DTR output of her adapter, and tells whether it has one.
        """
        self._clock = clock
        #: How long bytes take on the line.
        self.rate = rate or LineRate()
        self._set_dtr = set_dtr
        self._caller = Caller(clock, send, rate=self.rate, slack=slack, unsent=unsent, gap=gap)
        self._arrive = arrive or _call
        #: Those who wait for a time by mother's clock.
        self._sleepers: set[asyncio.Future[None]] = set()

    @classmethod
    @asynccontextmanager
    async def connect(
        cls, link: str, *, baud: int = 38_400, gap: Ns = MOTHER_GAP
    ) -> AsyncIterator[Mother]:
        """Mother on a line, for an ``async with`` block.

        ``link`` is the path of a serial port or pty, ``socket://host:port`` or
        ``rfc2217://host:port``. Raises :class:`~sacbus.links.LinkError` when it cannot be opened; a
        line lost later raises :class:`LineLost` in every call, and so does one after the block.
        ``gap``: ns that are left free after every answer and broadcast; 0 loses packets on devices.
        """
        clock = LoopClock(asyncio.get_running_loop())
        async with open_line(link, baud) as line:
            mother = cls(
                clock,
                line.send,
                rate=LineRate(baud),
                slack=LINK_SLACK,
                gap=gap,
                set_dtr=line.set_dtr,
            )
            line.start(mother.caller.hear, mother.lose)
            try:
                yield mother
            finally:
                mother.lose(f"the line was closed, {link}, connect again")

    @property
    def caller(self) -> Caller:
        """The transactions themselves: whoever brings bytes of the line has them hear these."""
        return self._caller

    @property
    def statistics(self) -> Mapping[int, NodeStatistics]:
        """Counts and round trips by node; address 0 holds the broadcasts."""
        return self._caller.statistics

    def lose(self, why: str) -> None:
        """The link's side: the line is gone."""
        self._caller.lose(why)
        lost = self._caller.lost
        for sleeper in self._sleepers:
            if lost is not None and not sleeper.done():
                sleeper.set_exception(lost)

    @property
    def now(self) -> Ns:
        """The time by mother's clock, ns since some start: bus time, on a bus in this process."""
        self._arrive(_nothing)
        return self._clock.now

    async def until(self, when: Ns) -> None:
        """Wait until mother's clock shows ``when``, for motion that is planned to be over then.

        :class:`LineLost` if the line goes before, :class:`Stopped` upon an emergency stop.
        """
        if self._caller.lost is not None:
            raise self._caller.lost
        sleeper: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._sleepers.add(sleeper)
        self._arrive(self._clock.at, when, _wake, sleeper)
        try:
            await sleeper
        finally:
            self._sleepers.discard(sleeper)

    async def send(
        self, node: int, line: str | bytes, *, accept_duplicates: bool = False
    ) -> Acknowledged:
        """Send one command line to a node and wait for its ACK.

        Raises :class:`Refused`, :class:`NoAnswer`, :class:`UnknownOutcome`, :class:`Stopped`,
        :class:`LineLost`, and :class:`BadRequest` for what cannot be sent. ``accept_duplicates``
        lets a command that is not idempotent be sent again after silence; it may then run twice. A
        cancelled call whose turn has not come is never sent; one that is out is not sent again.
        """
        return await self._outcome(
            lambda done: self._caller.call(
                node,
                line if type(line) is bytes else _bytes(line),
                done,
                accept_duplicates=accept_duplicates,
            ),
            Acknowledged,
        )

    async def broadcast(self, line: str | bytes) -> None:
        """Send a line to all nodes; returns when the next packet may follow. Nobody answers."""
        await self._outcome(lambda done: self._caller.broadcast(_bytes(line), done), Sent)

    def set_dtr(self, *, asserted: bool) -> None:
        """Set DTR, an output of a serial adapter that RS485 leaves to other uses, now.

        It may drive the nodes' shared sync line: as adapters with TTL levels have it, asserted is
        low. Every serial port asserts it when it is opened, so it has to be let go first. Many
        boards reset at its edge if it is wired to them. :class:`BadRequest` where there is none.
        """
        if self._set_dtr is None or not self._set_dtr(asserted=asserted):
            raise BadRequest(
                "this line has no DTR to set, use a serial port that has one, or another release"
            )

    def pull_dtr(self) -> None:
        """Assert DTR and let it go: an edge and back, for ``release`` of a group's start."""
        self.set_dtr(asserted=True)
        self.set_dtr(asserted=False)

    def group(
        self, axes: Mapping[str, int | Member] | None = None, /, **named: int | Member
    ) -> Group:
        """Axes that start together: ``mother.group(x=10, y=11)``, or a mapping of names to nodes.

        A :class:`Member` in place of a node's address tells its settings. :class:`Group` itself
        takes another queue position, or drift. :class:`BadRequest` for two axes on one node, and
        what no node can be.
        """
        from sacbus.mother.group import Group  # noqa: PLC0415 (it stands on this file)

        return Group(self, {**(axes or {}), **named})

    async def estop(self) -> None:
        """Emergency stop: S to all nodes, at once and twice more 1 ms apart. Nothing is waited for.

        The first S is handed to the link before anything else happens; this returns when the third
        is out, which it will be also when the caller is cancelled meanwhile. Calls that wait for
        their turn raise :class:`Stopped` and are never sent; the one that is out ends as it does
        (its ACK may collide with S), but is not sent again. Mother can be used afterwards as
        before. Nobody answers a broadcast, so who has stopped is for the caller to find out.
        :class:`LineLost` when there is no line.
        """
        for sleeper in self._sleepers:
            if not sleeper.done():
                sleeper.set_exception(Stopped(0, ""))
        await self._outcome(self._caller.estop, Sent)

    async def scan(
        self,
        addresses: Iterable[int] = EVERY_ADDRESS,
        *,
        progress: Callable[[ScanProgress], object] | None = None,
    ) -> list[Acknowledged]:
        """Ask every address whether a node is there; those that answer, in the order asked.

        Each is asked with the empty line, which does nothing, three times before it is taken to be
        absent: some 5 s for all 252 at 38 400 baud, less for those that answer. ``attempts`` counts
        how often a node had to be asked, ``round_trip`` is that of its answer. ``progress`` is
        called after each address. Other calls have their turns in between.
        """
        return await scan(
            self._caller, lambda ask: self._outcome(ask, Acknowledged), addresses, progress
        )

    async def run(
        self,
        blocks: Iterable[Block],
        machine: Machine,
        *,
        progress: Callable[[Streamed], object] | None = None,
        halt: Callable[[str, bool], Awaitable[object]] | None = None,
    ) -> Streamed:
        """Run the blocks of a toolpath on a machine's nodes; returns when all axes stand again.

        ``progress`` is called with each block that begins. ``halt`` is awaited for what the path
        tells somebody, with its text and whether it waits. Raises as
        :meth:`~sacbus.mother.Stream.run`, which this is; a ``Stream`` has more settings.
        """
        from sacbus.mother.stream import Stream  # noqa: PLC0415 (it stands on this file)

        return await Stream(self, machine, progress=progress, halt=halt).run(blocks)

    async def _outcome(self, ask: Callable[[Done], None], good: type[_Good]) -> _Good:
        """Have something asked, and wait for what becomes of it: ``good``, or a MotherError."""
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()

        def done(outcome: Outcome) -> None:
            if future.done():
                return  # the caller was cancelled while the packet was on its way
            if isinstance(outcome, MotherError):
                future.set_exception(outcome)
            else:
                future.set_result(outcome)

        if self._caller.lost is not None:
            # Not through ``arrive``: a host that is closed takes nothing in any more.
            raise self._caller.lost
        self._arrive(ask, done)
        try:
            outcome = await future
        except asyncio.CancelledError:
            self._caller.withdraw(done)
            raise
        if type(outcome) is not good:
            raise TypeError(f"expected the outcome to be {good.__name__}, got {outcome!r}")
        return outcome


def addressed_line(text: str) -> tuple[int, str]:
    """``85m3000a2d1`` as a terminal reads it: (85, "m3000a2d1"); address 0 is everybody.

    A space or dot after the address stays: what follows is then a message. :class:`BadRequest`
    when there is no address, or none that a node can have.
    """
    found = _ADDRESSED.fullmatch(text)
    if found is None:
        raise BadRequest(
            f"line {quoted(text)}: expected an address before the command, as in 85m3000a2d1 "
            "(0 for all nodes)"
        )
    node = int(found[1][:4])
    if node > 255:
        raise BadRequest(
            f"node {short(found[1])}: expected an address from 4 to 255, or 0 for all nodes"
        )
    return node, found[2]


def _nothing() -> None:
    """What is done at a look at the clock."""


def _wake(sleeper: asyncio.Future[None]) -> None:
    if not sleeper.done():
        sleeper.set_result(None)


def _call(callback: Callable[..., object], *arguments: object) -> None:
    callback(*arguments)


def _bytes(line: object) -> bytes:
    if isinstance(line, bytes):
        return line
    if not isinstance(line, str):
        raise BadRequest(f"line {line!r}: expected str or bytes, got {type(line).__name__}")
    try:
        return line.encode("latin-1")
    except UnicodeEncodeError as fault:
        raise BadRequest(
            f"line {quoted(line)}: expected characters of one byte, got {line[fault.start]!r}"
        ) from fault
