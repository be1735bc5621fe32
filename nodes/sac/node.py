"""A SAC: network port, message processor, command processor and motion engine put together.

Owns the node as the bus sees it (the contract of ``sacbus.node``) and the wiring of its parts;
each part's rules are in its own file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nodes.sac.command import CommandProcessor, shortest
from nodes.sac.engine import Engine
from nodes.sac.memory import Memory
from nodes.sac.message import MessageProcessor
from nodes.sac.network import NetworkPort
from nodes.sac.queries import Query, answer
from nodes.sac.screens import Flags
from nodes.sac.settings import SacSettings
from nodes.sac.terminal import TerminalPort
from sacbus.kernel import LineRate, Ns
from sacbus.language import Session
from sacbus.motion import Timebase
from sacbus.node import Heard, Report, ReportKind, Snapshot
from sacbus.wire import DC1, DC2, GENERAL_CALL

__all__ = ["SacNode"]


class SacNode:
    """One virtual SAC. Starts booted, with the factory's memory as its settings give it."""

    kind = "sac"

    __slots__ = (
        "_commands",
        "_engine",
        "_memory",
        "_messages",
        "_network",
        "_now",
        "_rate",
        "_settings",
        "_tell_bus",
        "_terminal",
        "_xclk_hz",
    )

    def __init__(
        self, address: int, settings: SacSettings, rate: LineRate, tell: Callable[[Report], None]
    ) -> None:
        self._settings = settings
        self._rate = rate
        self._tell_bus = tell
        self._now: Ns = 0
        self._terminal: TerminalPort | None = None
        #: Frequency of the clock at the xclk pin.
        self._xclk_hz = settings.xclk_hz
        self._boot(settings.factory_memory(address))

    def _boot(self, memory: Memory) -> None:
        """Start anew with this memory, as after a cold boot."""
        self._memory = memory
        settings = self._settings
        self._engine = Engine(settings.oscillator, self._external_clock())
        self._commands = CommandProcessor(
            Session.start(memory.defaults()),
            memory.drive(
                auto_micro=settings.auto_micro,
                pull_in_rpm=settings.pull_in_rpm,
                pull_out=settings.pull_out_curve,
            ),
            self._engine,
            self,
        )
        self._commands.switch_ops(on=bool(memory.soft_ops))
        self._network = NetworkPort(
            memory.d_id, self._settings, self._rate, self._network_line, self._tell
        )
        self._network.ack = bool(memory.ack)
        self._network.crc = bool(memory.crc)
        self._messages = MessageProcessor(
            self._commands, self._network.send, self._tell_line, self._terminal
        )

    @property
    def address(self) -> int:
        """Its d_id."""
        return self._network.address

    @property
    def receiving(self) -> bool:
        """True while its receiver stands open."""
        return self._network.receiving

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes from the line."""
        self._now = now
        self._network.hear(heard)

    def wake_at(self) -> Ns | None:
        """The next answer or packet to send, or the end of the command that runs."""
        sends = self._network.due
        ends = self._commands.due
        if sends is None:
            return ends
        return sends if ends is None or sends < ends else ends

    def wake(self, now: Ns) -> bytes | None:
        """End what is over; send what is due."""
        self._now = now
        self._commands.wake(now)
        return self._network.wake(now)

    def state(self, now: Ns) -> str:
        """What the engine does; SYNC while a command is held that has not begun."""
        return "SYNC" if self._commands.held is not None else self._engine.state(now).name

    def snapshot(self, now: Ns) -> Snapshot:
        """State, position and counts at ``now``."""
        commands, engine, network = self._commands, self._engine, self._network
        pulses, microsteps, rotor = engine.where(now)
        per_step = 2**self._memory.ustep
        held = commands.held
        current = commands.current or held
        pending = commands.pending
        defaults = commands.session.defaults
        return Snapshot(
            address=self.address,
            kind=self.kind,
            state=self.state(now),
            position_steps=microsteps / per_step,
            position_pulses=pulses,
            rpm=engine.rpm(now),
            current="" if current is None else shortest(current, defaults),
            pending=tuple(shortest(one, defaults) for one in pending),
            counters={"packets": network.packets, "ack": network.acks, "nak": network.naks},
            rotor_steps=rotor / per_step if self._settings.pull_in else None,
        )

    def persist(self) -> Mapping[str, int]:
        """The EEPROM's contents."""
        return self._memory.stored()

    def restore(self, memory: Mapping[str, object]) -> None:
        """Boot with a stored EEPROM; the stored d_id wins over the configured address."""
        configured = self._memory.d_id
        restored, remarks = self._memory.restored({**memory, **self._settings.asked_for()})
        for remark in remarks:
            self._tell(ReportKind.WARNING, remark)
        if restored.d_id != configured:
            self._tell(
                ReportKind.WARNING,
                f"EEPROM: d_id {restored.d_id} is stored and wins over the configured {configured}",
            )
        self._boot(restored)

    # ---- the terminal ----

    @property
    def terminal(self) -> TerminalPort:
        """Its terminal port, made when it is first asked for: most nodes never have a user."""
        if self._terminal is None:
            self._terminal = self._messages.terminal = TerminalPort(self)
        return self._terminal

    def keys_typed(self, keys: bytes, now: Ns) -> None:
        """Keys arrive at the terminal port."""
        self._now = now
        self.terminal.take(keys, now)

    def line_typed(self, line: bytes, now: Ns) -> None:
        """A line was typed at the terminal port."""
        self._messages.terminal_line(line, self.terminal, now)

    def answer(self, query: Query) -> list[str]:
        """What a query shows on the terminal."""
        commands, network = self._commands, self._network
        flags = Flags(
            gap=commands.gap,
            debug=commands.debug,
            throttle=False,  # after a boot; no command of this version changes it
            soft_ops=bool(self._memory.soft_ops),
            ack=network.ack,
            crc=network.crc,
            source=self._messages.last_source,
        )
        return answer(query, commands, self._memory, flags)

    # ---- pins ----

    def feed_xclk(self, hz: int, now: Ns) -> None:
        """From ``now`` on a clock of ``hz`` comes to the xclk pin; 0: no edges.

        It matters while the node is set to the external clock. Whoever calls this from outside the
        bus has the bus ask the node anew when it wants to be woken.
        """
        self._now = now
        self._xclk_hz = hz
        clock = self._external_clock()
        if clock is not None:
            self._commands.set_clock(clock, now)

    def _external_clock(self) -> Timebase | None:
        """What times pulses instead of the oscillator; None when nothing does."""
        memory = self._memory
        return None if memory.clock else Timebase.external(memory.xfreq, self._xclk_hz)

    def _network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        self._messages.network_line(body, source, destination, now)

    def tell_ops(self, *, start: bool, at: Ns) -> Ns:
        """Soft ops tell everybody that a command starts or ends; when that will be out."""
        return self._network.send(GENERAL_CALL, bytes((DC1 if start else DC2,)), at)

    def _tell(self, kind: ReportKind, text: str) -> None:
        self._tell_line(kind, text, "", 0)

    def tell_of_command(self, kind: ReportKind, text: str, command: str | None = None) -> None:
        """About a command that runs later than it came, or else about the line that has come."""
        self._tell_line(kind, text, self._messages.line if command is None else command, 0)

    def _tell_line(self, kind: ReportKind, text: str, line: str, column: int) -> None:
        self._tell_bus(Report(self._now, self.address, kind, text, line, column))
