"""Commands of one letter: session defaults, stops, and pulses one by one.

Owns the types and how each prints back.
Source: manual, "CLI" (unary commands), "V", "S/s", "N/s", "Single pulse"; spec, "Motion", "Others".
"""

from __future__ import annotations

from dataclasses import dataclass

from .quantities import BARE, Bare, ramp_text, velocity_text

__all__ = [
    "Acceleration",
    "Deceleration",
    "Next",
    "ReleaseSync",
    "ShowVelocity",
    "SinglePulses",
    "Stop",
    "UnaryCommand",
    "Velocity",
]


@dataclass(frozen=True, slots=True)
class Velocity:
    """``V``: the session's velocity, as RPM (BARE = the default cycle) or as a cycle in us.

    Exactly one of the two is set. While continuous motion runs it also re-targets that motion.
    """

    rpm: int | Bare | None = BARE
    cycle_us: int | None = None

    def text(self) -> str:
        """``v100``, ``vc3000`` or ``v``."""
        return velocity_text(self.rpm, self.cycle_us)


@dataclass(frozen=True, slots=True)
class ShowVelocity:
    """``VD``: show speed and cycle, on the terminal only."""

    def text(self) -> str:
        """``vd``."""
        return "vd"


@dataclass(frozen=True, slots=True)
class Acceleration:
    """``A``: the session's acceleration in hundredths; BARE = the ramp's system default."""

    acc100: int | Bare = BARE

    def text(self) -> str:
        """``a1.5`` or ``a``."""
        return ramp_text("a", self.acc100)


@dataclass(frozen=True, slots=True)
class Deceleration:
    """``D``: the session's deceleration in hundredths; BARE = the ramp's system default."""

    dec100: int | Bare = BARE

    def text(self) -> str:
        """``d1.5`` or ``d``."""
        return ramp_text("d", self.dec100)


@dataclass(frozen=True, slots=True)
class Stop:
    """``S`` ends all motion at once (prejudice), ``s`` with the session's deceleration (grace)."""

    grace: bool

    def text(self) -> str:
        """``S`` or ``s``: the case is the meaning."""
        return "s" if self.grace else "S"


@dataclass(frozen=True, slots=True)
class Next:
    """``N`` ends the present command at once, ``n`` with its own deceleration; the next follows."""

    grace: bool

    def text(self) -> str:
        """``N`` or ``n``: the case is the meaning."""
        return "n" if self.grace else "N"


@dataclass(frozen=True, slots=True)
class ReleaseSync:
    """``y``: lets the command that is held at sync go."""

    def text(self) -> str:
        """``y``, lower case only."""
        return "y"


@dataclass(frozen=True, slots=True)
class SinglePulses:
    """``+`` (CW) and ``-`` (CCW): one pulse a character, in the order written.

    signs: one or more of these two characters.
    """

    signs: str

    def text(self) -> str:
        """The signs as they stood."""
        return self.signs


UnaryCommand = (
    Velocity | ShowVelocity | Acceleration | Deceleration | Stop | Next | ReleaseSync | SinglePulses
)
