"""How the steps of a command are shared out between ramps and cruise.

Owns the step counts and truncation. Everything truncates, as the device does.
Source: manual, "Profile Planning", "Profiles"; spec, "Profile".
"""

from typing import Final, NamedTuple

from sacbus.motion.drive import Rpm, has_ramp

LONGEST_RAMP: Final = 1 << 42
"""Full steps a linear ramp is given at most; its periods are down to a tick long before."""

PI: Final = 3_1415926535_8979323846_2643383279_5028841971
PI_SCALE: Final = 10**40
"""Pi as an integer: steps are counted without a float, whatever velocity a 32-bit V asks for."""


class Shares(NamedTuple):
    """What each state gets of a command, in what the command counts: full steps or pulses."""

    acc: int
    cruise: int | None
    """None = for ever."""
    dec: int
    extra: int
    """Pulses added to the cruise."""
    unit: int
    """Pulses of one of what is counted here."""
    accelerates: bool
    """The command asks for a ramp at its beginning, even if truncation left none of it."""
    truncated: bool

    @property
    def cruise_pulses(self) -> int | None:
        """Pulses of the cruise; None = for ever."""
        return None if self.cruise is None else self.cruise * self.unit + self.extra

    @property
    def pulses(self) -> int | None:
        """Pulses of the command; None = for ever."""
        if self.cruise is None:
            return None
        return (self.acc + self.cruise + self.dec) * self.unit + self.extra


def harmonic_steps(v0: Rpm, target: Rpm, acc100: int) -> int:
    """Full steps a harmonic ramp takes between two speeds, up or down.

    Speeds in RPM; acc100 in hundredths of an RPM per full step; 0 and 999 mean no ramp.
    10 -> 100 at 0.5 takes 180.
    """
    if not has_ramp(acc100):
        return 0
    gap = target - v0
    return int((gap if gap > 0 else -gap) * 100 // acc100)


def linear_index(rpm: Rpm, acc100: int, steps_per_rev: int) -> int:
    """Full steps a linear ramp takes from standstill to a speed: v^2 / (2 alpha acc).

    rpm unrounded in rad/s; acc100 in hundredths of a rad/s2. 100 RPM at 10.47 takes 166.
    At most LONGEST_RAMP, whatever speed a 32-bit V asks for.
    """
    squared = rpm.numerator**2 * steps_per_rev * PI
    steps = squared // (rpm.denominator**2 * 36 * acc100 * PI_SCALE)
    return min(steps, LONGEST_RAMP)


def linear_steps(v0: Rpm, target: Rpm, acc100: int, steps_per_rev: int) -> int:
    """Full steps a linear ramp takes between two speeds, up or down; 0 is standstill."""
    if not has_ramp(acc100):
        return 0
    there = linear_index(target, acc100, steps_per_rev)
    return abs(there - linear_index(v0, acc100, steps_per_rev))


def truncate(n_acc: int, n_dec: int, steps: int) -> tuple[int, int]:
    """Ramps of a command too short for them: cut in proportion, adding up to its steps.

    200 steps of 180 + 90 leave 133 + 67 (manual, "Profiles").
    """
    kept = n_acc * steps // (n_acc + n_dec)
    return kept, steps - kept
