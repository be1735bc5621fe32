"""The SAC commands as values: what a line says, before any default is filled in.

Owns the types and how each prints back in the manual's shortest form. Knows no grammar (that is
``grammar.py``), no session, no bytes. Imports nothing of the project.

Two rules for whoever edits this file: a field that is ``None`` was not given on the line, which is
not the same as zero; and ``parse(command.text())`` gives the command back, whatever its fields.
Source: manual, "Motion" and Appendix C; spec, "Two ports" and "Motion".
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final

__all__ = [
    "BARE",
    "NO_RAMP",
    "Acceleration",
    "Bare",
    "Command",
    "Deceleration",
    "Empty",
    "Forward",
    "Message",
    "Move",
    "Next",
    "ReleaseSync",
    "ShowVelocity",
    "SinglePulses",
    "SoftOp",
    "Stop",
    "Velocity",
]

NO_RAMP: Final = 99900
"""Acceleration 999 in hundredths: no ramp at all (manual, "Accel")."""


class Bare(Enum):
    """A letter without its number: back to the system default."""

    BARE = "bare"


BARE: Final = Bare.BARE


def _ramp_text(letter: str, value100: int | Bare | None) -> str:
    """``a1.5``, ``a.2``, ``a999``, ``a`` (bare) or nothing; value100 in hundredths, >= 1."""
    if value100 is None:
        return ""
    if value100 is BARE:
        return letter
    whole, hundredths = divmod(value100, 100)
    fraction = f".{hundredths:02}".rstrip("0").rstrip(".")
    return f"{letter}{whole or ''}{fraction}"


def _velocity_text(rpm: int | Bare | None, cycle_us: int | None) -> str:
    if cycle_us is not None:
        return f"vc{cycle_us}"
    if rpm is None:
        return ""
    return "v" if rpm is BARE else f"v{rpm}"


@dataclass(frozen=True, slots=True)
class Move:
    """``M``: motion, with whatever qualifiers stood on the line.

    steps: 1 to 2**32-1, None or 0 = continuous. opposite: the ``-``, against the default direction.
    At most one of rpm (BARE = the default cycle) and cycle_us is set, each 1 to 2**32-1: the last
    on the line wins. acc100, dec100: hundredths, 1 to 99900 (= 999, no ramp), BARE = the ramp's
    system default. linear: ``l1``/``l0``. extra_pulses 0 to 255, wait_us 32 bits. pulses: True for
    ``p``, False for ``f``, None when the session decides. Source: manual, "Motion".
    """

    steps: int | None = None
    opposite: bool = False
    rpm: int | Bare | None = None
    cycle_us: int | None = None
    acc100: int | Bare | None = None
    dec100: int | Bare | None = None
    linear: bool | None = None
    extra_pulses: int | None = None
    wait_us: int | None = None
    sync: bool | None = None
    pulses: bool | None = None

    @property
    def continuous(self) -> bool:
        """Whether it runs until something ends it: no steps, or none but zero."""
        return not self.steps

    def text(self) -> str:
        """Shortest line that means the same, in lower case: ``m-200v100a.5d``."""
        parts = ["m-" if self.opposite else "m"]
        if self.steps is not None:
            parts.append(str(self.steps))
        parts.append(_velocity_text(self.rpm, self.cycle_us))
        parts.append(_ramp_text("a", self.acc100))
        parts.append(_ramp_text("d", self.dec100))
        if self.linear is not None:
            parts.append("l1" if self.linear else "l0")
        if self.extra_pulses is not None:
            parts.append(f"u{self.extra_pulses}")
        if self.wait_us is not None:
            parts.append(f"t{self.wait_us}")
        if self.sync is not None:
            parts.append("s" if self.sync else "s0")
        if self.pulses is not None:
            parts.append("p" if self.pulses else "f")
        return "".join(parts)


@dataclass(frozen=True, slots=True)
class Velocity:
    """``V``: the session's velocity, as RPM (BARE = the default cycle) or as a cycle in us.

    Exactly one of the two is set. While continuous motion runs it also re-targets that motion.
    """

    rpm: int | Bare | None = BARE
    cycle_us: int | None = None

    def text(self) -> str:
        """``v100``, ``vc3000`` or ``v``."""
        return _velocity_text(self.rpm, self.cycle_us)


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
        return _ramp_text("a", self.acc100)


@dataclass(frozen=True, slots=True)
class Deceleration:
    """``D``: the session's deceleration in hundredths; BARE = the ramp's system default."""

    dec100: int | Bare = BARE

    def text(self) -> str:
        """``d1.5`` or ``d``."""
        return _ramp_text("d", self.dec100)


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


@dataclass(frozen=True, slots=True)
class SoftOp:
    """DC1 (start) or DC2 (end) as a body: what another node tells of its motion."""

    start: bool

    def text(self) -> str:
        """One control character: 11 or 12 hexadecimal."""
        return "\x11" if self.start else "\x12"


@dataclass(frozen=True, slots=True)
class Empty:
    """A line with nothing on it but, perhaps, spaces: it does nothing and is acknowledged."""

    def text(self) -> str:
        """Nothing."""
        return ""


@dataclass(frozen=True, slots=True)
class Message:
    """Text for the receiver's terminal, never executed.

    body: the line as it stood, its leading space or dot included; one character a byte (Latin-1).
    """

    body: str

    def text(self) -> str:
        """The line as it stood."""
        return self.body


@dataclass(frozen=True, slots=True)
class Forward:
    """A line for another node: ``85m3000`` or ``/m3000``.

    destination: 0 to 255; None for ``/``, the source of the last packet. rest: everything after
    the address, one character a byte (Latin-1), not looked at; it does not begin with a digit
    unless destination is None.
    """

    destination: int | None
    rest: str

    def text(self) -> str:
        """The line as it stood, the address without leading zeros."""
        return f"{'/' if self.destination is None else self.destination}{self.rest}"


Command = (
    Move
    | Velocity
    | ShowVelocity
    | Acceleration
    | Deceleration
    | Stop
    | Next
    | ReleaseSync
    | SinglePulses
    | SoftOp
    | Empty
    | Message
    | Forward
)
"""Every command this version knows; ``match`` on it ends in ``assert_never``."""
