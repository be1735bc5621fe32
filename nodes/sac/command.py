"""The command processor: which command runs now, and which one next.

Owns the session defaults and the order of execution: the queue (``queue.py``), loops (``loop.py``)
and what goes before both, by the table in ``order.py``. How a command is started and ended is
``execution.py``'s business, what a line means the message processor's. Time is an argument, in ns.

What comes next is worked out when nothing runs: first what goes before all else, X or continuous
motion (of several that come while the present pulse ends, the newest); then a loop; then what is
pending in the queue.
Source: manual, "Command buffer", "Motion", "Loop", "xRef", "Continuous", "Throw-away"; spec,
commands.
"""

from __future__ import annotations

from dataclasses import replace
from typing import assert_never

from nodes.sac.engine import Engine
from nodes.sac.execution import Execution, Told, shortest
from nodes.sac.loop import Loop
from nodes.sac.order import RULES, Cue, LoopFate, Present, Source
from nodes.sac.queue import Queue
from sacbus.kernel import Ns
from sacbus.language import (
    QUEUE_LENGTH,
    Acceleration,
    ClearQueue,
    Deceleration,
    EditQueue,
    EndLoop,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    Motion,
    Move,
    Next,
    ReleaseSync,
    RunPosition,
    RunReferences,
    Session,
    SetReference,
    SinglePulses,
    Stop,
    ThrowAway,
    ToggleDebug,
    ToggleGap,
    Undo,
    Velocity,
    cleared_row,
    edited,
)
from sacbus.motion import Drive, Timebase
from sacbus.node import ReportKind

__all__ = ["CommandProcessor", "Obeyed", "shortest"]

#: The commands that end here; what shows something, and the system's, are others' business.
Obeyed = (
    Move
    | ThrowAway
    | Velocity
    | Acceleration
    | Deceleration
    | Stop
    | Next
    | ReleaseSync
    | SinglePulses
    | EditQueue
    | ClearQueue
    | LoopStart
    | LoopFinish
    | LoopCount
    | LoopQueue
    | EndLoop
    | RunReferences
    | RunPosition
    | SetReference
    | ToggleGap
    | ToggleDebug
    | Undo
)


class CommandProcessor:
    """Executes commands on an engine. ``told`` takes what is worth a report."""

    __slots__ = (
        "_barred",
        "_engine",
        "_loop",
        "_preempting",
        "_preempting_source",
        "_run",
        "_told",
        "debug",
        "queue",
        "session",
    )

    def __init__(self, session: Session, drive: Drive, engine: Engine, told: Told) -> None:
        self.session = session
        self.queue = Queue(session.defaults)
        #: Whether debug mode is on (B toggles it).
        self.debug = False
        self._run = Execution(drive, engine, session.defaults, told)
        self._engine = engine
        self._told = told
        #: Made when it is first asked for: most nodes never loop.
        self._loop: Loop | None = None
        #: What begins as soon as what it cuts has ended: continuous motion, or an X.
        self._preempting: Motion | None = None
        self._preempting_source = Source.ONCE
        #: Whether nothing may start: e-stop is low.
        self._barred = False

    # ---- looking ----

    @property
    def current(self) -> Motion | None:
        """The command that runs, or waits for its start; None when none does."""
        return self._run.current

    @property
    def held(self) -> Motion | None:
        """The command that is held at sync."""
        return self._run.held

    @property
    def source(self) -> Source:
        """Where the current or the held command comes from."""
        return self._run.source

    @property
    def pending(self) -> list[Motion]:
        """Commands that wait in the queue, in order."""
        return self.queue.waiting()

    @property
    def gap(self) -> bool:
        """Whether GAP testing is on."""
        return self._run.gap

    @property
    def tells_ops(self) -> bool:
        """Whether anybody is told of the starts and ends of commands."""
        return self._run.tells_ops

    @property
    def looping(self) -> bool:
        """Whether a loop has commands to come, at once or when what goes before it is over."""
        return self._loop is not None and self._loop.running

    @property
    def references(self) -> tuple[int, ...]:
        """The xRef array as far as it was programmed; a 0 ends it."""
        return () if self._loop is None else self._loop.references

    @property
    def due(self) -> Ns | None:
        """When the command that runs is over, or its start is to be told; None: never."""
        return self._run.due

    # ---- what comes from outside ----

    def wake(self, now: Ns) -> None:
        """End the command that is over, and go on with the next."""
        run = self._run
        if run.due is None or run.due > now:
            return
        end = run.wake(now)
        if end is not None:
            self._load_next(end)
        run.see_what_is_due()

    def set_clock(self, clock: Timebase, now: Ns) -> None:
        """Pulses are timed by another clock from ``now`` on."""
        self._run.set_clock(clock, now)
        self._run.see_what_is_due()

    def switch_ops(self, *, on: bool, now: Ns) -> None:
        """Have the starts and ends of commands told from ``now`` on, or no longer."""
        self._run.switch_ops(on=on, now=now)
        self._run.see_what_is_due()

    def bar(self, *, barred: bool, now: Ns) -> None:
        """E-stop goes low: all stops, and nothing starts until it is high again."""
        self._barred = barred
        if barred:
            self._obey(Cue.STOP, now)
        else:
            self._load_next(now)
        self._run.see_what_is_due()

    def throttle(self, change_rpm: int, now: Ns) -> None:
        """Turn the speed of continuous motion up or down, never below 1 RPM."""
        current = self._run.current
        if current is not None and self._may_retarget():
            rpm = max(1, current.rpm + change_rpm)
            cycle_us = self.session.defaults.cycle_of(rpm)
            self._retarget(replace(current, rpm=rpm, cycle_us=cycle_us, by_cycle=False), now)
            self._run.see_what_is_due()

    def autorun(self, finish: int, now: Ns) -> None:
        """Loop from position 1 to this one, as after a boot."""
        self._looping().run(1, min(finish, QUEUE_LENGTH))
        self._load_next(now)
        self._run.see_what_is_due()

    def reboot(self, session: Session, drive: Drive, now: Ns) -> None:
        """Stop, and go on with other parameters; the queue and the xRef array stay."""
        self._obey(Cue.STOP, now)
        self._run.see_what_is_due()
        self.session = session
        self.debug = False
        self._run.reboot(drive, session.defaults)

    # ---- commands ----

    def execute(self, command: Obeyed, now: Ns) -> None:
        """Do what a command says, at ``now``."""
        if type(command) is Move:  # nearly all are, and this is much quicker than a match
            self._move(command, now)
        else:
            self._execute(command, now)
        self._run.see_what_is_due()

    def _execute(self, command: Obeyed, now: Ns) -> None:
        match command:
            case Move():
                self._move(command, now)
            case ThrowAway(move):
                self._throw_away(move, now)
            case Velocity():
                self.session = self.session.with_velocity(command)
                self._follow_session_velocity(now)
            case Acceleration():
                self.session = self.session.with_acceleration(command)
            case Deceleration():
                self.session = self.session.with_deceleration(command)
            case Stop(grace):
                self._obey(Cue.STOP, now, grace=grace)
            case Next(grace):
                self._obey(Cue.NEXT, now, grace=grace)
                self._load_next(now)
            case ReleaseSync():
                self._run.release(now)
            case SinglePulses(signs):
                self._single_pulses(signs)
            case ToggleGap():
                self._run.gap = not self._run.gap
            case ToggleDebug():
                self.debug = not self.debug
            case EditQueue(position, edit):
                row = edited(self.queue.row(position), edit, self.session.defaults)
                self.queue.write(position, row)
            case ClearQueue():
                self.queue.load([cleared_row(self.session)] * QUEUE_LENGTH)
            case Undo():
                if self.queue.undo() is None:
                    self._ignored("no queue position has been written that could be put back")
            case RunPosition(position):
                self._go_before(self.queue.row(position), Source.ONCE, now)
            case _:
                self._execute_loop(command, now)

    def _execute_loop(
        self,
        command: LoopStart
        | LoopFinish
        | LoopCount
        | LoopQueue
        | EndLoop
        | RunReferences
        | SetReference,
        now: Ns,
    ) -> None:
        loop = self._looping()
        if not loop.running:
            self._run.forget_warnings()
        match command:
            case LoopStart(position):
                if not loop.start_at(position):
                    self._ignored(f"a loop that finishes at {position} must start elsewhere")
            case LoopFinish(position):
                if not loop.finish_at(position):
                    self._ignored(f"a loop that starts at {position} must finish elsewhere")
            case LoopCount(count):
                loop.count_to(count)
            case LoopQueue():
                loop.run(1, QUEUE_LENGTH)
            case RunReferences(count):
                if not loop.run_references(count):
                    self._ignored("the xRef array is empty or has no end: give its end a 0")
            case SetReference(index, position):
                loop.refer(index, position)
            case EndLoop():
                self._end_loop(loop, now)
            case _:
                assert_never(command)
        self._load_next(now)

    def _move(self, move: Move, now: Ns) -> None:
        """M: the next queue position, or continuous motion at once."""
        motion, self.session = self.session.resolve(move)
        if motion.steps is None:
            self.queue.continuous = motion
            self._go_before(motion, Source.CONTINUOUS, now)
            return
        lost = self.queue.add(motion)
        if lost is not None:
            self._told.tell_of_command(
                ReportKind.OVERRUN, f"queue position {lost} overwritten, which was pending"
            )
        if self._run.idle:
            self._load_next(now)

    def _throw_away(self, move: Move, now: Ns) -> None:
        """XM: at once, and the session stays as it was."""
        motion, _ = self.session.resolve(move)
        if motion.steps is None:
            self.queue.continuous = motion
            self._go_before(motion, Source.CONTINUOUS, now)
        else:
            self.queue.throw_away = motion
            self._go_before(motion, Source.ONCE, now)

    def _go_before(self, motion: Motion, source: Source, now: Ns) -> None:
        """Have a command run as soon as what it cuts has ended."""
        self._put_back(now)
        self._preempting = motion
        self._preempting_source = source
        if not self._run.stopping:  # what comes while the motor slows down waits for that
            self._obey(Cue.CONTINUOUS if source is Source.CONTINUOUS else Cue.ONCE, now)
        self._load_next(now)

    def _put_back(self, now: Ns) -> None:
        """What is held, or waits for its start, goes back to where it came from; if there is room.

        It has not begun, so it is the next one after what goes before it.
        """
        taken = self._run.take_back(now)
        if taken is None:
            return
        motion, source, position = taken
        if source is Source.LOOP:
            self._looping().again()
        elif source is Source.QUEUE and position is not None and not self.queue.put_back(position):
            self._told.tell_of_command(
                ReportKind.OVERRUN,
                f"{shortest(motion, self.session.defaults)} had not begun, and is overwritten",
            )

    def _load_next(self, now: Ns) -> None:
        """Load the next command if nothing runs, waits or is held."""
        if not self._run.idle:
            return
        if self._barred:
            if self._preempting is not None or self.looping or self.queue.pending:
                self._told.tell_of_command(
                    ReportKind.WARNING, "e-stop is low: nothing starts until it is high"
                )
            return
        motion = self._preempting
        if motion is not None:
            self._preempting = None
            self._run.load(motion, self._preempting_source, None, now)
            return
        if self._loop is not None and (position := self._loop.take()) is not None:
            self._run.load(self.queue.row(position), Source.LOOP, position, now)
        elif self.queue.pending:
            position = self.queue.pending.pop(0)
            self._run.load(self.queue.row(position), Source.QUEUE, position, now)

    def _obey(self, cue: Cue, now: Ns, *, grace: bool = False) -> None:
        """Do what the table says to what runs, what is held, the loop, and what waits."""
        run = self._run
        rule = RULES[run.source, cue]
        if self._loop is not None:
            if rule.loop is LoopFate.ENDS:
                self._loop.end()
            elif rule.loop is LoopFate.ONE_MORE:
                self._loop.only_one_more()
        if not rule.waits:
            self.queue.pending.clear()
            self._preempting = None
        match rule.present:
            case Present.GOES_ON:
                return
            case Present.CUT:
                run.cut(now)
            case Present.ENDS if not grace:
                run.cut(now)
            case Present.ENDS | Present.SLOWS:
                self._slow_down(now)
            case Present.STOPS:
                self._stop(now, grace=grace)
            case _:
                assert_never(rule.present)
        run.drop_held()

    def _slow_down(self, now: Ns) -> None:
        """End what runs with its own deceleration."""
        current = self._run.current
        if current is not None:
            self._run.slow_down(current.dec100, linear=current.linear, now=now)

    def _stop(self, now: Ns, *, grace: bool) -> None:
        run = self._run
        run.forget_velocity()
        if grace and run.current is not None:
            run.stopping = True
            run.slow_down(self.session.dec100, linear=self.session.linear, now=now)
            run.stopping = run.current is not None  # it may not have begun
        else:
            run.halt(now)

    def _end_loop(self, loop: Loop, now: Ns) -> None:
        """L: the loop ends after the present command; endless motion, wherever from, slows down."""
        run = self._run
        current, source = run.current, run.source
        endless = current is not None and current.steps is None
        if not endless and source is not Source.CONTINUOUS and not loop.set:
            self._ignored("no loop runs, and no continuous motion")
            return
        self._obey(Cue.END, now)
        if endless and source is not Source.CONTINUOUS:
            # A position of the queue that has 0 steps: to its end it would never come.
            self._slow_down(now)

    # ---- new velocities ----

    def _follow_session_velocity(self, now: Ns) -> None:
        """A new session velocity re-targets continuous motion, with the session's acceleration."""
        if self._preempting is not None and self._preempting.steps is None:
            # It waits for the present pulse to end, and begins with the new velocity then.
            self._preempting = self._at_session_velocity(self._preempting)
        elif self._may_retarget() and self._run.current is not None:
            self._retarget(self._at_session_velocity(self._run.current), now)

    def _may_retarget(self) -> bool:
        """Whether continuous motion runs, and is not coming to its end."""
        current = self._run.current
        if current is None or current.steps is not None or self._preempting is not None:
            return False
        profile = self._run.profile
        return profile is not None and profile.duration is None

    def _retarget(self, motion: Motion, now: Ns) -> None:
        session = self.session
        self._run.retarget(replace(motion, acc100=session.acc100, linear=session.linear), now)

    def _at_session_velocity(self, motion: Motion) -> Motion:
        session = self.session
        return replace(
            motion,
            rpm=session.rpm,
            cycle_us=session.cycle_us,
            by_cycle=session.by_cycle,
            acc100=session.acc100,
            linear=session.linear,
        )

    # ---- the rest ----

    def step(self, pulses: int) -> bool:
        """Single pulses, clockwise up; False while a command runs or waits, or e-stop is low."""
        if self._run.current is not None or self._barred:
            return False
        self._engine.step(pulses)
        return True

    def _single_pulses(self, signs: str) -> None:
        if not self.step(signs.count("+") - signs.count("-")):
            self._ignored("single pulses only while no command runs or waits, and e-stop is high")

    def _looping(self) -> Loop:
        if self._loop is None:
            self._loop = Loop()
        return self._loop

    def _ignored(self, text: str) -> None:
        self._told.tell_of_command(ReportKind.IGNORED, text)
