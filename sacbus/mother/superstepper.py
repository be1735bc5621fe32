"""The master of a Super Stepper Bus: messages to SS-MST67 modules, and what becomes of them.

Owns the transactions (:class:`Exchanges`, synchronous, told the time) and their meeting with
asyncio and with a link (:class:`SuperStepper`). One message is outstanding at a time. What may run
twice is sent again after silence, a time-out's NAK or a wrong checksum; a number of steps only
after a NAK, since a module that says NAK has not acted.

SuperStepperError                  everything below; a MotherError
├── Nak                            the message did not come whole, every time; it was not executed
├── NoReply (TimeoutError)         silence, every time
└── BadChecksum                    an answer came damaged; the message was executed

Source: spec, superstepper; SS-MST67 manual, "Data Return".
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Final
from typing import Protocol as Contract

from sacbus.kernel import MS, LineRate, Ns
from sacbus.links import open_line
from sacbus.mother.caller import Clock
from sacbus.mother.errors import BadRequest, LineLost, MotherError
from sacbus.mother.mother import LINK_SLACK, LoopClock
from sacbus.wire.superstepper import (
    ANSWER_SIZE,
    Answer,
    ChangeSpeed,
    Decay,
    Message,
    Microsteps,
    MoveAtSpeed,
    MoveSteps,
    Rate,
    Read,
    Status,
    Stop,
    Write,
    decode_answer,
    decode_status,
    describe,
    encode,
)

__all__ = [
    "BadChecksum",
    "Exchanges",
    "Hosted",
    "Nak",
    "NoReply",
    "SuperStepper",
    "SuperStepperError",
]

#: How late an answer may be beyond the line's own figures, on a line in this process; it covers the
#: turnaround, of which nothing is published.
SLACK: Final[Ns] = 10 * MS

#: A module gives up a message after 10 byte times, at least 5 ms (spec, [D]); a master waits as
#: long before she says the next one where the last did not go well.
_PATIENCE_BYTES: Final = 10
_PATIENCE: Final[Ns] = 5 * MS

#: Attempts for what may be repeated.
TRIES: Final = 3

#: RAM 6 and 7.
_STATUS: Final = 6
_STEPS_RUN: Final = 7


class SuperStepperError(MotherError):
    """A message that was not answered as it should be: whose, which, how often it was sent."""

    verdict = ""

    def __init__(self, address: int, message: Message, attempts: int) -> None:
        self.address = address
        self.message = message
        self.attempts = attempts
        times = "once" if attempts == 1 else f"{attempts} times"
        super().__init__(f"module {address}: {describe(message)!r} sent {times}: {self.verdict}")


class Nak(SuperStepperError):
    """A time-out ended the message before it was whole, every time. It was not executed."""

    verdict = "NAK, it did not come whole and was not executed; check the line and its mode"


class NoReply(SuperStepperError, TimeoutError):
    """Silence. A message may have been executed, or not."""

    verdict = "no answer; nobody at that address, another baud rate, or another mode (8 or 9 bits)"


class BadChecksum(SuperStepperError):
    """Something came, but its checksum is wrong, or it is another's answer."""

    verdict = "a damaged answer; it was probably executed, look at the module"


class _Talk(Contract):
    """Bytes to the line; ``ninth``: a 0 or 1 for each, which a line without ninth bits ignores."""

    def __call__(self, data: bytes, ninth: bytes) -> object: ...


class _Port(Contract):
    """A place on a line."""

    @property
    def talk(self) -> _Talk: ...

    @property
    def unsent(self) -> int: ...


class _Host(Contract):
    """Who runs a bus in this process."""

    @property
    def kernel(self) -> Clock: ...

    def arrive(self, callback: Callable[..., object], *arguments: object) -> None: ...


class _Line(Contract):
    """What a bus has of a line."""

    @property
    def rate(self) -> LineRate: ...


class Hosted(Contract):
    """What a master asks of a bus in this process: what :func:`sacbus.open_bus` gives has it."""

    @property
    def host(self) -> _Host: ...

    @property
    def bus(self) -> _Line: ...

    def port(self, hear: Callable[[bytes], None]) -> _Port: ...


_Done = Callable[[Answer | MotherError], None]


@dataclass(slots=True)
class _Request:
    address: int
    message: Message
    data: bytes
    done: _Done
    may_repeat: bool
    attempts: int = 0


class Exchanges:
    """Messages in order, one outstanding. ``talk`` takes the bytes of a message.

    ``slack`` is how much later than the line's own figures an answer may come. ``unsent``, where it
    can be known, tells how many bytes still wait for the line: while any do, no answer is late.
    """

    def __init__(
        self,
        clock: Clock,
        talk: _Talk,
        rate: LineRate,
        *,
        slack: Ns = SLACK,
        unsent: Callable[[], int] | None = None,
    ) -> None:
        self._clock = clock
        self._talk = talk
        self._rate = rate
        self._slack = slack
        self._unsent = unsent
        self._patience = max(rate.span(_PATIENCE_BYTES), _PATIENCE)
        self._waiting: deque[_Request] = deque()
        self._outstanding: _Request | None = None
        self._heard = bytearray()
        #: The number of the attempt whose end is appointed.
        self._attempt = 0
        self._pausing = False
        self._lost: LineLost | None = None
        #: Bytes that came when nothing was asked.
        self.strays = 0

    @property
    def lost(self) -> LineLost | None:
        """Why nothing can be sent any more; None while it can."""
        return self._lost

    def call(
        self, address: int, message: Message, done: _Done, *, accept_duplicates: bool = False
    ) -> None:
        """Have a module execute a message; ``done`` is called once, with what became of it.

        ``accept_duplicates``: after silence send again even a number of steps. BadRequest at once
        for what cannot be sent.
        """
        try:
            data = encode(address, message)
        except ValueError as fault:
            raise BadRequest(f"module {address}: {fault}") from fault
        if self._lost is not None:
            done(self._lost)
            return
        may_repeat = accept_duplicates or not isinstance(message, MoveSteps)
        self._waiting.append(_Request(address, message, data, done, may_repeat))
        self._next()

    def withdraw(self, done: _Done) -> None:
        """Nobody waits any more for the message of this ``done``: it is not sent any more."""
        self._waiting = deque(one for one in self._waiting if one.done != done)
        if self._outstanding is not None and self._outstanding.done == done:
            self._outstanding.may_repeat = False

    def hear(self, data: bytes) -> None:
        """Bytes from the modules."""
        request = self._outstanding
        if request is None:
            self.strays += len(data)
            return
        self._heard += data
        if len(self._heard) < ANSWER_SIZE:
            return
        answer = decode_answer(bytes(self._heard[:ANSWER_SIZE]))
        if answer is None or answer.address != request.address:
            self._failed(request, BadChecksum)
        elif not answer.positive:
            self._failed(request, Nak, may_repeat=True)
        else:
            self._outstanding = None
            self.strays += len(self._heard) - ANSWER_SIZE
            request.done(answer)
            self._next()

    def lose(self, why: str) -> None:
        """The line is gone: everything that waits fails, and so does all that is asked later."""
        self._lost = LineLost(why)
        waiting = [self._outstanding, *self._waiting]
        self._outstanding = None
        self._waiting.clear()
        for request in waiting:
            if request is not None:
                request.done(self._lost)

    def _next(self) -> None:
        if self._outstanding is None and not self._pausing and self._waiting:
            self._send(self._waiting.popleft())

    def _send(self, request: _Request) -> None:
        request.attempts += 1
        self._outstanding = request
        self._heard.clear()
        self._attempt += 1
        self._appoint()
        # The header is marked; each message is one.
        self._talk(request.data, bytes((1, *bytes(len(request.data) - 1))))

    def _appoint(self) -> None:
        assert self._outstanding is not None  # whoever appoints has just asked
        size = len(self._outstanding.data) + ANSWER_SIZE
        due = self._clock.now + self._rate.span(size) + self._patience + self._slack
        self._clock.at(due, self._overdue, self._attempt)

    def _overdue(self, attempt: int) -> None:
        request = self._outstanding
        if request is None or attempt != self._attempt:
            return
        if self._unsent is not None and self._unsent():
            self._appoint()
        else:
            self._failed(request, BadChecksum if self._heard else NoReply)

    def _failed(
        self, request: _Request, kind: type[SuperStepperError], *, may_repeat: bool = False
    ) -> None:
        self._outstanding = None
        if (may_repeat or request.may_repeat) and request.attempts < TRIES:
            self._waiting.appendleft(request)
        else:
            request.done(kind(request.address, request.message, request.attempts))
        # Whatever a module has of it is given up by then.
        self._pausing = True
        self._clock.at(self._clock.now + self._patience, self._pause_over)

    def _pause_over(self) -> None:
        self._pausing = False
        self._next()


class SuperStepper:
    """The master for coroutines; any number of tasks may call, messages go out in that order.

    ::

        async with SuperStepper.connect("/dev/ttyUSB0", baud=9600) as master:
            await master.move_steps(3, 400, speed=10_000)
            while (await master.status(3)).busy:
                await asyncio.sleep(0.1)

    All methods raise :class:`Nak`, :class:`NoReply`, :class:`BadChecksum`,
    :class:`~sacbus.mother.LineLost`, and :class:`~sacbus.mother.BadRequest` for what cannot be
    sent. Speeds are the module's values, 1 to 65 535: larger is slower.
    """

    def __init__(
        self,
        clock: Clock,
        talk: _Talk,
        rate: LineRate,
        *,
        slack: Ns = SLACK,
        unsent: Callable[[], int] | None = None,
        arrive: Callable[..., None] | None = None,
    ) -> None:
        """``arrive(callback, *arguments)`` brings ``clock`` up to date before it calls back."""
        self.exchanges = Exchanges(clock, talk, rate, slack=slack, unsent=unsent)
        self._arrive = arrive or _call

    @classmethod
    @asynccontextmanager
    async def connect(
        cls, link: str, *, baud: int = 9_600, nine: bool = False
    ) -> AsyncIterator[SuperStepper]:
        """The master on a line, for an ``async with`` block.

        ``link`` is the path of a serial port or pty, ``socket://host:port`` or
        ``rfc2217://host:port``. ``nine``: 9-bit mode, the ninth bit as mark or space parity, which
        takes a real port or one behind RFC 2217. Raises LinkError when it cannot be opened.
        """
        clock = LoopClock(asyncio.get_running_loop())
        rate = LineRate(baud, 11 if nine else 10)
        async with open_line(link, baud) as line:

            def talk(data: bytes, ninth: bytes) -> None:
                if nine:
                    line.send_marked(data, ninth)
                else:
                    line.send(data)

            if nine:
                line.check_marking()
            master = cls(clock, talk, rate, slack=LINK_SLACK)
            line.start(master.hear, master.lose)
            try:
                yield master
            finally:
                master.lose(f"the line was closed, {link}, connect again")

    @classmethod
    def on(cls, bus: Hosted) -> SuperStepper:
        """The master on a bus in this process, at no distance from its line; closed with it."""
        masters: list[SuperStepper] = []

        def hear(data: bytes) -> None:
            masters[0].hear(data)

        port = bus.port(hear)
        masters.append(
            cls(
                bus.host.kernel,
                port.talk,
                bus.bus.rate,
                unsent=lambda: port.unsent,
                arrive=bus.host.arrive,
            )
        )
        return masters[0]

    def hear(self, data: bytes) -> None:
        """The link's side: bytes from the line."""
        self.exchanges.hear(data)

    def lose(self, why: str) -> None:
        """The link's side: the line is gone."""
        self.exchanges.lose(why)

    # ---- motion ----

    async def move_at_speed(
        self,
        address: int,
        speed: int,
        *,
        clockwise: bool = True,
        rate: Rate = Rate.FAST,
        accelerate: bool = True,
    ) -> None:
        """Opcode 0: move until something else is said; ``accelerate`` False: at once."""
        await self.send(address, MoveAtSpeed(clockwise, speed, rate, accelerate))

    async def move_steps(
        self,
        address: int,
        steps: int,
        *,
        speed: int,
        clockwise: bool = True,
        rate: Rate = Rate.FAST,
        accept_duplicates: bool = False,
    ) -> None:
        """Opcode 1: so many (micro)steps, 0 to 65 535. Returns when the module has it."""
        message = MoveSteps(clockwise, speed, steps, rate)
        await self.send(address, message, accept_duplicates=accept_duplicates)

    async def home(
        self,
        address: int,
        *,
        speed: int,
        most: int = 0xFFFF,
        clockwise: bool = False,
        rate: Rate = Rate.FAST,
        accept_duplicates: bool = False,
    ) -> None:
        """Opcode 1 with H: until the home sensor falls, or for so many steps at most."""
        message = MoveSteps(clockwise, speed, most, rate, home=True)
        await self.send(address, message, accept_duplicates=accept_duplicates)

    async def change_speed(self, address: int, speed: int) -> None:
        """Opcode 2: of the move that runs; at rest: of the next one at speed."""
        await self.send(address, ChangeSpeed(speed))

    async def microsteps(self, address: int, per_step: int, decay: Decay = Decay.FAST) -> None:
        """Opcode 3: 1, 2, 4 or 8 microsteps per step."""
        if per_step not in (1, 2, 4, 8):
            raise BadRequest(f"microsteps: expected 1, 2, 4 or 8 per step, got {per_step}")
        await self.send(address, Microsteps(per_step.bit_length() - 1, decay))

    async def stop(self, address: int, *, decelerate: bool = True, enabled: bool = True) -> None:
        """Opcode 4. ``enabled`` False: then without current."""
        await self.send(address, Stop(decelerate, enabled))

    # ---- memories ----

    async def read(self, address: int, place: int, *, eeprom: bool = False) -> int:
        """Opcode 7: a byte of RAM or EEPROM."""
        return (await self.send(address, Read(place, eeprom))).value

    async def read_word(self, address: int, place: int) -> int:
        """Opcode 7: a word of RAM, high byte first."""
        return (await self.send(address, Read(place, word=True))).value

    async def write(self, address: int, place: int, byte: int, *, eeprom: bool = False) -> None:
        """Opcode 6: a byte into RAM or EEPROM."""
        await self.send(address, Write(place, byte, eeprom))

    async def status(self, address: int) -> Status:
        """The status register."""
        return decode_status(await self.read(address, _STATUS))

    async def steps_run(self, address: int) -> int:
        """Steps since the last move began, modulo 65 536."""
        return await self.read_word(address, _STEPS_RUN)

    async def send(
        self, address: int, message: Message, *, accept_duplicates: bool = False
    ) -> Answer:
        """Any message; its answer."""
        future: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()

        def done(outcome: Answer | MotherError) -> None:
            if future.done():
                return  # the caller was cancelled while the message was on its way
            if isinstance(outcome, MotherError):
                future.set_exception(outcome)
            else:
                future.set_result(outcome)

        if self.exchanges.lost is not None:
            # Not through ``arrive``: a host that is closed takes nothing in any more.
            raise self.exchanges.lost

        def ask() -> None:
            self.exchanges.call(address, message, done, accept_duplicates=accept_duplicates)

        self._arrive(ask)
        try:
            return await future
        finally:
            if future.cancelled():
                self.exchanges.withdraw(done)


def _call(callback: Callable[..., object], *arguments: object) -> None:
    callback(*arguments)
