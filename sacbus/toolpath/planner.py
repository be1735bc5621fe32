"""Plans a whole path, block by block, while it is being read.

Owns the walk along the path: what is held of it, and what belongs to one stretch of motion. A block
ends where the path must rest (a sharp corner, a dwell, a halt, its end) and where an axis has as
many commands as its node's queue takes. As every block begins and ends at rest, no look-ahead goes
beyond one: the stretches that could be in the next block are all that is held of a path, however
long it is.
Source: spec, mother ("G-code": look-ahead over the queue, a barrier at least every 30 commands).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from sacbus.toolpath.block import Block, Deviation
from sacbus.toolpath.corner import Corner, corner_of
from sacbus.toolpath.draft import Origin, block_of
from sacbus.toolpath.follow import COMMANDS_MAX
from sacbus.toolpath.lookahead import must_rest
from sacbus.toolpath.machine import Machine
from sacbus.toolpath.path import Dwell, Halt, PathItem
from sacbus.toolpath.piece import pieces
from sacbus.toolpath.stretch import Stretch, stretches

__all__ = ["plan_path"]

COMMANDS_MIN: Final = 3
"""A ramp up, a cruise and a ramp down at an RPM of its own: no stretch takes more, if it must."""

JOIN_STEPS: Final = 0.25
"""Positions are rounded to steps, so they are half a step off as it is."""


def plan_path(
    items: Iterable[PathItem],
    machine: Machine,
    *,
    command_seconds: float,
    commands_max: int = COMMANDS_MAX,
    join_steps: float = JOIN_STEPS,
) -> Iterator[Block]:
    """The blocks of a path that begins where the machine stands.

    command_seconds: what one command takes on the line, all told; the feed of a block comes down
    until it lasts as long as its commands take. commands_max: of one axis in one block. join_steps:
    a point is left out of the path if the line without it passes it so closely, in full steps of
    each axis; below 0, none is. Blocks come as soon as what follows
    them is known; the path may be of any length.
    ValueError, when it is reached, for an item that makes no sense on this machine.
    """
    straight = stretches(pieces(items, machine, join_steps), machine)
    return _Planner(machine, command_seconds, commands_max).blocks(straight)


class _Planner:
    """One path on its way: the stretches that were read and are in no block yet."""

    def __init__(self, machine: Machine, command_seconds: float, commands_max: int) -> None:
        if commands_max < COMMANDS_MIN:
            raise ValueError(
                f"a line takes {COMMANDS_MIN} commands of an axis, got room for {commands_max}"
            )
        self._machine: Final = machine
        self._command_seconds: Final = command_seconds
        self._commands_max: Final = commands_max
        # Every stretch is a command of one axis at least.
        self._window: Final = commands_max * len(machine.axes)
        axes = len(machine.axes)
        self._origin = Origin((0.0,) * axes, (0,) * axes)
        self._ahead: Final[deque[Stretch]] = deque()
        self._corners: Final[deque[Corner]] = deque()

    def blocks(self, source: Iterator[Stretch | Dwell | Halt]) -> Iterator[Block]:
        """The blocks of a path."""
        item = next(source, None)
        while True:
            while isinstance(item, Stretch) and self._takes(item):
                item = next(source, None)
            if self._ahead:
                block = self._block()
                if self._ahead:
                    yield block
                    continue
            elif item is None:
                return
            else:
                assert not isinstance(item, Stretch)  # with nothing ahead, it is always taken
                block = _standing(item.line)
            while isinstance(item, Dwell | Halt) and not (block.halts and isinstance(item, Dwell)):
                block = _with(block, item)
                item = next(source, None)
            yield block

    def _takes(self, stretch: Stretch) -> bool:
        """Take a stretch in behind those that are there, if it goes on from them without a rest."""
        ahead = self._ahead
        if len(ahead) == self._window:
            return False
        if ahead:
            corner = corner_of(self._machine.axes, ahead[-1], stretch)
            if must_rest(ahead[-1], corner, stretch):
                return False
            self._corners.append(corner)
        ahead.append(stretch)
        return True

    def _block(self) -> Block:
        """Plan as many of the stretches as make a block, and let go of them."""
        count, block = block_of(
            self._machine,
            self._origin,
            tuple(self._ahead),
            tuple(self._corners),
            command_seconds=self._command_seconds,
            commands_max=self._commands_max,
        )
        self._origin = self._origin.after([self._ahead.popleft() for _ in range(count)])
        for _ in range(count):
            if self._corners:
                self._corners.popleft()
        return block


def _standing(line: int) -> Block:
    """A block in which nothing moves."""
    return Block((), 0, Deviation(0.0, 0.0), length=0.0, asked=0.0, lines=(line, line))


def _with(block: Block, item: Dwell | Halt) -> Block:
    """The block with what comes behind it."""
    lines = (block.lines[0], item.line)
    if isinstance(item, Dwell):
        return replace(block, dwell=block.dwell + item.seconds, lines=lines)
    return replace(block, halts=(*block.halts, (item.text, item.waits)), lines=lines)
