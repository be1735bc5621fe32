"""Starting nodes together, or not at all: loaded, held at sync, released by one broadcast.

Owns the order of it: what each node is to run is loaded by edits, which may be repeated; then all
are held; with every ACK in hand one ``y`` starts all of them in the same instant. A node that does
not answer as it should means that nobody starts: those that may be held by then get ``S``.
Source: spec, mother ("Groups"); manual, "SAC in a multi-axis environment", "sync".
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from sacbus.kernel import Ns
from sacbus.mother.errors import MotherError, NotStarted, Refused, Stopped
from sacbus.mother.mother import Mother

__all__ = [
    "RELEASE",
    "STOP",
    "Release",
    "Share",
    "broadcast_release",
    "stand_down",
    "start_together",
]

#: What releases every held node, and what makes one drop whatever it holds, loops or runs.
RELEASE: Final = "y"
STOP: Final = "S"


@dataclass(frozen=True, slots=True)
class Share:
    """What one node is told before a common start.

    load: lines that put what it is to run into its queue; they may be repeated without harm. hold:
    lines after which it is held at sync. They are sent again after silence, whatever they are: Xnn,
    which must not run twice elsewhere, only holds again as long as nobody is released.
    """

    node: int
    load: Sequence[str]
    hold: Sequence[str]


@dataclass(frozen=True, slots=True)
class Release:
    """When nodes were released, ns by mother's clock: not before ``earliest``.

    Not after ``latest`` either, as far as the line is no later than mother thinks; on a link out of
    this process the next ACK of any node tells for certain that ``y`` has arrived.
    """

    earliest: Ns
    latest: Ns


async def broadcast_release(mother: Mother) -> None:
    """Release all that are held, by the broadcast ``y``."""
    await mother.broadcast(RELEASE)


async def start_together(
    mother: Mother,
    shares: Sequence[Share],
    *,
    release: Callable[[], Awaitable[object]] | None = None,
) -> Release:
    """Load all nodes, hold all of them, and release them together; when that was.

    ``release`` does it in place of the broadcast: by the shared sync line, say. All are loaded
    before the first is held. :class:`NotStarted` when a node fails: then none has started, and
    those that may be held have been sent ``S``; so they have when the call is cancelled, or when
    ``release`` raises, whose error is then passed on as it is. An emergency stop in the middle is
    a failure, too; one that comes while they are released is :class:`Stopped`, for some may have
    started.
    """
    held: list[int] = []
    stops = mother.caller.stops
    try:
        for share in shares:
            await _tell(mother, share.node, share.load, stops)
        for share in shares:
            # Before the outcome is known: silence leaves open whether it is held.
            held.append(share.node)
            await _tell(mother, share.node, share.hold, stops, accept_duplicates=True)
        if mother.caller.stops != stops:
            raise _Failed(shares[-1].node, Stopped(0, RELEASE))
    except _Failed as failed:
        still_held = await stand_down(mother, held)
        if isinstance(failed.cause, Refused):  # who says NAK has not acted
            still_held = tuple(node for node in still_held if node != failed.node)
        raise NotStarted(failed.node, failed.cause, still_held) from failed.cause
    except BaseException:
        await stand_down(mother, held)
        raise
    earliest = mother.now
    try:
        await (broadcast_release(mother) if release is None else release())
        if mother.caller.stops != stops:
            raise Stopped(0, "")
    except BaseException:
        await stand_down(mother, held)
        raise
    return Release(earliest, mother.now)


async def stand_down(mother: Mother, nodes: Iterable[int]) -> tuple[int, ...]:
    """Send ``S`` to each; the nodes that have not acknowledged it, and may be held as before."""
    silent = []
    for node in nodes:
        try:
            await mother.send(node, STOP)
        except MotherError:  # what went wrong before is worth telling; the others need theirs
            silent.append(node)
    return tuple(silent)


class _Failed(Exception):
    """A node did not take a line."""

    def __init__(self, node: int, cause: MotherError) -> None:
        super().__init__(node)
        self.node = node
        self.cause = cause


async def _tell(
    mother: Mother, node: int, lines: Sequence[str], stops: int, *, accept_duplicates: bool = False
) -> None:
    for line in lines:
        try:
            if mother.caller.stops != stops:
                raise Stopped(node, line)
            await mother.send(node, line, accept_duplicates=accept_duplicates)
        except MotherError as cause:
            raise _Failed(node, cause) from cause
