"""A plan in words and as JSON, piece by piece, so that it may be of any length.

Owns the two forms of output. Times for people in seconds, in JSON in µs: multiples of 0.5, null
when something never ends.
Source: spec, "Command line", row ``plan``.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final

from sacbus.motion import TICKS_PER_US
from sacbus.plan.sequence import Plan, Planned, Survey

__all__ = ["as_json", "as_text", "command_as_json", "json_pieces", "seconds", "text_lines"]

WIDEST: Final = 40
"""Columns given to the commands at most; a longer one pushes its own line to the right."""


def json_pieces(plan: Plan, survey: Survey) -> Iterator[str]:
    """One JSON object in pieces: ``{"commands": [...], "duration_us": ...}``."""
    yield '{"commands": ['
    between = ""
    for planned in plan:
        yield between + json.dumps(command_as_json(planned))
        between = ", "
    yield f'], "duration_us": {json.dumps(_us(survey.duration))}}}\n'


def as_json(plan: Plan) -> dict[str, Any]:  # Any: it is JSON
    """The whole at once; for few commands."""
    survey = plan.survey()
    return {
        "commands": [command_as_json(planned) for planned in plan],
        "duration_us": _us(survey.duration),
    }


def command_as_json(planned: Planned) -> dict[str, Any]:  # Any: it is JSON
    """One command's figures."""
    profile, motion = planned.profile, planned.motion
    return {
        "command": planned.line,
        "steps": motion.steps,
        "pulses": profile.pulses,
        "n_acc": profile.n_acc,
        "n_cruise": profile.n_cruise,
        "n_dec": profile.n_dec,
        "duration_us": _us(profile.duration),
        "start_us": _us(planned.start),
        "peak_rpm": round(profile.peak_rpm, 3),
        "profile": "linear" if motion.linear else "harmonic",
        "direction": "CW" if motion.cw else "CCW",
        "warnings": planned.warnings,
    }


def text_lines(plan: Plan, survey: Survey) -> Iterator[str]:
    """The plan for people: a line a command, warnings below it, the whole at the end.

    Loops that are as the one before them are told of, not told.
    """
    width = min(survey.text_width, WIDEST)
    told = 0
    for loop, planned in plan.walk(survey.told_loops):
        if plan.loops > 1 and loop > told:
            told = loop
            yield f"loop {loop}"
        yield from _command_lines(planned, width)
    if plan.loops > told > 0:
        alike = plan.loops - told
        last = f" to {plan.loops}" if alike > 1 else ""
        yield (
            f"loop{'s' if last else ''} {told + 1}{last}: as loop {told}, "
            f"{seconds(survey.loop_duration or 0)} s{' each' if last else ''}"
        )
    if survey.commands > 1 and survey.duration is not None:
        yield f"total {seconds(survey.duration)} s"


def as_text(plan: Plan) -> list[str]:
    """The whole at once; for few commands."""
    return list(text_lines(plan, plan.survey()))


def seconds(ticks: int) -> str:
    """Ticks as seconds, to the µs: 1.469006. Exact in integers, whatever the size."""
    microseconds = ticks // TICKS_PER_US
    return f"{microseconds // 1_000_000}.{microseconds % 1_000_000:06}"


def _command_lines(planned: Planned, width: int) -> Iterator[str]:
    profile, motion = planned.profile, planned.motion
    cruise = "endless" if profile.n_cruise is None else profile.n_cruise
    time = "" if profile.duration is None else f"  {seconds(profile.duration)} s"
    yield (
        f"{planned.line:<{width}}  {profile.n_acc} + {cruise} + {profile.n_dec} "
        f"{'pulses' if motion.pulses else 'steps'} "
        f"{'CW' if motion.cw else 'CCW'}, "
        f"{'linear' if motion.linear else 'harmonic'}, "
        f"peak {profile.peak_rpm:.2f} RPM{time}"
    )
    for warning in planned.warnings:
        yield f"  warning: {warning}"


def _us(ticks: int | None) -> float | int | None:
    if ticks is None:
        return None
    return ticks / TICKS_PER_US if ticks % TICKS_PER_US else ticks // TICKS_PER_US
