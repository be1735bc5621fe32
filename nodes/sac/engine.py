"""The motion engine: the profile that is running, since when, and where the motor stands.

Owns the motor's position and the arithmetic between bus time and a profile's ticks. Which command
runs, and why it ends, is the command processor's business. Nothing here happens per pulse:
positions are computed when somebody asks.
Source: manual, "Discussion" (the motion engine).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from sacbus.kernel import Ns
from sacbus.motion import Profile, State

__all__ = ["TICK", "Engine"]

#: The timer's resolution: 2 MHz (manual, "Slow speed").
TICK: Final[Ns] = 500


class Engine:
    """One motor. Positions in pulses, signed, clockwise positive, from 0 at power up."""

    __slots__ = ("_profile", "_rest", "_sign", "_started", "end")

    def __init__(self) -> None:
        #: Position before the present profile's first pulse.
        self._rest = 0
        self._profile: Profile | None = None
        self._sign = 1
        self._started: Ns = 0
        #: When the present profile's last period runs out; None when it never does, or none runs.
        self.end: Ns | None = None

    @property
    def profile(self) -> Profile | None:
        """What is running, or about to start; None when the motor stands."""
        return self._profile

    @property
    def started(self) -> Ns:
        """When the present profile's first pulse is issued; it may be to come."""
        return self._started

    def start(self, profile: Profile, at: Ns) -> None:
        """Run a profile from ``at`` on; the motor must stand or have :meth:`finish`-ed."""
        self._started = at
        self._sign = 1 if profile.motion.cw else -1
        self._take(profile)

    def change(self, cut: Callable[[Profile, int], Profile], now: Ns) -> None:
        """Put the profile that ``cut`` makes of the present one at ``now`` (in ticks) in its place.

        Only once its first pulse has come; before that it is :meth:`discard`-ed.
        """
        if self._profile is not None:
            self._take(cut(self._profile, (now - self._started) // TICK))

    def finish(self) -> None:
        """The present profile has run out, or was halted: the motor stands where it got to."""
        if self._profile is not None:
            # Only continuous motion has no number of pulses, and that has no end to come to.
            self._rest += self._sign * (self._profile.pulses or 0)
        self._profile = None
        self.end = None

    def discard(self) -> None:
        """Forget a profile that has not issued a pulse."""
        self._profile = None
        self.end = None

    def step(self, pulses: int) -> None:
        """Single pulses, out of any profile; only while the motor stands."""
        self._rest += pulses

    def position(self, now: Ns) -> int:
        """Pulses from where the node was switched on, at ``now``."""
        if self._profile is None or now < self._started:
            return self._rest
        return self._rest + self._sign * self._profile.pulses_at((now - self._started) // TICK)

    def rpm(self, now: Ns) -> float:
        """Velocity at ``now`` in RPM, signed, clockwise positive."""
        if self._profile is None or now < self._started:
            return 0.0
        return self._sign * self._profile.velocity_at((now - self._started) // TICK)

    def state(self, now: Ns) -> State:
        """ACCEL, CRUISE, DECEL; STOP before a profile's first pulse; STANDBY when none is there."""
        if self._profile is None:
            return State.STANDBY
        if now < self._started:
            return State.STOP
        return self._profile.state_at((now - self._started) // TICK)

    def _take(self, profile: Profile) -> None:
        self._profile = profile
        duration = profile.duration
        self.end = None if duration is None else self._started + duration * TICK
