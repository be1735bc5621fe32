"""The modes of a terminal: what a line may be depends on what was entered before.

Owns their names, and the line that leaves one. The network has no modes.
Source: manual, "Queue", "xRef", "Configure Menu"; spec, "Queue", "Loops", "System commands".
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

__all__ = ["Leave", "Mode"]


class Mode(Enum):
    """Where a terminal is; the value is the command that got it there."""

    PROMPT = ""
    QUEUE = "qp"
    REFERENCES = "xp"
    CONFIGURE = "$C"


@dataclass(frozen=True, slots=True)
class Leave:
    """``X`` in a program mode or on the configure screen: back to the prompt."""

    def text(self) -> str:
        """``x``; at the prompt that is no command."""
        return "x"
