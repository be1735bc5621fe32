"""By how much a block is slower than was asked, and what for.

Owns the comparison and its words. Corners and accelerations are no lowering: they are the path's
and the motors' own, and asked and planned time tell of them.
Source: spec, mother ("G-code": "mother lowers the feed to what the line carries and reports it").
"""

from __future__ import annotations

from collections.abc import Sequence

from sacbus.toolpath.law import Law
from sacbus.toolpath.machine import Machine
from sacbus.toolpath.stretch import Stretch, top_rpm

__all__ = ["against", "by_axes", "by_line", "largest"]

Lowered = tuple[float, str]
"""The part by which a velocity was lowered, 0 to 1, and why."""


def by_axes(machine: Machine, stretches: Sequence[Stretch]) -> Lowered:
    """Against the feed asked for, because an axis turns no faster; a rapid has asked for none."""
    worst, why = 0.0, ""
    for stretch in stretches:
        lowered = 1 - stretch.limit / stretch.feed
        if stretch.rapid or lowered <= worst:
            continue
        axis, _ = max(
            zip(machine.axes, stretch.rates, strict=True),
            key=lambda one: abs(one[1]) / top_rpm(one[0]),
        )
        worst, why = lowered, f"{axis.name} turns at {int(top_rpm(axis))} RPM at most"
    return worst, why


def by_line(part: float, command_seconds: float) -> Lowered:
    """By a part, because the commands would take longer on the line than the block itself."""
    if part <= 0:
        return 0.0, ""
    return part, f"the line carries {int(1 / command_seconds)} commands a second"


def largest(*found: Lowered) -> Lowered:
    """The one that lowers most; (0, "") if none does."""
    worst = max(found)
    return worst if worst[0] > 0 else (0.0, "")


def against(free: Law, law: Law) -> float:
    """The largest part by which any segment's peak in one law is lower than in another."""
    peaks, reached = _peaks(free), _peaks(law)
    return max(0.0, *(1 - reached[segment] / peak for segment, peak in peaks.items()))


def _peaks(law: Law) -> dict[int, float]:
    peaks: dict[int, float] = {}
    for phase in law:
        peaks[phase.segment] = max(peaks.get(phase.segment, 0.0), phase.v0, phase.v1)
    return peaks
