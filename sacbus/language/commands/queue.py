"""The commands of the queue.

Owns the types and how each prints back. When an edit takes effect is the node's business.
Source: manual, "Queue", Appendix C; spec, "Queue".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from .motion import Edit

__all__ = [
    "QUEUE_LENGTH",
    "ClearQueue",
    "EditQueue",
    "ProgramQueue",
    "QueueCommand",
    "RestoreQueue",
    "SaveQueue",
    "ShowQueue",
]

QUEUE_LENGTH: Final = 30
"""Positions of the command queue, counted from 1 (manual, "Throw-away")."""


@dataclass(frozen=True, slots=True)
class ShowQueue:
    """``Q``: show the queue, on the terminal only."""

    def text(self) -> str:
        """``q``."""
        return "q"


@dataclass(frozen=True, slots=True)
class ProgramQueue:
    """``QP``: enter the program mode of the queue, on the terminal only."""

    def text(self) -> str:
        """``qp``."""
        return "qp"


@dataclass(frozen=True, slots=True)
class EditQueue:
    """``Qnn…``: edit position nn, 1 to 30; it makes nothing pending. The edit is never empty."""

    position: int
    edit: Edit

    def text(self) -> str:
        """``q9m-2000vc1500``."""
        return f"q{self.position}{self.edit.text()}"

    def entry(self) -> str:
        """As it is typed in the program mode: ``9m-2000vc1500``."""
        return self.text()[1:]


@dataclass(frozen=True, slots=True)
class SaveQueue:
    """``QS``: save the queue to EEPROM."""

    def text(self) -> str:
        """``qs``."""
        return "qs"


@dataclass(frozen=True, slots=True)
class RestoreQueue:
    """``QR``: the queue as it was saved, or system defaults if it never was."""

    def text(self) -> str:
        """``qr``."""
        return "qr"


@dataclass(frozen=True, slots=True)
class ClearQueue:
    """``QC``: every position to the session defaults."""

    def text(self) -> str:
        """``qc``."""
        return "qc"


QueueCommand = ShowQueue | ProgramQueue | EditQueue | SaveQueue | RestoreQueue | ClearQueue
