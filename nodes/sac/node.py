"""A SAC as the bus sees it: the contract of ``sacbus.node``.

Owns what the bus is told: who it is, whether it listens, when it wants to be woken, and how it
looks from outside. What is done then is the business of its parts, which its board (``board.py``)
holds together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from nodes.sac.board import SacBoard
from nodes.sac.boot import NO_POWER
from nodes.sac.command import shortest
from nodes.sac.movement import SacMovement
from nodes.sac.pins import SacPins
from nodes.sac.ports import HardwarePort
from nodes.sac.settings import SacSettings
from sacbus.kernel import LineRate, Ns
from sacbus.language import Stop
from sacbus.node import Heard, Report, Snapshot

__all__ = ["SacNode"]


class SacNode:
    """One virtual SAC, with the factory's memory as its settings give it.

    It starts booted, or cold if its settings say so: then it is deaf for a second of bus time.
    """

    kind = "sac"

    __slots__ = ("board",)

    def __init__(
        self,
        address: int,
        settings: SacSettings,
        rate: LineRate,
        tell: Callable[[Report], None],
        memory: Mapping[str, object] | None = None,
    ) -> None:
        """``memory`` is what its EEPROM holds; None: what it left the factory with."""
        self.board = SacBoard(address, settings, rate, tell, memory)

    @property
    def address(self) -> int:
        """Its d_id."""
        return self.board.network.address

    @property
    def receiving(self) -> bool:
        """True while its receiver stands open."""
        board = self.board
        return board.network.receiving or (board.ports is not None and board.ports.exchanged)

    @property
    def quiet(self) -> bool:
        """True while it has nothing to send, and nobody is to be told of starts and ends."""
        board = self.board
        if board.start is not None:
            return False
        sends = board.network.due
        if board.ports is not None:
            sends = board.ports.due(sends)
        return sends is None and not board.commands.tells_ops

    def hear(self, heard: Heard, now: Ns) -> None:
        """Bytes from the line."""
        board = self.board
        board.now = now
        if board.ports is None or (keys := board.ports.keys(heard)) is None:
            board.network.hear(heard)
        else:
            board.terminal_keys(keys, now)
        if board.onlookers:
            board.look(now)

    def wake_at(self) -> Ns | None:
        """The next answer or packet to send, the end of the command that runs, or of a boot."""
        board = self.board
        if board.start is not None:
            return board.start.over
        sends = board.network.due
        if board.ports is not None:
            sends = board.ports.due(sends)
        ends = board.commands.due
        if sends is None:
            return ends
        return sends if ends is None or sends < ends else ends

    def wake(self, now: Ns) -> bytes | None:
        """End what is over; send what is due."""
        board = self.board
        board.now = now
        if board.start is not None:
            board.end_boot(board.start, now)
        board.commands.wake(now)
        if board.onlookers:
            board.look(now)
        data = board.network.wake(now)
        return data if board.ports is None else board.ports.say(data, now)

    def state(self, now: Ns) -> str:
        """What the engine does; SYNC while a command is held that has not begun; OFF; BOOT."""
        board = self.board
        if board.start is not None:
            return board.off_or_booting
        return "SYNC" if board.commands.held is not None else board.engine.state(now).name

    def snapshot(self, now: Ns) -> Snapshot:
        """State, position and counts at ``now``."""
        board = self.board
        commands, engine, network = board.commands, board.engine, board.network
        pulses, microsteps, rotor = engine.where(now)
        per_step = 2**board.obeyed.ustep
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
            rotor_steps=rotor / per_step if board.settings.pull_in else None,
        )

    def stop(self, now: Ns) -> None:
        """Stop as by ``S``: no further pulse, and nothing of what waits; not while off or booting.

        Whoever calls this has the bus ask the node anew when it wants to be woken.
        """
        board = self.board
        board.now = now
        if board.start is None:
            board.commands.execute(Stop(grace=False), now)
        if board.onlookers:
            board.look(now)

    def power(self, *, on: bool, now: Ns) -> None:
        """Switch it off, or on again for a cold boot; nothing if it is that already.

        Off, it does nothing and forgets all but its EEPROM, also where its motor stands. Whoever
        calls this from outside the bus has the bus ask the node anew when it wants to be woken.
        """
        board = self.board
        board.now = now
        if on is not (board.start is NO_POWER):
            return
        if on:
            board.boot(now, cold=True)
        else:
            board.commands.execute(Stop(grace=False), now)
            board.network.listen_from(None)
            board.start = NO_POWER
        if board.onlookers:
            board.look(now)

    def persist(self) -> Mapping[str, object]:
        """The EEPROM's contents."""
        return self.board.eeprom.stored()

    @property
    def memory_changed(self) -> Callable[[], None] | None:
        """Called each time the contents of the EEPROM have changed."""
        return self.board.memory_changed

    @memory_changed.setter
    def memory_changed(self, told: Callable[[], None] | None) -> None:
        self.board.memory_changed = told

    @property
    def terminal(self) -> HardwarePort:
        """Its hardware port, where its terminal is (``ports.py``)."""
        return self.board.ports_made().hardware

    @property
    def pins(self) -> SacPins:
        """Its pins, made when they are first asked for: most nodes have nothing wired to them."""
        return self.board.pins

    @property
    def movement(self) -> SacMovement:
        """Its motion as it tells of it, made when it is first asked for."""
        return self.board.movement
