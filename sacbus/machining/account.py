"""What came of a program, in words and as JSON.

Owns what is said and in which units: mm and s for people, steps where a position is exact.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from sacbus.gcode import Checked
from sacbus.kernel import SECOND
from sacbus.machining.course import Course
from sacbus.machining.run import Machined
from sacbus.mother import Streamed
from sacbus.toolpath import Axis

__all__ = ["account", "as_json", "clock"]

#: Reports of nodes that are told.
TOLD: Final = 5

#: How many times as long as asked for a program takes before it is told why.
SLOW: Final = 1.2


def clock(seconds: float) -> str:
    """``3 h 12 min``, ``4 min 12 s``, ``12.345 s``."""
    if seconds < 60:
        return f"{seconds:.3f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def account(name: str, program: Checked, course: Course, machined: Machined) -> Iterator[str]:
    """The lines that tell it."""
    survey, streamed = course.survey, machined.streamed
    yield (
        f"{name}: {_counted(program.lines, 'line')}, "
        f"{_counted(program.stretches, 'straight stretch', 'straight stretches')}, "
        f"{program.length:.3f} mm of path"
    )
    yield _time(course, streamed)
    yield _commands(course, machined)
    yield from _feed(course)
    yield _deviation(course)
    for index in range(len(course.machine.axes)):
        yield _position(index, course, machined)
    if streamed is not None and streamed.late:
        often = _counted(streamed.late, "time")
        yield (
            f"waits      {often} the line had not carried the next block yet, "
            f"{streamed.late_by / SECOND:.3f} s in all"
        )
    for text, times in list(machined.reports.items())[:TOLD]:
        yield f"warning    {text}" + (f" ({times} times)" if times > 1 else "")
    if len(machined.reports) > TOLD:
        yield f"warning    {len(machined.reports) - TOLD} more, see --json"
    if survey.dwell:
        yield f"dwells     {survey.dwell:g} s"


def _counted(count: int, one: str, many: str | None = None) -> str:
    """``1 block``, ``2 blocks``."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def _time(course: Course, streamed: Streamed | None) -> str:
    asked = f"{clock(course.survey.asked)} at the feeds asked for"
    if streamed is None:
        return f"time       {clock(course.survey.planned)} of motion, {asked}"
    still = clock(streamed.barriers / SECOND)
    return (
        f"time       {clock(streamed.moving / SECOND)} of motion, {asked}; {still} between blocks"
    )


def _commands(course: Course, machined: Machined) -> str:
    survey, streamed = course.survey, machined.streamed
    told = f"commands   {survey.commands} in {_counted(survey.blocks, 'block')}"
    if streamed is not None:
        told += f", {streamed.packets} packets; {streamed.deepest} of 30 queue positions used"
    return told


def _feed(course: Course) -> Iterator[str]:
    survey = course.survey
    if not survey.reasons:
        yield "feed       as asked for, but for corners and ramps"
    else:
        yield f"feed       lowered by up to {100 * survey.lowered:.1f} %:"
    for reason, blocks in survey.reasons.items():
        yield f"             in {_counted(blocks, 'block')}, {reason}"
    if survey.planned > SLOW * survey.asked:
        yield (
            f"             {survey.planned / survey.asked:.1f} times as long as at the feeds asked "
            "for: what is not told above is lost at corners and in ramps, where a higher "
            "jump_rpm or acceleration (--machine) would help"
        )


def _deviation(course: Course) -> str:
    worst = course.survey.deviation
    reason = f": {worst.reason}" if worst.reason else ""
    return f"deviation  {worst.mm:.4f} mm, {worst.steps:.2f} steps at most{reason}"


def _position(index: int, course: Course, machined: Machined) -> str:
    axis = course.machine.axes[index]
    told = f"{axis.name:<10} asked for {course.end[index]:.4f} mm, "
    if machined.streamed is None:
        steps, how = float(course.survey.steps.get(index, 0)), "planned"
    elif machined.reached is None:
        steps, how = float(machined.streamed.positions[axis.name]), "acknowledged"
    else:
        steps, how = machined.reached[index], "reached"
    return f"{told}{how} {_mm(axis, steps):.4f} mm, {_forward(axis, steps):.0f} steps"


def _forward(axis: Axis, steps: float) -> float:
    """Steps that are positive in the axis's positive direction."""
    return 0.0 if steps == 0 else -steps if axis.inverted else steps


def _mm(axis: Axis, steps: float) -> float:
    return _forward(axis, steps) / axis.steps_per_mm


def as_json(name: str, program: Checked, course: Course, machined: Machined) -> dict[str, object]:
    """The same for programs; times in s, lengths in mm, positions in full steps as well."""
    survey, streamed = course.survey, machined.streamed
    told: dict[str, object] = {
        "file": name,
        "lines": program.lines,
        "stretches": program.stretches,
        "length_mm": program.length,
        "commands": survey.commands,
        "blocks": survey.blocks,
        "asked_s": survey.asked,
        "motion_s": survey.planned,
        "dwell_s": survey.dwell,
        "command_s": machined.command_seconds,
        "feed": {"lowered": survey.lowered, "reasons": survey.reasons},
        "deviation": {
            "mm": survey.deviation.mm,
            "steps": survey.deviation.steps,
            "reason": survey.deviation.reason,
        },
        "axes": [
            {
                "name": axis.name,
                "node": axis.node,
                "asked_mm": course.end[index],
                "asked_steps": round(course.end[index] * axis.steps_per_mm),
                "planned_steps": round(_forward(axis, survey.steps.get(index, 0))),
                "reached_steps": None
                if machined.reached is None
                else _forward(axis, machined.reached[index]),
            }
            for index, axis in enumerate(course.machine.axes)
        ],
    }
    if streamed is not None:
        told["stream"] = {
            "packets": streamed.packets,
            "between_blocks_s": streamed.barriers / SECOND,
            "halted_s": streamed.halted / SECOND,
            "late": streamed.late,
            "late_s": streamed.late_by / SECOND,
            "queue_used": streamed.deepest,
        }
        told["reports"] = machined.reports
    return told
