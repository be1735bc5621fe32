"""Fuzzes nodes through both ports: ``python -m tests.fuzz [--lines N] [--seed N] [--jobs N]``.

Ends with status 0 when nothing raised and memory did not grow, 1 when something did, and 130 after
Ctrl-C. A seed, with the number of jobs, gives the same run again.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import time
import traceback
from typing import Final

from tests.fuzz.memory import MOST, Held, held, warm_up
from tests.fuzz.world import World

#: Lines between two words about how far it is, on a terminal.
_STRIDE: Final = 10_000
_INTERRUPTED: Final = 130


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description="Random lines and bytes through both ports."
    )
    parser.add_argument("--lines", type=_count, default=10_000_000, help="how many, of all jobs")
    parser.add_argument("--seed", type=int, help="the same again; any if not given")
    parser.add_argument("--jobs", type=_count, default=os.cpu_count() or 1, help="processes")
    parser.add_argument("--quiet", action="store_true", help="no word about how far it is")
    options = parser.parse_args(argv)
    seed = random.SystemRandom().randrange(10**9) if options.seed is None else options.seed
    if options.jobs == 1:
        return _fuzz(options.lines, seed, quiet=options.quiet or not sys.stderr.isatty())
    return _share_out(options.lines, seed, options.jobs)


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"expected a number from 1 up, got {text!r}")
    return int(text)


def _share_out(lines: int, seed: int, jobs: int) -> int:
    """Each job is a process with a seed of its own; the first one tells how far it is."""
    command = [sys.executable, "-m", "tests.fuzz", "--jobs", "1"]
    share = [*command, "--lines", str(-(-lines // jobs))]
    running = [
        subprocess.Popen([*share, "--seed", str(seed + job), *(("--quiet",) if job else ())])
        for job in range(jobs)
    ]
    # Ctrl-C goes to the jobs too, which say how far they were: wait for that.
    heeded = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        ended = [job.wait() for job in running]
    finally:
        signal.signal(signal.SIGINT, heeded)
    return max(status if status >= 0 else 1 for status in ended)


def _fuzz(lines: int, seed: int, *, quiet: bool) -> int:
    """One job."""
    world, begun = World(seed), time.monotonic()
    try:
        # In one piece: several jobs write to one file, which may have no buffer.
        sys.stdout.write(f"seed {seed}: {lines:,} lines\n")
        sys.stdout.flush()
        world.go_on(warm_up(lines))
        warm = held()
        while world.lines < lines:
            world.go_on(min(_STRIDE, lines - world.lines))
            if not quiet:
                _tell_how_far(world, lines, begun)
        grown = held()
    except KeyboardInterrupt:
        print(f"\nstopped after {world.lines:,} lines; the same again: --seed {seed} --jobs 1")
        return _INTERRUPTED
    except Exception:  # noqa: BLE001  # whatever it is, it is what this looks for
        print(traceback.format_exc())
        print(f"line {world.lines:,} of --seed {seed} --jobs 1; what was done last, newest last:")
        for deed in world.deeds:
            print(f"    {deed}")
        return 1
    spent, (slowest, deed) = time.monotonic() - begun, world.slowest
    print(
        f"seed {seed}: {world.sent:,} in packets, {world.typed:,} typed, {spent:,.0f} s, "
        f"{world.lines / spent:,.0f} a second; slowest {slowest:.3f} s: {deed}; "
        f"{warm} after {warm_up(lines):,} lines, {grown} at the end"
    )
    return _judge(warm, grown)


def _tell_how_far(world: World, lines: int, begun: float) -> None:
    rate = world.lines / (time.monotonic() - begun)
    sys.stderr.write(f"\r{world.lines:,} of {lines:,} lines, {rate:,.0f} a second ")
    sys.stderr.flush()


def _judge(warm: Held, grown: Held) -> int:
    if grown.mib - warm.mib <= MOST.mib and grown.objects - warm.objects <= MOST.objects:
        return 0
    print(f"memory has grown: expected at most {MOST} more than {warm}, got {grown}")
    return 1


if __name__ == "__main__":
    sys.exit(main())
