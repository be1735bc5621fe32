"""``sacbus plan``: what commands would do, worked out before any motor turns.

Owns the sequence of planned commands (session defaults carried on, GAP between them) and its two
forms of output. A leaf beside the command line; all figures come from ``sacbus.motion``.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from sacbus.language import (
    Acceleration,
    Deceleration,
    Defaults,
    Forward,
    Motion,
    Move,
    Remark,
    Session,
    Velocity,
    parse,
)
from sacbus.motion import TICKS_PER_US, Drive, Profile, gap_passes, load_ticks, plan

__all__ = ["PlanError", "Planned", "as_json", "as_text", "plan_sequence"]


class PlanError(ValueError):
    """A line that plans nothing: what, where, what to do."""


@dataclass(frozen=True, slots=True)
class Planned:
    """One command of a sequence. ``start`` in ticks from the sequence's first load.

    ``remarks`` are about parts of the line that were not taken as they stood.
    """

    line: str
    motion: Motion
    profile: Profile
    start: int
    remarks: tuple[Remark, ...]

    @property
    def warnings(self) -> list[str]:
        """What the line, and the hardware, would make of it other than was written."""
        return [str(remark) for remark in self.remarks] + [
            str(caution) for caution in self.profile.warnings
        ]


def plan_sequence(
    lines: Iterable[str], drive: Drive, *, start_rpm: int = 0, gap: bool = True
) -> list[Planned]:
    """Plan commands as a node would run them from its queue, each as soon as the last has ended.

    ``start_rpm`` is a velocity kept from before. V, A and D on lines of their own set session
    defaults. With ``gap`` a command goes on at the velocity kept by the one before if it is loaded
    in time; without, always. :class:`PlanError` for a line that is no motion, and for one after
    continuous motion, which never ends.
    """
    session = Session.start(Defaults(sprf=drive.steps_per_rev))
    planned: list[Planned] = []
    kept: int = start_rpm
    last_acc: tuple[int, int, bool] | None = None
    end: int | None = 0
    for number, line in enumerate(lines, start=1):
        parsed = parse(line)
        command = parsed.command
        match command:
            case Velocity():
                session = session.with_velocity(command)
            case Acceleration():
                session = session.with_acceleration(command)
            case Deceleration():
                session = session.with_deceleration(command)
            case Move():
                if end is None:
                    raise PlanError(
                        f"{line!r} would never run, command {number}, the one before it is "
                        "continuous: give that one steps"
                    )
                motion, session = session.resolve(command)
                acc = (motion.acc100, motion.dec100, motion.linear)
                load = load_ticks(acceleration_changes=last_acc is not None and acc != last_acc)
                start = end + motion.wait_us * TICKS_PER_US
                if planned:
                    seamless = kept and (
                        not gap or gap_passes(start - end + load, planned[-1].profile.last_period)
                    )
                    kept = kept if seamless else 0
                    if not seamless or motion.wait_us:
                        start += load
                profile = plan(motion, drive, kept)
                planned.append(Planned(line, motion, profile, start, parsed.remarks))
                last_acc = acc
                kept = int(profile.kept_rpm)
                end = None if profile.duration is None else start + profile.duration
            case None:
                raise PlanError(_refusal(line, number, parsed.remarks))
            case Forward():
                raise PlanError(
                    f"{line!r} begins with an address, command {number}, leave that out: what a "
                    "command does is the same on every node"
                )
            case _:
                raise PlanError(
                    f"{line!r} is no motion, command {number}, give M…, V, A or D commands"
                )
    if not planned:
        raise PlanError("nothing to plan, no motion command given, add one such as m400v120")
    return planned


def as_json(planned: Sequence[Planned]) -> dict[str, Any]:  # Any: it is JSON
    """The plan as the command line's JSON; times in µs (multiples of 0.5), null when endless."""
    last = planned[-1]
    duration = last.profile.duration
    return {
        "commands": [
            {
                "command": one.line,
                "steps": one.motion.steps,
                "pulses": one.profile.pulses,
                "n_acc": one.profile.n_acc,
                "n_cruise": one.profile.n_cruise,
                "n_dec": one.profile.n_dec,
                "duration_us": _us(one.profile.duration),
                "start_us": _us(one.start),
                "peak_rpm": round(one.profile.peak_rpm, 3),
                "profile": "linear" if one.motion.linear else "harmonic",
                "direction": "CW" if one.motion.cw else "CCW",
                "warnings": one.warnings,
            }
            for one in planned
        ],
        "duration_us": None if duration is None else _us(last.start + duration),
    }


def as_text(planned: Sequence[Planned]) -> list[str]:
    """The plan for people: a line a command, warnings below it, the whole at the end."""
    lines = []
    width = max(len(one.line) for one in planned)
    for one in planned:
        profile = one.profile
        cruise = "endless" if profile.n_cruise is None else profile.n_cruise
        time = "" if profile.duration is None else f"  {_seconds(profile.duration)} s"
        lines.append(
            f"{one.line:<{width}}  {profile.n_acc} + {cruise} + {profile.n_dec} "
            f"{'pulses' if one.motion.pulses else 'steps'} "
            f"{'CW' if one.motion.cw else 'CCW'}, "
            f"{'linear' if one.motion.linear else 'harmonic'}, "
            f"peak {profile.peak_rpm:.2f} RPM{time}"
        )
        lines += [f"  warning: {warning}" for warning in one.warnings]
    last = planned[-1]
    if len(planned) > 1 and last.profile.duration is not None:
        lines.append(f"total {_seconds(last.start + last.profile.duration)} s")
    return lines


def _us(ticks: int | None) -> float | int | None:
    if ticks is None:
        return None
    return ticks / TICKS_PER_US if ticks % TICKS_PER_US else ticks // TICKS_PER_US


def _seconds(ticks: int) -> str:
    return f"{ticks / TICKS_PER_US / 1_000_000:.6f}"


def _refusal(line: str, number: int, remarks: Sequence[Remark]) -> str:
    if not remarks:
        return f"{line!r} says nothing, command {number}, give a motion command"
    first = remarks[0]
    return (
        f"{line!r} is not understood, command {number} column {first.column}, "
        f"expected {first.expected}, got {first.got}"
    )
