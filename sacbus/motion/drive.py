"""What a node is wired to: the settings that turn a command into pulse periods.

Owns the units of this room and the real period of a pulse. Imports nothing of the project.

Units. *Ticks* are 0.5 us of the node's own oscillator (timebase.py), always integers. *Speed* is an
integer in hundredths of an RPM times `m`, the pulses of a full step at the finest microsteps the
node is set to, so that a harmonic ramp rises by exactly acc x 100 a pulse at every setting, and a
pulse at speed v lasts `rate // v` ticks. The *weight* of a pulse is how many of these finest
microsteps it turns the motor by: 1, except where auto-micro has changed to coarser ones (gears.py).
Source: manual, "Slow speed", "Micro-stepping", "ihd", "xclk"; spec, "Units and clock".
"""

from dataclasses import dataclass, field
from fractions import Fraction
from itertools import pairwise
from typing import Final

TICKS_PER_US: Final = 2
"""The timer runs at 2 MHz (manual, "Slow speed")."""

TICKS_PER_MINUTE: Final = 60_000_000 * TICKS_PER_US

NO_RAMP: Final = 99_900
"""acc or dec of 999, in hundredths: go straight to the speed (manual, "Accel")."""

SERVICE_TICKS: Final = 8
"""Overhead of the pulse interrupt, which the factory ihd of 8 cancels exactly (decision)."""

FACTORY_SPRF: Final = 200
USTEP_MAX: Final = 7

PullOut = tuple[tuple[int, int], ...]
"""Points (RPM, rad/s2), the RPM rising: see `Drive.pull_out`."""

Rpm = int | Fraction
"""Whole RPM as commanded; a Fraction where a ramp was cut into between two of them."""


def has_ramp(acc100: int) -> bool:
    """False for an acc or dec of 999, and of 0, which acts as 999 (decision)."""
    return 0 < acc100 < NO_RAMP


@dataclass(frozen=True, slots=True)
class Drive:
    """Motor, driver and timing settings of one node; everything motion needs besides the command.

    sprf: full steps a revolution; 0 acts as the factory's 200. slow_rpm: start and stop speed;
    0 acts as 1. ustep: exponent 0-7, 2**ustep pulses a full step. ihd and xclk: ticks taken from
    and added to every period. pulse_us: width of clk. auto_micro: microsteps up to ustep as the
    speed allows (gears.py).

    The motor, as far as it is known (motor.py): pull_in_rpm: the speed up to which it starts from
    rest, None for a motor that never stalls. pull_out: the acceleration in rad/s2 that it follows
    at a speed, with its load, as points (RPM, rad/s2) that are joined by straight lines; the same
    below the first point, and beyond the last RPM it turns at no acceleration at all. Empty: it
    follows every ramp.
    ValueError for what no device can hold, and for a curve that is none.
    """

    sprf: int = FACTORY_SPRF
    slow_rpm: int = 10
    ustep: int = 0
    ihd: int = 8
    xclk: int = 0
    pulse_us: int = 1
    pull_in_rpm: int | None = None
    auto_micro: bool = False
    pull_out: PullOut = ()
    # Derived once, because plan() reads them for every command.
    steps_per_rev: int = field(init=False, repr=False, compare=False)
    slow: int = field(init=False, repr=False, compare=False)
    m: int = field(init=False, repr=False, compare=False)
    rate: int = field(init=False, repr=False, compare=False)
    slow_speed: int = field(init=False, repr=False, compare=False)
    offset: int = field(init=False, repr=False, compare=False)
    # `plan`'s own memory of (n_acc, n_dec, ticks of both) by velocity, acc, dec, linear, and start.
    whole_ramps: dict[tuple[int, int, int, bool, Rpm], tuple[int, int, int]] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        if not 0 <= self.ustep <= USTEP_MAX:
            raise ValueError(f"ustep is an exponent of 0 to {USTEP_MAX}, got {self.ustep}")
        for name in ("sprf", "slow_rpm", "ihd", "xclk", "pulse_us"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} is never negative, got {getattr(self, name)}")
        self._check_motor()
        derive = object.__setattr__
        derive(self, "steps_per_rev", self.sprf or FACTORY_SPRF)
        derive(self, "slow", self.slow_rpm or 1)
        derive(self, "m", 1 << self.ustep)
        derive(self, "rate", self.rate_of(1))
        derive(self, "slow_speed", self.speed(self.slow))
        derive(self, "offset", self.xclk - self.ihd + SERVICE_TICKS)
        derive(self, "whole_ramps", {})

    def rate_of(self, weight: int) -> int:
        """What divided by the speed gives the nominal ticks of a pulse of some weight."""
        return TICKS_PER_MINUTE * 100 * weight // self.steps_per_rev

    def speed(self, rpm: Rpm) -> int:
        """An RPM in this room's integer unit; what does not fit the unit is cut off."""
        return int(rpm * 100 * self.m)

    def rpm(self, speed: int) -> Rpm:
        """The exact RPM of a speed: an int where it is whole, else a Fraction."""
        exact = Fraction(speed, 100 * self.m)
        return exact.numerator if exact.denominator == 1 else exact

    def cruise_period(self, cycle_us: int, weight: int = 1) -> int:
        """Real ticks of a pulse when a full step lasts cycle_us; truncated, as the device does."""
        period = (cycle_us * TICKS_PER_US * weight >> self.ustep) + self.offset
        return max(1, period)

    def real_rpm(self, period: int, weight: int = 1) -> float:
        """RPM at which the motor turns when every pulse lasts `period` real ticks."""
        return TICKS_PER_MINUTE * weight / (self.steps_per_rev * self.m * period)

    def _check_motor(self) -> None:
        if self.pull_in_rpm is not None and self.pull_in_rpm < 1:
            raise ValueError(f"a motor pulls in at 1 RPM at least, got {self.pull_in_rpm}")
        if not self.pull_out:
            return
        if self.pull_in_rpm is None:
            raise ValueError("a pull-out curve needs a pull-in speed: a stalled motor starts there")
        speeds = [rpm for rpm, _ in self.pull_out]
        if speeds[0] < 0 or any(low >= high for low, high in pairwise(speeds)):
            raise ValueError(f"the RPM of a pull-out curve rise from 0 on, got {speeds}")
        if any(acceleration < 0 for _, acceleration in self.pull_out):
            raise ValueError("the accelerations of a pull-out curve are never negative")
