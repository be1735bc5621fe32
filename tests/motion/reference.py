"""The motion of a SAC, pulse by pulse: slow, obvious, and without anything of sacbus.motion.

Written from the manual ("Profile Planning", "Profiles", "Micro-stepping") and the spec of motion;
every pulse is an object, every velocity a fraction. The tests hold the room against it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate

from sacbus.language import Motion

NONE = 99_900


@dataclass(frozen=True)
class Setup:
    """The node, as far as motion goes."""

    sprf: int = 200
    slow: int = 10
    ustep: int = 0
    ihd: int = 8
    xclk: int = 0

    @property
    def m(self) -> int:
        return 1 << self.ustep

    def real(self, ticks: int) -> int:
        return max(1, ticks + self.xclk - self.ihd + 8)

    def ticks_at(self, rpm: Fraction) -> int:
        return math.floor(Fraction(120_000_000) / (self.sprf * self.m * rpm))

    def steps_to(self, rpm: Fraction, acc100: int) -> int:
        """Full steps of a linear ramp from standstill."""
        return int(math.pi * float(rpm) ** 2 * self.sprf / (36 * acc100))

    def austin(self, acc100: int, count: int) -> list[int]:
        alpha = 2 * math.pi / (self.sprf * self.m)
        c = 0.676 * math.sqrt(2 * alpha / (acc100 / 100)) * 2_000_000
        terms = []
        for n in range(count):
            if n:
                c = c - 2 * c / (4 * n + 1)
            terms.append(int(c))
        return terms


@dataclass(frozen=True)
class Pulse:
    period: int
    state: str
    rpm: Fraction
    rung: tuple[int, int] | None = None
    """On a linear ramp: its index and the ramp's acc100."""


@dataclass(frozen=True)
class Run:
    """What a command did: its pulses, and when it ended."""

    motion: Motion
    setup: Setup
    pulses: tuple[Pulse, ...]
    end: int | None = None
    """None: when the last period has run out."""

    @property
    def times(self) -> list[int]:
        return list(accumulate((p.period for p in self.pulses), initial=0))[:-1]

    @property
    def duration(self) -> int:
        return sum(p.period for p in self.pulses) if self.end is None else self.end

    def issued(self, t: int) -> int:
        return sum(time <= t for time in self.times)

    def halt(self, t: int) -> Run:
        return self if t >= self.duration else Run(self.motion, self.setup, self._first(t), t)

    def cut(self, t: int) -> Run:
        return self if t >= self.duration else Run(self.motion, self.setup, self._first(t))

    def slow_down(self, t: int, dec100: int, linear: bool) -> Run:
        if t >= self.duration or self.issued(t) == len(self.pulses):
            return self
        setup, done = self.setup, self._first(t)
        last = done[-1]
        if dec100 == NONE:
            count = 0
        elif linear and last.rung:
            index, acc100 = last.rung
            count = index * acc100 // dec100
        elif last.rpm <= setup.slow:
            count = 0
        elif linear:
            count = setup.steps_to(last.rpm, dec100) * setup.m
        elif self.motion.pulses:
            count = math.floor((last.rpm - setup.slow) * setup.m * 100 / dec100)
        else:
            count = math.floor((last.rpm - setup.slow) * 100 / dec100) * setup.m
        if not self.motion.pulses:
            count -= count % setup.m
            while (len(done) + count) % setup.m:
                count += 1
        if dec100 == NONE:
            tail = [Pulse(last.period, "DECEL", last.rpm)] * count
        else:
            tail = coming_down(setup, dec100, linear, count, last)
        return Run(self.motion, setup, (*done, *tail))

    def retarget(self, t: int, motion: Motion, cruise: int) -> Run:
        setup, done = self.setup, self._first(t)
        last = done[-1]
        tail: list[Pulse] = []
        if motion.rpm > setup.slow and motion.acc100 != NONE:
            if motion.linear:
                if last.rung:
                    index = last.rung[0] * last.rung[1] // motion.acc100
                else:
                    rpm = max(last.rpm, Fraction(setup.slow))
                    index = setup.steps_to(rpm, motion.acc100) * setup.m
                target = setup.steps_to(Fraction(motion.rpm), motion.acc100) * setup.m
                tail = linear_ramp(setup, motion.acc100, index, target)
            else:
                v0 = max(last.rpm, Fraction(setup.slow))
                tail = harmonic_ramp(setup, motion.acc100, v0, Fraction(motion.rpm))
        tail += [cruising(setup, motion)] * cruise
        return Run(motion, setup, (*done, *tail))

    def _first(self, t: int) -> tuple[Pulse, ...]:
        return self.pulses[: self.issued(t)]


def cruising(setup: Setup, motion: Motion) -> Pulse:
    ticks = motion.cycle_us * 2 // setup.m
    return Pulse(setup.real(ticks), "CRUISE", Fraction(motion.rpm))


def harmonic_ramp(setup: Setup, acc100: int, v0: Fraction, target: Fraction) -> list[Pulse]:
    """The whole ramp between two velocities, up or down."""
    acc = Fraction(acc100, 100)
    steps = math.floor(abs(target - v0) / acc)
    way = 1 if target >= v0 else -1
    pulses = []
    for k in range(steps * setup.m):
        rpm = v0 + way * acc * k / setup.m
        pulses.append(Pulse(setup.real(setup.ticks_at(rpm)), "ACCEL", rpm))
    return pulses


def linear_pulse(setup: Setup, acc100: int, n: int, terms: list[int], state: str) -> Pulse:
    real = setup.real(terms[n])
    # The velocity of such a pulse is what its timer count says, the tuning taken off again.
    nominal = max(1, real - (setup.xclk - setup.ihd + 8))
    unit = 100 * setup.m
    rpm = Fraction(12_000_000_000 // setup.sprf // nominal, unit)
    return Pulse(real, state, rpm, (n, acc100))


def linear_ramp(setup: Setup, acc100: int, index: int, target: int) -> list[Pulse]:
    terms = setup.austin(acc100, max(index, target))
    order = range(index, target) if target >= index else range(index - 1, target - 1, -1)
    return [linear_pulse(setup, acc100, n, terms, "ACCEL") for n in order]


def coming_down(setup: Setup, dec100: int, linear: bool, count: int, top: Pulse) -> list[Pulse]:
    """`count` pulses that end at slow (linear: at index 0), none faster than `top`."""
    terms = setup.austin(dec100, count) if linear else []
    pulses = []
    for j in range(count - 1, -1, -1):
        held = Pulse(top.period, "DECEL", top.rpm)
        if linear:
            own = linear_pulse(setup, dec100, j, terms, "DECEL")
            pulses.append(own if own.period >= top.period else held)
        else:
            rpm = setup.slow + Fraction(dec100, 100) * j / setup.m
            own = Pulse(setup.real(setup.ticks_at(rpm)), "DECEL", rpm)
            pulses.append(own if rpm <= top.rpm else held)
    return pulses


def run(motion: Motion, setup: Setup, start: int = 0, cruise: int = 0) -> Run:
    """A command from rest (0) or from a kept velocity; continuous ones cruise so many pulses."""
    target, slow, m = Fraction(motion.rpm), Fraction(setup.slow), setup.m
    v0 = max(Fraction(start), slow)
    up: list[Pulse] = []
    dec_steps = 0
    if target > slow and motion.acc100 != NONE:
        if motion.linear:
            index = setup.steps_to(v0, motion.acc100) * m if start else 0
            up = linear_ramp(setup, motion.acc100, index, setup.steps_to(target, motion.acc100) * m)
        else:
            up = harmonic_ramp(setup, motion.acc100, v0, target)
    if target > slow and motion.dec100 != NONE:
        if motion.linear:
            dec_steps = setup.steps_to(target, motion.dec100)
        else:
            dec_steps = math.floor((target - slow) * 100 / motion.dec100)
    top = cruising(setup, motion)
    if motion.steps is None:
        return Run(motion, setup, (*up, *[top] * cruise))
    unit = 1 if motion.pulses else m
    n_acc, n_dec = len(up) // unit, dec_steps * m // unit
    n_cruise = motion.steps - n_acc - n_dec
    extra = motion.extra_pulses
    if n_cruise < 0:
        if up:
            top = up[max(1, n_acc * motion.steps // (n_acc + n_dec) * unit) - 1]
        n_acc = n_acc * motion.steps // (n_acc + n_dec)
        n_dec, n_cruise, extra = motion.steps - n_acc, 0, 0
        down = coming_down(setup, motion.dec100, motion.linear, n_dec * unit, top)
    else:
        # Coming down from V itself, a ramp begins a step below it and needs no holding back.
        slowest = Pulse(0, "", Fraction(10**12))
        down = coming_down(setup, motion.dec100, motion.linear, n_dec * unit, slowest)
    level = [cruising(setup, motion)] * (n_cruise * unit + extra)
    return Run(motion, setup, (*up[: n_acc * unit], *level, *down))
