"""A part program of over 100 000 lines, run on virtual nodes through the stream of real ones.

A relief is planned, streamed over a line of 38 400 baud and run by three virtual nodes in virtual
time; once, in a process of its own. The baseline of its time is the time that its motors take; that
of its memory is a relief of a tenth of the lines, for a program of any length should take no more.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Final

from benchmarks.figure import Figure

LINES: Final = 120_000

#: Prints what a relief of so many lines came to, the processor time, and the most memory, KiB.
RUN: Final = """
import json, resource, sys, time
from examples import relief
from sacbus.config.machine import read_machine
from sacbus.gcode import read_program
from sacbus.machining import Course, Told, rehearse

async def go_on(text, waits): pass

machine = read_machine("examples/router.toml")
course = Course(read_program(relief.program(int(sys.argv[1])), machine), machine)
machined = rehearse(course, Told(lambda line: None, go_on, print))
used = resource.getrusage(resource.RUSAGE_SELF)
streamed, survey = machined.streamed, course.survey
assert machined.reached == (0, 0, 0), machined.reached
assert streamed.commands == survey.commands and streamed.deepest <= 30
print(json.dumps({
    "seconds": used.ru_utime + used.ru_stime,
    "memory": used.ru_maxrss / (1024 if sys.platform == "darwin" else 1),
    "motion": survey.planned,
    "asked": survey.asked,
    "commands": survey.commands,
    "late": streamed.late_by / 1e9,
    "deviation": survey.deviation.mm,
    "reports": sum(machined.reports.values()),
}))
"""


def run(lines: int) -> dict[str, float]:
    """A relief of so many lines in a process of its own; all axes arrive, or this raises."""
    command = [sys.executable, "-c", RUN, str(lines)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    told: dict[str, float] = json.loads(done.stdout)
    return told


def figures(_rounds: int) -> list[Figure]:
    """One run of each length: the long one takes minutes, and is the same every time."""
    short, long = run(LINES // 10), run(LINES)
    name = f"a relief of {LINES:,} lines"
    return [
        Figure(
            f"{name}, run in virtual time",
            long["motion"] / long["seconds"],
            "x real time",
            long["seconds"] / long["motion"],
            "the time its motors take",
        ),
        Figure(
            f"{name}, commands streamed",
            long["commands"] / long["seconds"],
            "commands/s",
            long["motion"] / long["asked"],
            "time at the feeds asked for",
        ),
        Figure(
            f"{name}, memory",
            long["memory"],
            "KiB",
            long["memory"] / short["memory"],
            "a tenth of its lines",
            1.1,
            "ratio, at most",
        ),
        Figure(
            f"{name}, late barriers",
            1000 * long["late"],
            "ms",
            long["late"] / long["motion"],
            "the time its motors take",
            0.01,
            "ratio, at most",
        ),
    ]
