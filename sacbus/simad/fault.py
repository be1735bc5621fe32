"""What can be wrong with what is to be encoded or decoded.

::

    SimadError(ValueError)     what was given is none: a line for users
      DelayTooLong             steps that come too fast for the lines
"""

from __future__ import annotations

__all__ = ["DelayTooLong", "SimadError"]


class SimadError(ValueError):
    """Steps, lines, rules or files that are none; the text is a line for users."""


class DelayTooLong(SimadError):
    """A step that would fall later than is allowed: too many steps, or too many turns of DIR.

    ``axis``: its name. ``time``: when it is due, and ``delay``: how much later it could fall; ns.
    """

    def __init__(self, axis: str, time: int, delay: int, allowed: int) -> None:
        super().__init__(
            f"the step of axis {axis} at {time} ns cannot fall before {time + delay} ns, "
            f"expected a delay of {allowed} ns at most, got {delay} ns, "
            "move slower, turn less often, or allow a longer delay"
        )
        self.axis = axis
        self.time = time
        self.delay = delay
        self.allowed = allowed
