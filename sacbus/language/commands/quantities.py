"""How speeds, accelerations and "no number" are said in a command.

Owns ``BARE``, and the printing of a velocity and of hundredths: in the manual's shortest form, and
as its screens show them.
Source: manual, "Accel", "V".
"""

from __future__ import annotations

from enum import Enum
from typing import Final

__all__ = [
    "BARE",
    "NO_RAMP",
    "Bare",
    "fixed_text",
    "hundredths_text",
    "ramp_text",
    "velocity_text",
]

NO_RAMP: Final = 99900
"""Acceleration 999 in hundredths: no ramp at all (manual, "Accel")."""


class Bare(Enum):
    """A letter without its number: back to the system default."""

    BARE = "bare"


BARE: Final = Bare.BARE


def hundredths_text(value100: int) -> str:
    """``1.5``, ``.2``, ``999``: value100 in hundredths, >= 1."""
    whole, hundredths = divmod(value100, 100)
    fraction = f".{hundredths:02}".rstrip("0").rstrip(".")
    return f"{whole or ''}{fraction}"


def fixed_text(value100: int) -> str:
    """``1.00``, ``10.47``, ``999.00``: as the screens of a terminal have it."""
    return f"{value100 // 100}.{value100 % 100:02}"


def ramp_text(letter: str, value100: int | Bare | None) -> str:
    """``a1.5``, ``a`` (bare) or nothing."""
    if value100 is None:
        return ""
    return letter if value100 is BARE else letter + hundredths_text(value100)


def velocity_text(rpm: int | Bare | None, cycle_us: int | None) -> str:
    """``v100``, ``vc3000``, ``v`` (bare) or nothing."""
    if cycle_us is not None:
        return f"vc{cycle_us}"
    if rpm is None:
        return ""
    return "v" if rpm is BARE else f"v{rpm}"
