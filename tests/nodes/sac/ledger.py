"""A ledger of one node: what it should have done, reckoned apart from it.

Owns the account that the state machine in ``test_whole_node.py`` holds a node against: pulses,
session, queue, and what it may say on the line. The node tells of the lines that it takes; all else
is looked at from outside, between any two events. What it reckons with is the language alone (its
parser, ``Session``, ``edited``), never the node's own idea of what comes next.

Positions are microsteps; pulses are the same in number, but with auto-micro.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from nodes.sac import SacNode, SacSettings
from nodes.sac.board import SacBoard
from nodes.sac.order import Source
from nodes.sac.ports import understand
from sacbus.kernel import LineRate, Ns
from sacbus.language import (
    QUEUE_LENGTH,
    Acceleration,
    ClearQueue,
    Command,
    Configure,
    Deceleration,
    EditQueue,
    Forward,
    Motion,
    Move,
    Next,
    ProgramQueue,
    ProgramReferences,
    Ramp,
    Reboot,
    ReleaseSync,
    RestoreQueue,
    RunPosition,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    Session,
    SinglePulses,
    StepMode,
    Stop,
    SystemCommand,
    ThrowAway,
    ToggleStepMode,
    Undo,
    Velocity,
    cleared_row,
    edited,
    parse,
    parse_in,
    seeded_row,
)
from sacbus.motion import Profile
from sacbus.node import Report
from sacbus.wire import DC1, DC2, GENERAL_CALL, NAK, STX, ack, encode

__all__ = ["Ledger", "WatchedNode"]


class WatchedBoard(SacBoard):
    """The parts of a SAC, which has its ledger know of each line it takes, before and after."""

    ledger: Ledger

    def network_line(self, body: bytes, source: int, destination: int, now: Ns) -> None:
        ledger = self.ledger
        ledger.before_packet(source, destination)
        command = parse(body).command
        if isinstance(command, ProgramQueue | ProgramReferences | Configure):
            command = None  # opens a screen, and that does nothing from here
        before = ledger.before_line(command, now)
        super().network_line(body, source, destination, now)
        ledger.after_line(before, now)

    def line_typed(self, line: bytes, now: Ns) -> None:
        ledger = self.ledger
        terminal = self.terminal_port
        assert terminal is not None
        before = ledger.before_line(parse_in(terminal.mode, line).command, now)
        super().line_typed(line, now)
        ledger.after_line(before, now)


class WatchedNode(SacNode):
    """A SAC with a board that is watched."""

    board: WatchedBoard

    def __init__(
        self,
        address: int,
        settings: SacSettings,
        rate: LineRate,
        tell: Callable[[Report], None],
        memory: Mapping[str, object] | None,
    ) -> None:
        self.board = WatchedBoard(address, settings, rate, tell, memory)


@dataclass
class Run:
    """A command on its way, and where the motor stood before it.

    ``disturbed``: something has come that may end it early, or it has no end of its own.
    ``started``: when its first pulse is issued, as far as that is known.
    """

    profile: Profile
    motion: Motion
    began_at: int
    started: Ns | None
    disturbed: bool

    @property
    def sign(self) -> int:
        return 1 if self.motion.cw else -1

    @property
    def asked(self) -> int:
        """Microsteps of a command that comes to its end, without their direction."""
        motion = self.motion
        assert motion.steps is not None
        extra = 0 if self.profile.shares.truncated else motion.extra_pulses
        steps = motion.steps if motion.pulses else motion.steps << self.profile.drive.ustep
        return steps + extra


@dataclass(frozen=True)
class Before:
    """The node when a line came."""

    command: Command | None
    boot: object
    idle: bool
    barred: bool
    ustep: int
    rows: tuple[Motion, ...]
    next_free: int
    pending: tuple[int, ...]


class Ledger:
    """The account of a node, from when it is made on, on a line of ``baud``."""

    def __init__(self, node: WatchedNode, baud: int) -> None:
        self.node = node
        self._baud = baud
        self.run: Run | None = None
        #: Where the motor stood at the last look, in microsteps and in pulses.
        self.position = (0, 0)
        self.pending: tuple[int, ...] = ()
        self.estop_is_low = False
        self.last_source = GENERAL_CALL
        #: What may be heard of the node yet.
        self.owed: Counter[bytes] = Counter()
        self.naks_owed = 0
        #: Whether the line may not be judged: the node is a terminal there, or at another rate.
        self.astray_until: Ns = 0
        self._boot: object = None
        self._see_boot()
        node.board.ledger = self

    # ---- time ----

    def passed(self, now: Ns) -> None:
        """Nothing was due up to ``now``: what runs has gone on, what stands has not moved."""
        before, after = self.position, self._where(now)
        run = self.run
        if run is None:
            assert after == before, "the motor moves though no command runs"
        else:
            moved = [run.sign * (new - old) for new, old in zip(after, before, strict=True)]
            assert min(moved) >= 0, "the motor turns against its command"
            if not run.disturbed:
                assert run.sign * (after[0] - run.began_at) <= run.asked, "more steps than asked"
        self.position = after

    def happened(self, now: Ns) -> None:
        """Events were due at ``now``: a command may have ended, and the next one been taken."""
        self._look(now)
        commands = self.node.board.commands
        pending = tuple(commands.queue.pending)
        if pending != self.pending:
            assert pending == self.pending[1:], "not the command whose turn it was"
            taken = commands.queue.row(self.pending[0])
            assert taken in (commands.current, commands.held)
            assert commands.source is Source.QUEUE
        self._check(now)

    def acted(self, now: Ns) -> None:
        """Somebody has done something to a pin, or to the power, at ``now``."""
        self._look(now)
        self._check(now)

    def disturb(self) -> None:
        """What runs may end early, or turn otherwise."""
        if self.run is not None:
            self.run.disturbed = True

    def estop(self, level: int) -> None:
        """E-stop is about to have this level; low stops all."""
        self.estop_is_low = not level
        if not level:
            self.disturb()

    def stands(self) -> None:
        """All has been stopped just now: nothing runs, waits, or is to come."""
        commands = self.node.board.commands
        assert commands.current is None
        assert commands.held is None
        assert not commands.pending
        assert not commands.looping

    def may_step(self, pulses: int) -> None:
        """Single pulses are due, if nothing runs; without a command that would count them."""
        if self.run is None and not self.estop_is_low:
            self.position = (self.position[0] + pulses, self.position[1] + pulses)

    def turned(self, now: Ns) -> None:
        """The encoder has been turned, by a quarter at most: that may be a single pulse."""
        moved = self._where(now)[1] - self.position[1]
        if moved in (-1, 1) and not self.node.board.throttles and self.node.board.booted:
            self.may_step(moved)
        self.acted(now)

    def _where(self, now: Ns) -> tuple[int, int]:
        snapshot = self.node.snapshot(now)
        per_step = 2**self.node.board.obeyed.ustep
        return round(snapshot.position_steps * per_step), snapshot.position_pulses

    def _look(self, now: Ns) -> None:
        """See whether what runs is still what ran."""
        self._see_boot()
        run, engine = self.run, self.node.board.engine
        profile, motion = engine.profile, self.node.board.commands.current
        if run is not None and run.profile is profile:
            run.started = engine.started
        elif (
            run is not None
            and run.disturbed
            and (run.motion, run.started)
            == (
                motion,
                engine.started,
            )
        ):
            assert profile is not None
            run.profile = profile  # the same command, cut short
        elif run is not None:
            if not run.disturbed:
                moved = run.sign * (self.position[0] - run.began_at)
                assert moved == run.asked, "a command that nothing disturbed made other steps"
            self.run = None
        if profile is not None and self.run is None:
            assert motion is not None
            endless = motion.steps is None
            self.run = Run(profile, motion, self.position[0], engine.started, disturbed=endless)
            if self.soft_ops:
                for code in (DC1, DC2):
                    self.owed[self._packet(GENERAL_CALL, bytes((code,)))] += 1
        if self.run is None:
            assert self._where(now) == self.position, "the motor has moved without a command"
        self.position = self._where(now)

    def _check(self, now: Ns) -> None:
        """What holds at any time."""
        commands = self.node.board.commands
        queue = commands.queue
        assert commands.session == self.session
        assert 1 <= queue.next_free <= QUEUE_LENGTH
        assert len(set(queue.pending)) == len(queue.pending) <= QUEUE_LENGTH
        assert commands.current is None or commands.held is None
        assert (commands.current is None) is (self.node.board.engine.profile is None)
        self.pending = tuple(queue.pending)
        self._see_whether_astray(now)

    def _see_boot(self) -> None:
        """A cold boot, or a factory restore, begins everything anew."""
        commands = self.node.board.commands
        if commands is self._boot:
            return
        self._boot = commands
        self.run = None
        self.position = (0, 0)
        self.pending = ()
        self.last_source = GENERAL_CALL
        self._begin_session()

    def _begin_session(self) -> None:
        """The settings of the session are the memory's."""
        memory = self.node.board.eeprom
        self.session = Session.start(memory.defaults())
        self.soft_ops, self.acks, self.crcs = memory.soft_ops, memory.ack, memory.crc

    # ---- lines ----

    def before_line(self, command: Command | None, now: Ns) -> Before:
        """A line is about to be obeyed."""
        self.happened(now)
        commands = self.node.board.commands
        queue = commands.queue
        endless = isinstance(command, Move) and not command.steps
        if endless or isinstance(command, Stop | Next | RunPosition | ThrowAway | SystemCommand):
            self.disturb()
        idle = commands.current is None and commands.held is None
        if isinstance(command, SinglePulses) and commands.current is None:
            self.may_step(command.signs.count("+") - command.signs.count("-"))
        if isinstance(command, Forward):
            to = self.last_source if command.destination is None else command.destination
            self.owed[self._packet(to, command.rest.encode("latin-1"))] += 1
        return Before(
            command,
            self._boot,
            idle,
            self.estop_is_low,
            self.node.board.obeyed.ustep,
            queue.rows(),
            queue.next_free,
            self.pending,
        )

    def after_line(self, before: Before, now: Ns) -> None:
        """It has been obeyed: hold session, queue and motor against what it says."""
        command = before.command
        moved = self._expect_session(command)
        commands = self.node.board.commands
        if isinstance(command, Reboot):
            self._count_in_other_microsteps(before.ustep, now)
        starts_now = isinstance(command, ReleaseSync) and self.node.board.engine.started == now
        if not starts_now:
            assert self._where(now) == self.position, "a line has moved the motor at once"
        self._look(now)
        self._check(now)
        self._check_rows(before, moved)
        if command == Stop(grace=False) or isinstance(command, SystemCommand):
            self.stands()
        elif isinstance(command, Move) and moved is not None and before.idle and not before.barred:
            assert moved in (commands.current, commands.held)

    def _count_in_other_microsteps(self, ustep: int, now: Ns) -> None:
        """The motor stands where it stood, or on the nearest of its new microsteps."""
        place, pulses = self._where(now)
        moved = abs((place << ustep) - (self.position[0] << self.node.board.obeyed.ustep))
        assert 2 * moved <= 1 << ustep
        assert pulses == self.position[1]
        self.position = (place, pulses)

    def _expect_session(self, command: Command | None) -> Motion | None:
        """What the line leaves of the session; the motion that it puts into the queue."""
        session = self.session
        match command:
            case Move():
                motion, after = session.resolve(command)
                if motion.steps is not None:
                    self.session = after
                    return motion
            case Velocity():
                self.session = session.with_velocity(command)
            case Acceleration():
                self.session = session.with_acceleration(command)
            case Deceleration():
                self.session = session.with_deceleration(command)
            case Ramp(linear):
                self.session = session.with_ramp(linear=linear)
            case StepMode(full_step):
                self.session = session.with_full_step(full_step=full_step)
            case ToggleStepMode():
                self.session = session.with_full_step(full_step=not session.full_step)
            case SendSoftOps(on):
                self.soft_ops = on
            case SendAcks(on):
                self.acks = on
            case SendCrcs(on):
                self.crcs = on
            case Reboot():
                self._begin_session()
            case _:
                pass
        return None

    def _check_rows(self, before: Before, moved: Motion | None) -> None:
        """The queue's positions after a line, from those before it."""
        queue, session = self.node.board.commands.queue, self.session
        rows, next_free = list(before.rows), before.next_free
        match before.command:
            case Move() if moved is not None:
                rows[next_free - 1] = moved
                next_free = next_free % QUEUE_LENGTH + 1
            case EditQueue(position, edit):
                rows[position - 1] = edited(rows[position - 1], edit, session.defaults)
            case ClearQueue():
                rows, next_free = [cleared_row(session)] * QUEUE_LENGTH, 1
            case RestoreQueue():
                seeded = (seeded_row(session.defaults),) * QUEUE_LENGTH
                rows, next_free = list(self.node.board.eeprom.queue or seeded), 1
            case Undo():
                changed = [new for old, new in zip(rows, queue.rows(), strict=True) if old != new]
                assert len(changed) <= 1
                return
            case _:
                pass
        assert list(queue.rows()) == rows
        assert queue.next_free == next_free

    # ---- the line of the bus ----

    def before_packet(self, source: int, destination: int) -> None:
        """A packet was accepted, and is about to be obeyed."""
        if destination == GENERAL_CALL:
            return
        self.last_source = source
        if self.acks:
            self.owed[ack(source, self.node.address)] += 1

    def may_refuse(self, packets: int) -> None:
        """So many packets are on their way to it that may arrive with a wrong CRC."""
        self.naks_owed += packets

    def says(self, at: Ns, data: bytes) -> None:
        """The node begins to say something on the line, at ``at``."""
        self._see_whether_astray(at)
        if at <= self.astray_until:
            return
        if len(data) == 4 and data[0] == STX and data[3] == NAK and self.naks_owed:
            self.naks_owed -= 1
            return
        assert self.owed[data], f"nobody is owed {data!r}"
        self.owed[data] -= 1

    def _packet(self, to: int, body: bytes) -> bytes:
        return encode(to, self.node.address, body, crc=bool(self.crcs))

    def _see_whether_astray(self, now: Ns) -> None:
        node = self.node
        if node.board.obeyed.network or not understand(node.board.obeyed.sw, self._baud):
            self.astray_until = now
