"""Session defaults, and how they fill in what a motion command leaves out.

Owns ``Motion`` (a command with every value resolved: what profiles are made of), ``Defaults`` (the
system defaults, from EEPROM) and ``Session`` (what V, A, D, L, $L, $F and $P leave behind). All are
values: nothing here changes, a new session comes back instead.
Source: manual, "System defaults", "Session defaults", "Motion", "V"; spec, "Motion".
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, Self

from .commands import BARE, Acceleration, Bare, Deceleration, Move, Velocity
from .values import maker

__all__ = ["Defaults", "Motion", "Session"]

_US_PER_MINUTE: Final = 60_000_000


@dataclass(frozen=True, slots=True)
class Motion:
    """A motion command with every value resolved.

    steps: full steps, or pulses when ``pulses`` is True; None = continuous. rpm: integer, 0 when
    the cycle is longer than that of 1 RPM. cycle_us: of the target, per full step, >= 1; what
    cruise uses. acc100, dec100: hundredths, 1 to 99900 (= 999, no ramp), in RPM per full step
    (harmonic) or rad/s2 (linear). extra_pulses 0 to 255, wait_us 32 bits. by_cycle: the velocity
    is known to have been given as a cycle, which may be the very one of its RPM.
    """

    steps: int | None
    cw: bool
    rpm: int
    cycle_us: int
    acc100: int
    dec100: int
    linear: bool
    extra_pulses: int = 0
    wait_us: int = 0
    sync: bool = False
    pulses: bool = False
    by_cycle: bool = field(default=False, compare=False)


@dataclass(frozen=True, slots=True)
class Defaults:
    """System defaults: the persistent parameters that a session starts from and returns to.

    cycle_us >= 1 and sprf >= 1 are the caller's to ensure. The values here are the factory's
    (manual, "Configure"; 10.47 for the linear ramp is a decision of the spec).
    """

    cycle_us: int = 3000
    acc100: int = 100
    dec100: int = 100
    linear_acc100: int = 1047
    linear_dec100: int = 1047
    linear: bool = False
    sprf: int = 200
    cw: bool = True
    full_step: bool = True

    def cycle_of(self, rpm: int) -> int:
        """Cycle in us of a whole number of RPM >= 1: truncated, never below 1.

        59 RPM at 200 steps gives 5084 (manual, "Timing"). The floor of 1 is a decision: beyond
        300 000 RPM the device would divide by nothing.
        """
        return _US_PER_MINUTE // (self.sprf * rpm) or 1

    def rpm_of(self, cycle_us: int) -> int:
        """RPM of a cycle >= 1 us, truncated: 4567 gives 65 (manual, "V")."""
        return _US_PER_MINUTE // (self.sprf * cycle_us)

    def says(self, rpm: int, cycle_us: int) -> bool:
        """Whether V with this RPM says this very cycle, as v100 says 3000 us; else VC has to."""
        return rpm > 0 and self.cycle_of(rpm) == cycle_us

    def acc_of(self, *, linear: bool) -> int:
        """System acceleration of a ramp, in hundredths."""
        return self.linear_acc100 if linear else self.acc100

    def dec_of(self, *, linear: bool) -> int:
        """System deceleration of a ramp, in hundredths."""
        return self.linear_dec100 if linear else self.dec100


_FACTORY: Final = Defaults()


@dataclass(frozen=True, slots=True)
class Session:
    """The session defaults: what a command that leaves something out is given.

    rpm and cycle_us are one velocity, by_cycle as in :class:`Motion`; acc100 and dec100 belong to
    the ramp ``linear``; full_step is $F (True) or $P.
    """

    rpm: int = 100
    cycle_us: int = _FACTORY.cycle_us
    acc100: int = _FACTORY.acc100
    dec100: int = _FACTORY.dec100
    linear: bool = _FACTORY.linear
    full_step: bool = _FACTORY.full_step
    defaults: Defaults = _FACTORY
    by_cycle: bool = field(default=True, compare=False)

    @classmethod
    def start(cls, defaults: Defaults) -> Self:
        """The session after a boot, cold or warm."""
        return cls(
            defaults.rpm_of(defaults.cycle_us),
            defaults.cycle_us,
            defaults.acc_of(linear=defaults.linear),
            defaults.dec_of(linear=defaults.linear),
            defaults.linear,
            defaults.full_step,
            defaults,
        )

    def resolve(self, move: Move) -> tuple[Motion, Session]:
        """What a command means now, and the session it leaves behind.

        L goes first wherever it stood and brings its ramp's system defaults for a missing A or D.
        V, A, D and L become session defaults; steps, direction, U, T, S, F and P do not. A
        continuous command leaves the session alone ("all parameters are trashed", manual,
        "Continuous"); for a throw-away one the caller drops the second value. When nothing changed
        the very same session comes back.
        """
        defaults = self.defaults
        acc100: int | Bare | None = move.acc100
        dec100: int | Bare | None = move.dec100
        linear = move.linear
        if linear is None:
            linear = self.linear
            if acc100 is None:
                acc100 = self.acc100
            if dec100 is None:
                dec100 = self.dec100
        if acc100 is None or acc100 is BARE:
            acc100 = defaults.acc_of(linear=linear)
        if dec100 is None or dec100 is BARE:
            dec100 = defaults.dec_of(linear=linear)
        rpm, cycle_us, by_cycle = self._velocity(move.rpm, move.cycle_us)
        pulses = move.pulses
        motion = _make_motion(
            move.steps or None,
            defaults.cw is not move.opposite,
            rpm,
            cycle_us,
            acc100,
            dec100,
            linear,
            move.extra_pulses or 0,
            move.wait_us or 0,
            move.sync or False,
            not self.full_step if pulses is None else pulses,
            by_cycle,
        )
        if not move.steps or (
            cycle_us == self.cycle_us
            and rpm == self.rpm
            and by_cycle is self.by_cycle
            and acc100 == self.acc100
            and dec100 == self.dec100
            and linear is self.linear
        ):
            return motion, self
        after = _make_session(
            rpm, cycle_us, acc100, dec100, linear, self.full_step, defaults, by_cycle
        )
        return motion, after

    def _velocity(self, rpm: int | Bare | None, cycle_us: int | None) -> tuple[int, int, bool]:
        """RPM and cycle of a velocity as given, and whether as a cycle; the session's when not."""
        defaults = self.defaults
        if cycle_us is not None:
            return defaults.rpm_of(cycle_us), cycle_us, True
        if rpm is None:
            return self.rpm, self.cycle_us, self.by_cycle
        if rpm is BARE:
            return defaults.rpm_of(defaults.cycle_us), defaults.cycle_us, True
        return rpm, defaults.cycle_of(rpm), False

    def with_velocity(self, velocity: Velocity) -> Session:
        """After ``V``: RPM and cycle follow each other, the one given is exact."""
        rpm, cycle_us, by_cycle = self._velocity(velocity.rpm, velocity.cycle_us)
        return _make_session(
            rpm,
            cycle_us,
            self.acc100,
            self.dec100,
            self.linear,
            self.full_step,
            self.defaults,
            by_cycle,
        )

    def with_acceleration(self, acceleration: Acceleration) -> Session:
        """After ``A``; bare brings back the system default of the present ramp."""
        acc100 = acceleration.acc100
        if acc100 is BARE:
            acc100 = self.defaults.acc_of(linear=self.linear)
        return replace(self, acc100=acc100)

    def with_deceleration(self, deceleration: Deceleration) -> Session:
        """After ``D``; bare brings back the system default of the present ramp."""
        dec100 = deceleration.dec100
        if dec100 is BARE:
            dec100 = self.defaults.dec_of(linear=self.linear)
        return replace(self, dec100=dec100)

    def with_ramp(self, *, linear: bool) -> Session:
        """After ``$L``: the ramp, with its own default acceleration and deceleration."""
        defaults = self.defaults
        acc100, dec100 = defaults.acc_of(linear=linear), defaults.dec_of(linear=linear)
        return replace(self, linear=linear, acc100=acc100, dec100=dec100)

    def with_full_step(self, *, full_step: bool) -> Session:
        """After ``$F`` (True) or ``$P`` (False)."""
        return replace(self, full_step=full_step)


_make_motion = maker(Motion)
_make_session = maker(Session)
