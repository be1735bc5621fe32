"""What becomes of a request, when it goes well; when it does not, see ``errors.py``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from sacbus.kernel import Ns
from sacbus.mother.errors import MotherError

__all__ = ["Acknowledged", "Done", "Outcome", "Sent"]


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """A node has a packet: after how many attempts, and the last one's round trip in ns."""

    node: int
    attempts: int
    round_trip: Ns


@dataclass(frozen=True, slots=True)
class Sent:
    """A broadcast is out, and its pause over; nobody answers one."""


#: What becomes of a request, and who is told of it, once.
Outcome = Acknowledged | Sent | MotherError
Done = Callable[[Outcome], None]
