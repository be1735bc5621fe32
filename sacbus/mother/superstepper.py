"""The master of a Super Stepper Bus for coroutines: SS-MST67 modules by typed messages.

Owns the meeting of the transactions (``exchanges.py``) with asyncio and with a link; no rule of its
own. The same class drives a bus hosted in this process and a line outside.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final, runtime_checkable
from typing import Protocol as Contract

from sacbus.kernel import NINE_BITS, LineRate, Ns
from sacbus.links import open_line
from sacbus.mother.clock import Clock
from sacbus.mother.errors import BadRequest, MotherError
from sacbus.mother.exchanges import (
    SLACK,
    SPEAKS,
    Answered,
    BadChecksum,
    Exchanges,
    Nak,
    NoReply,
    SuperStepperError,
    Talk,
)
from sacbus.mother.loop import LoopClock
from sacbus.mother.mother import LINK_SLACK
from sacbus.wire.superstepper import (
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
    decode_status,
)

__all__ = [
    "BadChecksum",
    "Hosted",
    "Hosting",
    "Nak",
    "NoReply",
    "SuperStepper",
    "SuperStepperError",
]

#: RAM 6 and 7.
_STATUS: Final = 6
_STEPS_RUN: Final = 7


class _Port(Contract):
    """A place on a line."""

    @property
    def talk(self) -> Talk: ...

    @property
    def unsent(self) -> int: ...


class _Host(Contract):
    """Who runs a bus in this process."""

    @property
    def kernel(self) -> Clock: ...

    def arrive(self, callback: Callable[..., object], *arguments: object) -> None: ...


class _Protocol(Contract):
    """What is spoken on a line."""

    @property
    def name(self) -> str: ...


class _Line(Contract):
    """What a bus has of a line."""

    @property
    def name(self) -> str: ...

    @property
    def protocol(self) -> _Protocol: ...

    @property
    def rate(self) -> LineRate: ...


class Hosted(Contract):
    """What a master asks of a bus in this process: what :func:`sacbus.open_bus` gives has it."""

    @property
    def host(self) -> _Host: ...

    @property
    def bus(self) -> _Line: ...

    def port(self, hear: Callable[[bytes], None]) -> _Port: ...


@runtime_checkable
class Hosting(Contract):
    """What has such a bus: a bus in a test is one."""

    @property
    def hosted(self) -> Hosted: ...


class SuperStepper:
    """The master for coroutines; any number of tasks may call, messages go out in that order.

    ::

        async with SuperStepper.connect("/dev/ttyUSB0", baud=9600) as master:
            await master.move_steps(3, 400, speed=10_000)
            while (await master.status(3)).busy:
                await asyncio.sleep(0.1)

    All methods raise :class:`Nak`, :class:`NoReply`, :class:`BadChecksum`,
    :class:`~sacbus.mother.LineLost`, and :class:`~sacbus.mother.BadRequest` for what cannot be
    sent. Speeds are the module's values, 1 to 65 535: larger is slower. ``rate`` and ``decay`` are
    of the types Rate and Decay of :mod:`sacbus.wire.superstepper`.
    """

    def __init__(
        self,
        clock: Clock,
        talk: Talk,
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
        rate = LineRate(baud, NINE_BITS) if nine else LineRate(baud)
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
    def on(cls, bus: Hosted | Hosting) -> SuperStepper:
        """The master on a bus in this process, at no distance from its line; closed with it.

        In a test that is ``bus``. BadRequest where another protocol is spoken: these bytes mean
        something else there.
        """
        if isinstance(bus, Hosting):
            bus = bus.hosted
        spoken = bus.bus.protocol.name
        if spoken not in SPEAKS:
            raise BadRequest(
                f"bus {bus.bus.name}: this master speaks {' or '.join(SPEAKS)}, expected a bus "
                f"that does, got {spoken}, take a master of that protocol"
            )
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
            raise BadRequest(f"microsteps: expected 1, 2, 4 or 8 per step, got {per_step!r}")
        await self.send(address, Microsteps((1, 2, 4, 8).index(per_step), decay))

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
        future: asyncio.Future[Answered] = asyncio.get_running_loop().create_future()

        def done(outcome: Answered | MotherError) -> None:
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
            return (await future).answer
        finally:
            if future.cancelled():
                self.exchanges.withdraw(done)


def _call(callback: Callable[..., object], *arguments: object) -> None:
    callback(*arguments)
