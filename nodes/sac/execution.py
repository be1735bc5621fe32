"""The command in execution: loaded, held at sync, started, cut short, ended.

Owns the one command that an engine runs, or will run next: its load time, sync, start wait, GAP and
the velocity that is kept for the next one, and the telling of its start and end. Which command that
is, and what follows it, is the command processor's business. Time is an argument, in ns.
Source: manual, "GAP", "sync", "T/t start wait", "ops/soft_ops"; spec, motion.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from functools import lru_cache
from typing import Final, Protocol

from nodes.sac.engine import Engine
from nodes.sac.order import Source
from sacbus.kernel import Ns
from sacbus.language import Defaults, Motion, Move
from sacbus.motion import (
    TICKS_PER_US,
    Drive,
    Profile,
    Rpm,
    Timebase,
    gap_passes,
    load_ticks,
    plan,
    transition_warnings,
)
from sacbus.node import ReportKind

__all__ = ["Execution", "Told", "shortest"]


_NOTHING: Final[AbstractSet[Motion]] = frozenset()


class Told(Protocol):
    """Who is told what becomes of commands: one object for both, since nodes are many."""

    def tell_of_command(self, kind: ReportKind, text: str, command: str | None = None) -> None:
        """Something worth a report; ``command`` is what it is about, None: the line just come."""
        ...

    def tell_ops(self, *, start: bool, at: Ns) -> Ns:
        """A command starts or ends at this instant; until when the node is busy telling of it."""
        ...


class Execution:
    """The command on an engine.

    ``defaults`` are what its text is shortened by.
    """

    __slots__ = (
        "_before",
        "_drive",
        "_engine",
        "_free",
        "_held_loaded",
        "_kept_rpm",
        "_last",
        "_last_end",
        "_last_period",
        "_position",
        "_told",
        "_untold",
        "_warned",
        "current",
        "defaults",
        "due",
        "gap",
        "held",
        "source",
        "stopping",
        "tells_ops",
    )

    def __init__(self, drive: Drive, engine: Engine, defaults: Defaults, told: Told) -> None:
        self._drive = drive
        self._engine = engine
        self.defaults = defaults
        self._told = told
        #: Whether starts and ends are told of.
        self.tells_ops = False
        #: Whether somebody has yet to be told of the start.
        self._untold = False
        #: The command that runs or waits for its start, and the one that is held at sync.
        self.current: Motion | None = None
        self.held: Motion | None = None
        self._held_loaded: Ns = 0
        #: Where either comes from, and its queue position if it has one.
        self.source = Source.STANDBY
        self._position: int | None = None
        #: Whether what runs is on its way to a stop: then nothing of its velocity is kept.
        self.stopping = False
        #: Whether a velocity is kept only through a gap that is short (G toggles it).
        self.gap = True
        #: When the node is free to load: now, or when it has told of the last end.
        self._free: Ns = 0
        self._kept_rpm: Rpm = 0
        #: The command that kept it; None when there is none.
        self._before: Profile | None = None
        self._last_end: Ns = 0
        self._last_period = 0
        #: The command that was loaded last.
        self._last: Motion | None = None
        #: Commands of the present loop that have been warned of.
        self._warned: AbstractSet[Motion] = _NOTHING
        #: When the command that runs is over, or its start is to be told; None: never.
        self.due: Ns | None = None

    @property
    def idle(self) -> bool:
        """Whether no command runs, waits or is held."""
        return self.current is None and self.held is None

    def waits(self, now: Ns) -> bool:
        """Whether a command is loaded whose first pulse is to come."""
        return self.current is not None and not self._engine.begun(now)

    @property
    def profile(self) -> Profile | None:
        """That of the command that runs or waits for its start."""
        return self._engine.profile

    def switch_ops(self, *, on: bool, now: Ns) -> None:
        """Have the starts and ends of commands told from ``now`` on, or no longer."""
        if on != self.tells_ops:
            self.tells_ops = on
            self._untold = on and self.waits(now)

    def reboot(self, drive: Drive, defaults: Defaults) -> None:
        """Go on with other parameters, at rest. Nothing may run or be held."""
        self._drive = drive
        self.defaults = defaults
        self.gap = True
        self.forget_velocity()
        self._last = None

    def set_clock(self, clock: Timebase, now: Ns) -> None:
        """Pulses are timed by another clock from ``now`` on."""
        self._engine.set_clock(clock, now)

    def see_what_is_due(self) -> None:
        """Work out :attr:`due` anew; after anything that may have changed it."""
        self.due = self._engine.started if self._untold else self._engine.end

    # ---- to the start ----

    def load(self, motion: Motion, source: Source, position: int | None, now: Ns) -> None:
        """Load a command while idle; it starts when it is ready, or is held if it says so.

        ``position`` is where it stands in the queue.
        """
        load = self._engine.processing(load_ticks(_changes_acceleration(self._last, motion)))
        self._last = motion
        self.source = source
        loaded = max(now, self._free) + load
        self._position = position
        if motion.sync:
            self.held = motion
            self._held_loaded = loaded
        else:
            self._launch(motion, loaded, was_waiting=now <= self._last_end)

    def release(self, now: Ns) -> None:
        """Let the held command start. Not remembered when nothing is held."""
        held = self.held
        if held is not None:
            self.held = None
            # It was loaded while it was held: nodes that one broadcast releases start together.
            self._launch(held, max(now, self._held_loaded), was_waiting=False)

    def drop_held(self) -> None:
        """Hold nothing any more."""
        if self.held is not None:
            self.held = None
            self.source = Source.STANDBY

    def take_back(self, now: Ns) -> tuple[Motion, Source, int | None] | None:
        """Give back what is loaded and has not begun: held at sync, or in its start wait.

        The command, where it came from, and its queue position if it has one.
        """
        motion = self.held
        if motion is None and self.waits(now):
            motion = self.current
        if motion is None:
            return None
        source = self.source
        self.drop_held()
        if self.current is not None:
            self._drop_unstarted()
        return motion, source, self._position

    def _launch(self, motion: Motion, ready: Ns, *, was_waiting: bool) -> None:
        """Plan a command that may start at ``ready``, and start it after its start wait.

        Seamless when it may start within one more period of the last one's end: then it keeps the
        velocity, and if it was waiting at that end, loading adds no time. Else it starts at slow,
        unless GAP testing is off: then the velocity stays as it was left.
        """
        engine = self._engine
        wait = motion.wait_us * TICKS_PER_US
        kept = self._kept_rpm
        if kept:
            late = engine.clock.ticks_in(ready - self._last_end) + wait
            if engine.clock.runs and gap_passes(late, self._last_period):
                if was_waiting and not wait and self._free <= self._last_end:
                    ready = self._last_end
            elif self.gap:
                kept = 0
        profile = plan(motion, self._drive, kept)
        self.current = motion
        engine.start(profile, ready, wait)
        before, self._before = self._before, None
        self.warn(profile, transition_warnings(before, profile) if kept and before else ())
        if not engine.clock.runs:
            self._told.tell_of_command(
                ReportKind.WARNING,
                "external clock: no edges come, so nothing moves before they do",
                shortest(motion, self.defaults),
            )
        self._untold = self.tells_ops

    def warn(self, profile: Profile, beginning: tuple[str, ...] = ()) -> None:
        """Report what a profile asks of the hardware that it cannot give.

        ``beginning``: what is to be said of where it begins. Of a command that comes again and
        again in a loop once only: the rest would be drowned.
        """
        warnings = *beginning, *map(str, profile.warnings)
        if warnings and self.source is Source.LOOP:
            if profile.motion in self._warned:
                return
            self._warned = {*self._warned, profile.motion}
        for warning in warnings:
            self._told.tell_of_command(
                ReportKind.WARNING, warning, shortest(profile.motion, self.defaults)
            )

    # ---- on the way ----

    def cut(self, now: Ns) -> None:
        """End what runs with its present pulse, keeping its velocity."""
        if self.current is None:
            return
        if not self._engine.begun(now):
            self._drop_unstarted()
        else:
            self._engine.change(lambda profile, at: profile.cut(at), now)

    def slow_down(self, dec100: int, *, linear: bool, now: Ns) -> None:
        """End what runs by a deceleration (hundredths) from where it is."""
        if self.current is None:
            return
        if not self._engine.begun(now):
            self._drop_unstarted()
        else:
            self._engine.change(
                lambda profile, at: profile.slow_down(at, dec100, linear=linear), now
            )

    def halt(self, now: Ns) -> None:
        """End what runs at once: no pulse more."""
        if self.current is None:
            return
        if not self._engine.begun(now):
            self._drop_unstarted()
            return
        self.stopping = True
        self._engine.change(lambda profile, at: profile.halt(at), now)
        self._finish(now)

    def retarget(self, motion: Motion, now: Ns) -> None:
        """Put other parameters in the place of those of the continuous motion that runs."""
        profile = self._engine.profile
        if profile is None:
            return
        self.current = motion
        if not self._engine.begun(now):
            self._engine.replace(plan(motion, self._drive, profile.start_rpm))
        else:
            self._engine.change(lambda profile, at: profile.retarget(at, motion), now)
        if self._engine.profile is not None:
            self.warn(self._engine.profile)

    def forget_warnings(self) -> None:
        """Warn of commands in loops anew: another loop has begun."""
        self._warned = _NOTHING

    def forget_velocity(self) -> None:
        """Whatever comes next begins from rest."""
        self._kept_rpm = 0
        self._before = None

    def _drop_unstarted(self) -> None:
        """The command's first pulse has not come: it never will."""
        self._engine.discard()
        self.current = None
        self.source = Source.STANDBY
        self._untold = False

    # ---- to the end ----

    def wake(self, now: Ns) -> Ns | None:
        """Tell of a start that is due; end the command that is over: when it was, else None."""
        engine = self._engine
        if self._untold and engine.begun(now):
            self._tell_start()
        end = engine.end
        if end is None or end > now:
            return None
        self._finish(end)
        return end

    def _finish(self, end: Ns) -> None:
        """House-keeping in STOP: the present command ends at ``end``."""
        profile = self._engine.profile
        if profile is None:
            return
        kept = self._kept_rpm = 0 if self.stopping else profile.kept_rpm
        if kept:
            self._last_end = end
            self._last_period = profile.last_period
            self._before = profile
        self.stopping = False
        self.current = None
        self.source = Source.STANDBY
        self._engine.finish(end)
        if self.tells_ops:
            if self._untold:
                self._tell_start()
            self._free = self._told.tell_ops(start=False, at=end)
            if self._free > end and self.gap:
                # The packet outlasts the gap (manual, "ops/soft_ops").
                self._kept_rpm = 0

    def _tell_start(self) -> None:
        self._untold = False
        at = self._engine.started
        if at is not None:
            self._told.tell_ops(start=True, at=at)


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
    by_rpm = defaults.says(rpm, motion.cycle_us)
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
