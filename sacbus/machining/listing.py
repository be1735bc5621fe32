"""A block as a text that anyone can read: a line of comment, then each node's commands.

Owns this form. The commands are those of a terminal; put into the queues of the nodes and released
together, they move the machine as the block does.
"""

from __future__ import annotations

from collections.abc import Iterator

from sacbus.language import Defaults, Motion, Move
from sacbus.motion import TICKS_PER_US
from sacbus.toolpath import Block, Machine

__all__ = ["listing_of"]


def listing_of(block: Block, number: int, machine: Machine) -> Iterator[str]:
    """The lines of a block: ``# block 3, lines 7 to 12, ...``, ``10 m120vc4321a12.5d999l1s``."""
    first, last = block.lines
    seconds = block.duration / (TICKS_PER_US * 1e6)
    where = f"line {first}" if first == last else f"lines {first} to {last}"
    yield f"# block {number}, {where}: {block.length:.3f} mm in {seconds:.6f} s"
    for run in block.runs:
        axis = machine.axes[run.axis]
        defaults = Defaults(sprf=axis.drive.steps_per_rev)
        for motion in run.motions:
            yield f"{axis.node} {_command(motion, defaults)}"
    for text, waits in block.halts:
        yield f"# {text}" + (", waits" if waits else "")
    if block.dwell:
        yield f"# dwell {block.dwell:g} s"


def _command(motion: Motion, defaults: Defaults) -> str:
    """With every value that a session could change."""
    by_rpm = defaults.says(motion.rpm, motion.cycle_us)
    return Move(
        steps=motion.steps,
        opposite=motion.cw is not defaults.cw,
        rpm=motion.rpm if by_rpm else None,
        cycle_us=None if by_rpm else motion.cycle_us,
        acc100=motion.acc100,
        dec100=motion.dec100,
        linear=motion.linear,
        wait_us=motion.wait_us or None,
        sync=motion.sync or None,
        pulses=motion.pulses or None,
    ).text()
