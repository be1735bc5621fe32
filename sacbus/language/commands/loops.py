"""The commands of loops over the queue, and of references to its positions.

Owns the types and how each prints back.
Source: manual, "Loop", "xRef", Appendix C; spec, "Loops and references".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = [
    "MAX_LOOPS",
    "MAX_REFERENCE",
    "EndLoop",
    "LoopCommand",
    "LoopCount",
    "LoopFinish",
    "LoopQueue",
    "LoopStart",
    "ProgramReferences",
    "RunPosition",
    "RunReferences",
    "SetReference",
    "ShowReferences",
]

MAX_LOOPS: Final = 65_535
"""The largest number of iterations (manual, "Loop" and "xRef")."""

MAX_REFERENCE: Final = 30
"""The largest index of the xRef array, which begins at 0: 30 entries and their end (spec)."""


@dataclass(frozen=True, slots=True)
class LoopStart:
    """``LSnn``: a loop starts at queue position nn, 1 to 30; it runs once both ends are set."""

    position: int

    def text(self) -> str:
        """``ls9``."""
        return f"ls{self.position}"


@dataclass(frozen=True, slots=True)
class LoopFinish:
    """``LFnn``: a loop finishes at queue position nn, 1 to 30; it runs once both ends are set."""

    position: int

    def text(self) -> str:
        """``lf12``."""
        return f"lf{self.position}"


@dataclass(frozen=True, slots=True)
class LoopCount:
    """``LNnnn``: how often the next loop runs, 1 to 65 535; 0 = for ever."""

    count: int

    def text(self) -> str:
        """``ln100``."""
        return f"ln{self.count}"


@dataclass(frozen=True, slots=True)
class LoopQueue:
    """``LA``: loop over the whole queue, from position 1."""

    def text(self) -> str:
        """``la``."""
        return "la"


@dataclass(frozen=True, slots=True)
class EndLoop:
    """``L``: a loop, or continuous motion, ends with grace."""

    def text(self) -> str:
        """``l``."""
        return "l"


@dataclass(frozen=True, slots=True)
class RunReferences:
    """``Lnn``: run the xRef array nn times, 1 to 65 535; 0 (``L0``, ``XL``) = for ever."""

    count: int

    def text(self) -> str:
        """``l5``."""
        return f"l{self.count}"


@dataclass(frozen=True, slots=True)
class RunPosition:
    """``Xnn``: run queue position nn, 1 to 30, at once; then what it interrupted goes on."""

    position: int

    def text(self) -> str:
        """``x9``."""
        return f"x{self.position}"


@dataclass(frozen=True, slots=True)
class ProgramReferences:
    """``XP``: enter the program mode of the xRef array, on the terminal only."""

    def text(self) -> str:
        """``xp``."""
        return "xp"


@dataclass(frozen=True, slots=True)
class SetReference:
    """``XPnn,xx``: entry nn of the xRef array, 0 to 30, is queue position xx; 0 ends the array."""

    index: int
    position: int

    def text(self) -> str:
        """``xp1,3``."""
        return f"xp{self.index},{self.position}"

    def entry(self) -> str:
        """As it is typed in the program mode: ``1,3``."""
        return self.text()[2:]


@dataclass(frozen=True, slots=True)
class ShowReferences:
    """``XD``: show the xRef array, on the terminal only."""

    def text(self) -> str:
        """``xd``."""
        return "xd"


LoopCommand = (
    LoopStart
    | LoopFinish
    | LoopCount
    | LoopQueue
    | EndLoop
    | RunReferences
    | RunPosition
    | ProgramReferences
    | SetReference
    | ShowReferences
)
