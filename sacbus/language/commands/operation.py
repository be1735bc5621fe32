"""Line commands that stand alone: toggles of the session, what can be shown, and undo.

Owns the types and how each prints back. The queue and the loops have files of their own.
Source: manual, "CLI" (line commands), "GAP", Appendix C; spec, "Others".
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = [
    "OperationCommand",
    "ShowConfiguration",
    "ShowSession",
    "ToggleDebug",
    "ToggleGap",
    "Undo",
]


@dataclass(frozen=True, slots=True)
class ToggleGap:
    """``G``: GAP testing off, or on again."""

    def text(self) -> str:
        """``g``."""
        return "g"


@dataclass(frozen=True, slots=True)
class ToggleDebug:
    """``B``: into debug mode, or out of it."""

    def text(self) -> str:
        """``b``."""
        return "b"


@dataclass(frozen=True, slots=True)
class ShowConfiguration:
    """``CC``: show the persistent parameters, on the terminal only; nothing can be set there."""

    def text(self) -> str:
        """``cc``."""
        return "cc"


@dataclass(frozen=True, slots=True)
class ShowSession:
    """``CF``: show the session defaults and flags, on the terminal only."""

    def text(self) -> str:
        """``cf``."""
        return "cf"


@dataclass(frozen=True, slots=True)
class Undo:
    """``Z``: put back the queue position that was written last."""

    def text(self) -> str:
        """``z``."""
        return "z"


OperationCommand = ToggleGap | ToggleDebug | ShowConfiguration | ShowSession | Undo
