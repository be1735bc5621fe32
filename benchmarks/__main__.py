"""All benchmarks, as a table or JSON: ``python -m benchmarks [--json] [--rounds N] [NAME...]``."""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Callable
from dataclasses import asdict

from benchmarks import (
    bus,
    gcode,
    kernel,
    lateness,
    line,
    lines,
    machining,
    motion,
    paths,
    pty,
    recording,
    simad,
    superstepper,
    tcp,
    transactions,
    wire,
)
from benchmarks.figure import Figure
from sacbus.wire import CRC_IS_FAST

BENCHMARKS: dict[str, Callable[[int], list[Figure]]] = {
    "wire": wire.figures,
    "kernel": kernel.figures,
    "motion": motion.figures,
    "gcode": gcode.figures,
    "bus": bus.figures,
    "superstepper": superstepper.figures,
    "recording": recording.figures,
    "simad": simad.figures,
    "machining": machining.figures,
    "line": line.figures,
    "lines": lines.figures,
    "paths": paths.figures,
    "pty": pty.figures,
    "tcp": tcp.figures,
    "transactions": transactions.figures,
    "lateness": lateness.figures,
}


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="How fast sacbus is, beside baselines.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)}")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--rounds", type=int, default=11, help="rounds a median is taken of")
    options = parser.parse_args(argv)
    unknown = set(options.names) - set(BENCHMARKS)
    if unknown:
        parser.error(f"no benchmark named {', '.join(sorted(unknown))}")
    about = {"python": platform.python_version(), "crc_is_fast": CRC_IS_FAST}
    found: dict[str, list[Figure]] = {}
    if not options.json:
        crc = "in C" if CRC_IS_FAST else "in Python (no compiler was there when it was installed)"
        print(f"CPython {about['python']}, crcmod {crc}; medians of {options.rounds} rounds")
    for name in options.names or BENCHMARKS:
        found[name] = BENCHMARKS[name](options.rounds)
        if not options.json:
            for figure in found[name]:
                print(row(figure), flush=True)
    if options.json:
        figures = {name: [asdict(f) | {"met": f.met} for f in some] for name, some in found.items()}
        print(json.dumps({**about, "figures": figures}))
    return 0


def row(figure: Figure) -> str:
    """A figure as a line of the table."""
    goal = ""
    if figure.goal is not None:
        goal = f"  goal {figure.goal:,g} ({figure.goal_is}): {'met' if figure.met else 'NOT MET'}"
    return (
        f"{figure.name:<46}{figure.value:>13,.1f} {figure.unit:<12}"
        f"{figure.ratio:>8.3f} x {figure.baseline}{goal}"
    )


if __name__ == "__main__":
    raise SystemExit(main())
