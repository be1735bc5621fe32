"""The quadrature encoder at enA and enB: levels in, detents out.

Owns the decoding. What a detent does, throttle or follow, is the node's business.

A detent is one whole turn through the four states, A before B when turned clockwise (decision, as
is the resting state of both high, from the pull-ups of open inputs). Quarters that are turned back
count back, and a change of both levels at once says nothing, as with any quadrature decoder: which
way it went cannot be known.
Source: manual, "Encoder", "Terminal Connections"; spec, "Pins".
"""

from __future__ import annotations

from typing import Final

__all__ = ["Encoder"]

#: Levels (A, B) in the order of a clockwise turn, from rest: A falls, B falls, A rises, B rises.
_TURN: Final = ((1, 1), (0, 1), (0, 0), (1, 0))

#: Quarters of a detent.
_QUARTERS: Final = len(_TURN)


class Encoder:
    """An encoder at rest, both levels high."""

    __slots__ = ("_quarters", "a", "b")

    def __init__(self) -> None:
        self.a = 1
        self.b = 1
        #: Quarters since the last detent, clockwise positive.
        self._quarters = 0

    def drive(self, a: int, b: int) -> int:
        """The levels become these; the detents that are complete by it: 1 clockwise, -1, or 0."""
        turned = (_TURN.index((a, b)) - _TURN.index((self.a, self.b))) % _QUARTERS
        self.a, self.b = a, b
        if turned == 1:
            self._quarters += 1
        elif turned == _QUARTERS - 1:
            self._quarters -= 1
        if abs(self._quarters) < _QUARTERS:
            return 0
        detent = 1 if self._quarters > 0 else -1
        self._quarters = 0
        return detent
