"""Commands in sequence: what each leaves to the next, and when each begins.

Owns the walk through the entries (session defaults carried on, loops) and the survey of it. All
figures of a command, and how it begins after another, come from ``sacbus.motion``. Nothing is kept
but what the next command needs, so a sequence may be of any length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Final

from sacbus.language import (
    Acceleration,
    Deceleration,
    Defaults,
    Forward,
    Motion,
    Move,
    Ramp,
    Remark,
    Session,
    StepMode,
    ThrowAway,
    Velocity,
    parse,
)
from sacbus.language.line import quoted
from sacbus.motion import REST, Drive, Left, Profile, begin, plan, transition_warnings
from sacbus.plan.entries import Commands, Entry, PlanError, Source

__all__ = ["Plan", "Planned", "Survey", "plan_sequence"]

_SYNC: Final = "held for sync until that is released: planned as if that were at once"


@dataclass(frozen=True, slots=True)
class Planned:
    """One command of a sequence. ``start`` in ticks from the sequence's first load.

    ``remarks`` are about parts of the line that were not taken as they stood, ``beginnings`` about
    where it takes over from the command before.
    """

    line: str
    motion: Motion
    profile: Profile
    start: int
    remarks: tuple[Remark, ...]
    beginnings: tuple[str, ...] = ()

    @property
    def end(self) -> int | None:
        """When its last period has run out, in ticks; None = never."""
        duration = self.profile.duration
        return None if duration is None else self.start + duration

    @property
    def warnings(self) -> list[str]:
        """What the line, and the hardware, would make of it other than was written."""
        held = [_SYNC] if self.motion.sync else []
        return [
            *(str(remark) for remark in self.remarks),
            *held,
            *self.beginnings,
            *(str(caution) for caution in self.profile.warnings),
        ]


@dataclass(frozen=True, slots=True)
class Survey:
    """A sequence as a whole.

    commands, pulses, duration: of all loops; ticks; None where it never ends. text_width: of the
    longest command. told_loops: the loops that have something to say: those after them are as
    the last of these, to the tick. loop_duration: of that one, from the end of the one before.
    """

    commands: int
    pulses: int | None
    duration: int | None
    text_width: int
    told_loops: int
    loop_duration: int | None


@dataclass(frozen=True, slots=True)
class _Standing:
    """What an entry leaves to the next one, but for the time."""

    session: Session
    left: Left


class Plan:
    """A sequence of commands, planned anew on every walk; immutable.

    Commands run as a node would run them from its queue, each as soon as the last has ended.
    start_rpm is a velocity kept from before. V, A, D, $L, $F and $P on lines of their own set
    session defaults; ``xm…``, a throw-away, leaves them alone. With ``gap`` a command goes on at
    the velocity kept by the one before if it is loaded in time; without, always. The whole is run
    ``loops`` times.
    """

    __slots__ = ("_gap", "_source", "_start_rpm", "drive", "loops")

    def __init__(
        self, source: Source, drive: Drive, *, start_rpm: int = 0, gap: bool = True, loops: int = 1
    ) -> None:
        self._source: Final = source
        self._start_rpm: Final = start_rpm
        self._gap: Final = gap
        self.drive: Final = drive
        self.loops: Final = loops

    def __iter__(self) -> Iterator[Planned]:
        """Every command of every loop; :class:`PlanError` at one that cannot be planned."""
        for _loop, planned in self.walk(self.loops):
            yield planned

    def walk(self, loops: int) -> Iterator[tuple[int, Planned]]:
        """The commands of the first loops, with the number of the loop, from 1."""
        run = self._run()
        for loop in range(1, loops + 1):
            for entry in self._source:
                planned = run.take(entry)
                if planned is not None:
                    yield loop, planned

    def survey(self, walked: Callable[[], object] = lambda: None) -> Survey:
        """Plan the whole without keeping it: :class:`PlanError` if anything in it is wrong.

        Loops are walked until one leaves what it found; all after it are the same. ``walked`` is
        called at each entry, for who shows progress.
        """
        run = self._run()
        commands = width = loop = 0
        pulses: int | None = 0
        loop_commands, loop_pulses, loop_began = 0, 0, 0
        while loop < self.loops:
            loop += 1
            found = run.standing
            loop_commands, loop_pulses, loop_began = 0, 0, run.end or 0
            for entry in self._source:
                walked()
                planned = run.take(entry)
                if planned is None:
                    continue
                loop_commands += 1
                width = max(width, len(planned.line))
                if planned.profile.pulses is None:
                    pulses = None
                else:
                    loop_pulses += planned.profile.pulses
            if not loop_commands:
                raise PlanError(
                    "nothing to plan, no motion command given, add one such as m400v120"
                )
            commands += loop_commands
            pulses = None if pulses is None else pulses + loop_pulses
            if run.standing == found:
                break
        left = self.loops - loop
        duration = loop_duration = None
        if run.end is not None:
            loop_duration = run.end - loop_began
            duration = run.end + left * loop_duration
        return Survey(
            commands + left * loop_commands,
            None if pulses is None else pulses + left * loop_pulses,
            duration,
            width,
            loop,
            loop_duration,
        )

    def _run(self) -> _Run:
        session = Session.start(Defaults(sprf=self.drive.steps_per_rev))
        return _Run(
            self.drive, _Standing(session, replace(REST, kept_rpm=self._start_rpm)), gap=self._gap
        )


def plan_sequence(
    lines: Iterable[str], drive: Drive, *, start_rpm: int = 0, gap: bool = True
) -> list[Planned]:
    """Plan a few commands; as :class:`Plan`, which serves any number."""
    sequence = Plan(Commands(tuple(lines)), drive, start_rpm=start_rpm, gap=gap)
    sequence.survey()
    return list(sequence)


class _Run:
    """One walk through a sequence: where it stands, and when the last command ended.

    end: ticks; None after continuous motion, which never ends. What the last command's profile may
    have warned of is in the standing, too: its last period tells how fast it really was.
    """

    def __init__(self, drive: Drive, standing: _Standing, *, gap: bool) -> None:
        self._drive = drive
        self._gap = gap
        self.standing = standing
        self.end: int | None = 0
        self._last: Profile | None = None

    def take(self, entry: Entry) -> Planned | None:
        """Go on by one entry; None if it only sets defaults."""
        if entry.motion is not None:
            return self._plan(entry, entry.motion, entry.remarks)
        parsed = parse(entry.text)
        remarks = tuple(replace(one, column=one.column + entry.skipped) for one in parsed.remarks)
        session = self.standing.session
        command = parsed.command
        match command:
            case Velocity():
                session = session.with_velocity(command)
            case Acceleration():
                session = session.with_acceleration(command)
            case Deceleration():
                session = session.with_deceleration(command)
            case Ramp(linear):
                session = session.with_ramp(linear=linear)
            case StepMode(full_step):
                session = session.with_full_step(full_step=full_step)
            case Move():
                motion, session = session.resolve(command)
                planned = self._plan(entry, motion, remarks)
                self.standing = replace(self.standing, session=session)
                return planned
            case ThrowAway(move):
                # The same motion; only what it would leave in the session is not.
                return self._plan(entry, session.resolve(move)[0], remarks)
            case _:
                raise PlanError(_refusal(entry, command, remarks))
        self.standing = replace(self.standing, session=session)
        return None

    def _plan(self, entry: Entry, motion: Motion, remarks: tuple[Remark, ...]) -> Planned:
        """Plan a motion from where the last one ended."""
        if self.end is None:
            raise PlanError(
                f"{quoted(entry.text)} would never run, {entry.where}, the motion before it is "
                "continuous: give that one steps"
            )
        before = self.standing
        beginning = begin(motion, before.left, self.end, gap=self._gap)
        profile = plan(motion, self._drive, beginning.start_rpm)
        beginnings = () if self._last is None else transition_warnings(self._last, profile)
        planned = Planned(entry.text, motion, profile, beginning.start, remarks, beginnings)
        self.end = planned.end
        self._last = profile
        self.standing = _Standing(before.session, Left.by(profile))
        return planned


def _refusal(entry: Entry, command: object, remarks: tuple[Remark, ...]) -> str:
    """Why a line is no part of a plan."""
    line, where = quoted(entry.text), entry.where
    if isinstance(command, Forward):
        return (
            f"{line} begins with an address, {where}, leave that out: what a command does is the "
            "same on every node"
        )
    if command is not None:
        return f"{line} is no motion, {where}, give M…, XM…, V, A, D, $L, $F or $P"
    first = remarks[0]  # without a command there is always one
    return (
        f"{line} is not understood, {where} column {first.column}, "
        f"expected {first.expected}, got {first.got}"
    )
