"""How a node tells of its motion: the contract between it, whoever records it, and its kind.

Owns the shapes in which they meet. A node that moves never tells of pulses: it tells each time that
how it moves has changed, in a form that can be stored, and its kind reads that back into a
:class:`Segment`, which knows every pulse. Time is an argument, in ns of bus time. Nothing here
knows a particular kind.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from sacbus.kernel import Ns

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Times = NDArray[np.int64]

__all__ = ["Movement", "Segment", "Watcher"]

#: Called with when, shape and values: two JSON objects as text, without their braces. ``shape`` is
#: what many segments have in common, a command's profile and the board that it runs on, so that
#: whoever stores it may do so once; ``values`` is what is of this one alone.
Watcher = Callable[[Ns, str, str], object]


class Movement(Protocol):
    """The motion of one node, for who wants to know all of it."""

    def watch(self, watcher: Watcher | None, now: Ns) -> None:
        """Have ``watcher`` told at once how the node moves now, and of each change; None: nobody.

        A profile that is loaded, changed or over is a change; so are single pulses, what the motor
        is held at while it does not move, and a position that is counted from anew.
        """
        ...


class Segment(Protocol):
    """How a node moves from ``since`` on, until it tells of something else.

    Positions are signed, clockwise up. What is asked for instants before ``since`` is of no worth.
    """

    @property
    def since(self) -> Ns:
        """When the node told of it."""
        ...

    @property
    def started(self) -> Ns | None:
        """When its first pulse is issued, or was; None when it has none, or no clock comes."""
        ...

    @property
    def end(self) -> Ns | None:
        """When its last pulse's period is over; None when it never is, or no pulse is to come."""
        ...

    @property
    def anew(self) -> bool:
        """Whether the position is counted from anew: it has nothing to do with the one before."""
        ...

    @property
    def command(self) -> str:
        """The command that runs, in the kind's shortest form; empty when none does."""
        ...

    def position(self, at: Ns) -> int:
        """Pulses from where the node was switched on."""
        ...

    def steps(self, at: Ns) -> float:
        """The same in full steps."""
        ...

    def rotor(self, at: Ns) -> float:
        """Where the motor stands in full steps, which may have stalled."""
        ...

    def rpm(self, at: Ns) -> float:
        """Velocity, signed."""
        ...

    def state(self, at: Ns) -> str:
        """As the node's own ``state``."""
        ...

    def states(self) -> Sequence[tuple[Ns, str]]:
        """From when on it is in which state, beginning with ``since``; it may not get so far."""
        ...

    def pulse_times(self, since: Ns, until: Ns) -> Times:
        """When pulses are issued in [since, until), rising; single ones are not among them."""
        ...

    def pulse_ends(self, since: Ns, until: Ns) -> Times:
        """When the clk pin falls again after each of these."""
        ...

    def levels(self, at: Ns) -> Mapping[str, int]:
        """Levels of the outputs that follow from how it moves; clk is not among them."""
        ...
