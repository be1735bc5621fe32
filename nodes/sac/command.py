"""The command processor: the queue, what is pending, and which command runs now.

Owns the session defaults, the 30 queue positions, the order of execution, sync, start wait, GAP and
the stops. Turns commands into profiles (``sacbus.motion``) and gives them to the engine; what a
line means is the message processor's business. Time is an argument, in ns.
Source: manual, "Command buffer", "Motion", "Continuous", "GAP", "sync"; spec, commands and motion.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final, Protocol, assert_never

from nodes.sac.engine import Engine
from sacbus.kernel import Ns
from sacbus.language import (
    Acceleration,
    Deceleration,
    Defaults,
    Motion,
    Move,
    Next,
    ReleaseSync,
    Session,
    ShowVelocity,
    SinglePulses,
    Stop,
    Velocity,
)
from sacbus.motion import (
    TICKS_PER_US,
    Drive,
    Profile,
    Rpm,
    Timebase,
    gap_passes,
    load_ticks,
    plan,
)
from sacbus.node import ReportKind

__all__ = ["QUEUE_LENGTH", "CommandProcessor", "MotionCommand", "shortest"]

#: Positions of the command queue (manual, "Throw-away").
QUEUE_LENGTH: Final = 30

#: The commands that end here; a message processor deals with the others itself.
MotionCommand = (
    Move
    | Velocity
    | ShowVelocity
    | Acceleration
    | Deceleration
    | Stop
    | Next
    | ReleaseSync
    | SinglePulses
)


class SoftOps(Protocol):
    """Tells the network that a command starts or ends."""

    def __call__(self, *, start: bool, at: Ns) -> Ns:
        """Have it told at ``at`` or as soon after as may be; when that will be out."""
        ...


class TellOfCommand(Protocol):
    """Takes what is worth a report."""

    def __call__(self, kind: ReportKind, text: str, command: str | None = None, /) -> None:
        """``command`` is what it is about; None: the line that has just come."""
        ...


class CommandProcessor:
    """Executes commands on an engine.

    ``soft_ops`` is None when they are off. ``tell`` takes what is worth a report.
    """

    __slots__ = (
        "_current",
        "_drive",
        "_engine",
        "_free",
        "_held",
        "_held_at",
        "_held_loaded",
        "_kept_rpm",
        "_last",
        "_last_end",
        "_last_period",
        "_pending",
        "_position",
        "_preempting",
        "_queue",
        "_soft_ops",
        "_stopping",
        "_tell",
        "_untold",
        "due",
        "session",
    )

    def __init__(
        self,
        session: Session,
        drive: Drive,
        engine: Engine,
        soft_ops: SoftOps | None,
        tell: TellOfCommand,
    ) -> None:
        self.session = session
        self._drive = drive
        self._engine = engine
        self._soft_ops = soft_ops
        #: Whether soft ops have yet to tell of the start.
        self._untold = False
        self._tell = tell
        #: Positions 1 to 30. The manual's hidden position 0 keeps nothing: continuous motion is
        #: thrown away.
        self._queue: list[Motion | None] = [None] * (QUEUE_LENGTH + 1)
        self._position = 1
        #: Those that wait, in order: a list, since an empty deque takes as much as all else here.
        self._pending: list[int] = []
        self._current: Motion | None = None
        self._held: Motion | None = None
        #: Where in the queue the held command stands (None: nowhere), and when it was loaded.
        self._held_at: int | None = None
        self._held_loaded: Ns = 0
        #: Continuous motion that begins as soon as what it cuts has ended.
        self._preempting: Motion | None = None
        #: When the node is free to load: now, or when its DC2 is out.
        self._free: Ns = 0
        self._kept_rpm: Rpm = 0
        self._last_end: Ns = 0
        self._last_period = 0
        #: The command that was loaded last.
        self._last: Motion | None = None
        self._stopping = False
        #: When the command that runs is over, or its start is to be told; None: never.
        self.due: Ns | None = None

    @property
    def current(self) -> Motion | None:
        """The command that runs, or waits for its start; None when none does."""
        return self._current

    @property
    def held(self) -> Motion | None:
        """The command that is held at sync."""
        return self._held

    @property
    def pending(self) -> list[Motion]:
        """Commands that wait for their turn, in order."""
        return [motion for at in self._pending if (motion := self._queue[at]) is not None]

    def wake(self, now: Ns) -> None:
        """End the command that is over, and go on with the next."""
        if self.due is None or self.due > now:
            return
        if self._untold and self._engine.begun(now):
            self._tell_start()
        end = self._engine.end
        if end is not None and end <= now:
            self._finish(end)
            self._load_next(end)
        self._see_what_is_due()

    def set_clock(self, clock: Timebase, now: Ns) -> None:
        """Pulses are timed by another clock from ``now`` on."""
        self._engine.set_clock(clock, now)
        self._see_what_is_due()

    def _see_what_is_due(self) -> None:
        self.due = self._engine.started if self._untold else self._engine.end

    def execute(self, command: MotionCommand, now: Ns) -> None:
        """Do what a command says, at ``now``."""
        if type(command) is Move:  # nearly all are, and this is much quicker than a match
            self._move(command, now)
        else:
            self._execute(command, now)
        self._see_what_is_due()

    def _execute(self, command: MotionCommand, now: Ns) -> None:
        match command:
            case Move():
                self._move(command, now)
            case Velocity():
                self.session = self.session.with_velocity(command)
                self._retarget(now)
            case Acceleration():
                self.session = self.session.with_acceleration(command)
            case Deceleration():
                self.session = self.session.with_deceleration(command)
            case Stop(grace):
                self._stop(grace, now)
            case Next(grace):
                self._next(grace, now)
            case ReleaseSync():
                self._release(now)
            case SinglePulses(signs):
                self._single_pulses(signs)
            case ShowVelocity():
                # It prints on the terminal alone (spec, "Two ports"); the network hears nothing.
                self._tell(ReportKind.IGNORED, "a query is answered on the terminal only")
            case _:
                assert_never(command)

    def _move(self, move: Move, now: Ns) -> None:
        """M: the next queue position, or continuous motion at once."""
        motion, self.session = self.session.resolve(move)
        if motion.steps is None:
            self._preempt(motion, now)
            return
        if len(self._pending) >= QUEUE_LENGTH:
            self._tell(
                ReportKind.OVERRUN,
                f"31 commands pending: queue position {self._position} overwritten",
            )
        else:
            self._pending.append(self._position)
        self._queue[self._position] = motion
        self._position = self._position % QUEUE_LENGTH + 1
        self._load_next(now)

    def _preempt(self, motion: Motion, now: Ns) -> None:
        """Continuous motion goes before what is pending; what runs is cut, its velocity kept."""
        if self._held is not None:
            # It goes back to the head of what is pending, to be held again; if there is room.
            held, self._held = self._held, None
            if self._held_at is not None and self._queue[self._held_at] is held:
                self._pending.insert(0, self._held_at)
            else:
                self._tell(
                    ReportKind.OVERRUN,
                    f"{shortest(held, self.session.defaults)} was held, and is overwritten",
                )
        self._preempting = motion
        if not self._stopping:  # what comes while the motor slows down waits for that
            self._cut(now)
        self._load_next(now)

    def _load_next(self, now: Ns) -> None:
        """Load the next command if nothing runs, waits or is held."""
        if self._current is not None or self._held is not None:
            return
        motion = self._preempting
        position = None
        if motion is not None:
            self._preempting = None
        elif self._pending:
            position = self._pending.pop(0)
            motion = self._queue[position]
        if motion is None:
            return
        load = self._engine.processing(load_ticks(_changes_acceleration(self._last, motion)))
        self._last = motion
        loaded = max(now, self._free) + load
        if motion.sync:
            self._held = motion
            self._held_at = position
            self._held_loaded = loaded
        else:
            self._launch(motion, loaded, was_waiting=now <= self._last_end)

    def _launch(self, motion: Motion, ready: Ns, *, was_waiting: bool) -> None:
        """Plan a command that may start at ``ready``, and start it after its start wait.

        Seamless when it may start within one more period of the last one's end: then it keeps the
        velocity, and if it was waiting at that end, loading adds no time. Else it starts at slow.
        """
        engine = self._engine
        wait = motion.wait_us * TICKS_PER_US
        kept = self._kept_rpm
        if kept:
            late = engine.clock.ticks_in(ready - self._last_end) + wait
            if not (engine.clock.runs and gap_passes(late, self._last_period)):
                kept = 0
            elif was_waiting and not wait:
                ready = self._last_end
        profile = plan(motion, self._drive, kept)
        self._current = motion
        engine.start(profile, ready, wait)
        self._warn(profile)
        if not engine.clock.runs:
            self._tell(
                ReportKind.WARNING,
                "external clock: no edges come, so nothing moves before they do",
                shortest(motion, self.session.defaults),
            )
        self._untold = self._soft_ops is not None

    def _warn(self, profile: Profile) -> None:
        for warning in profile.warnings:
            self._tell(
                ReportKind.WARNING, str(warning), shortest(profile.motion, self.session.defaults)
            )

    def _finish(self, end: Ns) -> None:
        """House-keeping in STOP: the present command ends at ``end``."""
        profile = self._engine.profile
        if profile is None:
            return
        kept = self._kept_rpm = 0 if self._stopping else profile.kept_rpm
        if kept:
            self._last_end = end
            self._last_period = profile.last_period
        self._stopping = False
        self._current = None
        self._engine.finish(end)
        if self._soft_ops is not None:
            if self._untold:
                self._tell_start()
            self._free = self._soft_ops(start=False, at=end)
            # The packet outlasts the gap (manual, "ops/soft_ops").
            self._kept_rpm = 0

    def _cut(self, now: Ns) -> None:
        """End what runs with its present pulse, keeping its velocity (N, and what preempts)."""
        if self._engine.profile is None:
            return
        if not self._engine.begun(now):
            self._drop_unstarted()
        else:
            self._engine.change(lambda profile, at: profile.cut(at), now)

    def _drop_unstarted(self) -> None:
        """The command's first pulse has not come: it never will."""
        self._engine.discard()
        self._current = None
        self._untold = False

    def _tell_start(self) -> None:
        self._untold = False
        at = self._engine.started
        if self._soft_ops is not None and at is not None:
            self._soft_ops(start=True, at=at)

    def _slow_down(self, dec100: int, linear: bool, now: Ns) -> None:
        if not self._engine.begun(now):
            self._drop_unstarted()
        else:
            self._engine.change(
                lambda profile, at: profile.slow_down(at, dec100, linear=linear), now
            )

    def _stop(self, grace: bool, now: Ns) -> None:
        """S and s: nothing that is pending now will run; it stays in the queue."""
        self._pending.clear()
        self._preempting = None
        self._held = None
        self._kept_rpm = 0
        if self._current is None:
            return
        if not self._engine.begun(now):
            self._drop_unstarted()
            return
        self._stopping = True
        if grace:
            self._slow_down(self.session.dec100, self.session.linear, now)
        else:
            self._engine.change(lambda profile, at: profile.halt(at), now)
            self._finish(now)

    def _next(self, grace: bool, now: Ns) -> None:
        """N and n: the present command ends, the next pending one follows."""
        if self._held is not None:
            self._held = None
        elif self._current is not None:
            if grace:
                self._slow_down(self._current.dec100, self._current.linear, now)
            else:
                self._cut(now)
        self._load_next(now)

    def _release(self, now: Ns) -> None:
        """y: the held command starts. Not remembered when nothing is held."""
        held = self._held
        if held is not None:
            self._held = None
            # It was loaded while it was held: nodes that one broadcast releases start together.
            self._launch(held, max(now, self._held_loaded), was_waiting=False)

    def _retarget(self, now: Ns) -> None:
        """A new session velocity re-targets continuous motion, with the session's acceleration."""
        if self._preempting is not None:
            # It waits for the present pulse to end, and begins with the new velocity then.
            self._preempting = self._at_session_velocity(self._preempting)
            return
        current = self._current
        profile = self._engine.profile
        if current is None or current.steps is not None or profile is None:
            return
        if profile.duration is not None:
            return  # it is coming to its end: S, s, N, n or another command was heard
        target = self._current = self._at_session_velocity(current)
        if not self._engine.begun(now):
            self._engine.replace(plan(target, self._drive, profile.start_rpm))
        else:
            self._engine.change(lambda profile, at: profile.retarget(at, target), now)
        if self._engine.profile is not None:
            self._warn(self._engine.profile)

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

    def _single_pulses(self, signs: str) -> None:
        if self._engine.profile is not None:
            self._tell(
                ReportKind.IGNORED,
                "single pulses only while no command runs, or waits for its start",
            )
            return
        self._engine.step(signs.count("+") - signs.count("-"))


def _changes_acceleration(last: Motion | None, motion: Motion) -> bool:
    return (
        last is None
        or motion.acc100 != last.acc100
        or motion.dec100 != last.dec100
        or motion.linear != last.linear
    )


@lru_cache(maxsize=1_024)
def shortest(motion: Motion, defaults: Defaults) -> str:
    """A resolved command in the manual's shortest form, with all that shapes its profile.

    Its velocity in RPM where that gives this very cycle, as ``v100`` gives 3000 us.
    """
    rpm = motion.rpm
    by_rpm = rpm > 0 and defaults.cycle_of(rpm) == motion.cycle_us
    return Move(
        steps=motion.steps,
        opposite=not motion.cw,
        rpm=rpm if by_rpm else None,
        cycle_us=None if by_rpm else motion.cycle_us,
        acc100=motion.acc100,
        dec100=motion.dec100,
        linear=motion.linear or None,
        extra_pulses=motion.extra_pulses or None,
        pulses=motion.pulses or None,
    ).text()
