"""Motion commands, and edits of stored ones: whatever is made of steps and qualifiers.

Owns the types and how each prints back. What an edit makes of a stored motion is in
``queue_rows.py``.
Source: manual, "Motion", "Throw-away", "Queue", Appendix C; spec, "Motion", "Queue".
"""

from __future__ import annotations

from dataclasses import dataclass

from .quantities import Bare, ramp_text, velocity_text

__all__ = ["Edit", "Move", "ThrowAway"]


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
        return _course_text(self.opposite, self.steps) + _qualifiers_text(self)


@dataclass(frozen=True, slots=True)
class ThrowAway:
    """``XM``: a motion at once, through hidden position 31, that leaves the session alone."""

    move: Move

    def text(self) -> str:
        """``xm-40ad``."""
        return "x" + self.move.text()


@dataclass(frozen=True, slots=True)
class Edit:
    """Which fields of a stored motion are replaced, and by what: None leaves one as it is.

    opposite: what ``m`` (False: the default direction) or ``m-`` (True) said; None without an
    ``m``. steps: 0 to 2**32-1, set only with an ``m``; 0 = continuous. The others are those of
    :class:`Move`.
    """

    opposite: bool | None = None
    steps: int | None = None
    rpm: int | Bare | None = None
    cycle_us: int | None = None
    acc100: int | Bare | None = None
    dec100: int | Bare | None = None
    linear: bool | None = None
    extra_pulses: int | None = None
    wait_us: int | None = None
    sync: bool | None = None
    pulses: bool | None = None

    def text(self) -> str:
        """What stands behind the position: ``m-2000vc1500a1``; nothing if nothing is replaced."""
        course = "" if self.opposite is None else _course_text(self.opposite, self.steps)
        return course + _qualifiers_text(self)


def _course_text(opposite: bool, steps: int | None) -> str:
    return f"{'m-' if opposite else 'm'}{'' if steps is None else steps}"


def _qualifiers_text(of: Move | Edit) -> str:
    parts = [
        velocity_text(of.rpm, of.cycle_us),
        ramp_text("a", of.acc100),
        ramp_text("d", of.dec100),
    ]
    if of.linear is not None:
        parts.append("l1" if of.linear else "l0")
    if of.extra_pulses is not None:
        parts.append(f"u{of.extra_pulses}")
    if of.wait_us is not None:
        parts.append(f"t{of.wait_us}")
    if of.sync is not None:
        parts.append("s" if of.sync else "s0")
    if of.pulses is not None:
        parts.append("p" if of.pulses else "f")
    return "".join(parts)
