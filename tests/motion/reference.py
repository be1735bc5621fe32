"""The motion of a SAC, pulse by pulse: slow, obvious, and without anything of sacbus.motion.

Written from the manual ("Profile Planning", "Profiles", "Micro-stepping") and the spec of motion;
every pulse is an object, every velocity a fraction. The tests hold the room against it.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import accumulate

from sacbus.language import Motion

NONE = 99_900

LONG_ENOUGH = 400
"""Ticks of a pulse for which auto-micro takes more microsteps: 200 us."""


@dataclass(frozen=True)
class Setup:
    """The node, as far as motion goes."""

    sprf: int = 200
    slow: int = 10
    ustep: int = 0
    ihd: int = 8
    xclk: int = 0
    auto: bool = False
    finest: int | None = None
    """Pulses of a full step that the node is set to, where auto-micro makes fewer."""

    @property
    def m(self) -> int:
        return 1 << self.ustep

    def at(self, ustep: int) -> Setup:
        """The same node with other microsteps, and staying with them."""
        return replace(self, ustep=ustep, auto=False, finest=self.m)

    def real(self, ticks: int) -> int:
        return max(1, ticks + self.xclk - self.ihd + 8)

    def ticks_at(self, rpm: Fraction) -> int:
        return 120_000_000 * rpm.denominator // (self.sprf * self.m * rpm.numerator)

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
    held: bool = False
    """On the way down: not as fast as its ramp would have it."""
    weight: int = 1
    """How many of the node's finest microsteps it is; auto-micro makes larger ones."""


@dataclass(frozen=True)
class Run:
    """What a command did: its pulses, when it ended, and the velocity that it left."""

    motion: Motion
    setup: Setup
    pulses: tuple[Pulse, ...]
    end: int | None = None
    """None: when the last period has run out."""
    kept: Fraction = Fraction(0)

    @cached_property
    def times(self) -> list[int]:
        return list(accumulate((p.period for p in self.pulses), initial=0))[:-1]

    @property
    def duration(self) -> int:
        return sum(p.period for p in self.pulses) if self.end is None else self.end

    def issued(self, t: int) -> int:
        return bisect_right(self.times, t)

    def halt(self, t: int) -> Run:
        return self if t >= self.duration else Run(self.motion, self.setup, self._first(t), t)

    def cut(self, t: int) -> Run:
        if t >= self.duration:
            return self
        done = self._first(t)
        return Run(self.motion, self.setup, done, kept=done[-1].rpm)

    def slow_down(self, t: int, dec100: int, linear: bool) -> Run:
        if t >= self.duration or self.issued(t) == len(self.pulses):
            return self
        setup, done = self.setup, self._first(t)
        last = done[-1]
        if dec100 == NONE:
            count = 0
        elif linear and last.rung:
            index, acc100 = last.rung
            count = index * last.weight * acc100 // dec100
        elif last.rpm <= setup.slow:
            count = 0
        elif linear:
            count = setup.steps_to(last.rpm, dec100) * setup.m
        elif self.motion.pulses:
            count = math.floor((last.rpm - setup.slow) * setup.m * 100 / dec100)
        else:
            count = math.floor((last.rpm - setup.slow) * 100 / dec100) * setup.m
        rest = 0
        if not self.motion.pulses:
            count -= count % setup.m
            while (sum(p.weight for p in done) + rest) % setup.m:
                rest += last.weight
        if dec100 == NONE:
            held = replace(last, state="DECEL", rung=None, held=True)
            tail = [held] * ((count + rest) // last.weight)
            return Run(self.motion, setup, (*done, *tail), kept=last.rpm)
        if changes_gears(setup, self.motion):
            tail = geared_down(setup, dec100, linear, count // setup.m, rest // last.weight, last)
        else:
            tail = coming_down(setup, dec100, linear, count + rest, last)
        return Run(self.motion, setup, (*done, *tail))

    def retarget(self, t: int, motion: Motion, cruise: int) -> Run:
        setup, done = self.setup, self._first(t)
        geared = changes_gears(setup, motion)
        while geared and sum(p.weight for p in done) % setup.m:
            done = self.pulses[: len(done) + 1]
        last = done[-1]
        tail: list[Pulse] = []
        if motion.rpm > setup.slow and motion.acc100 != NONE:
            v0 = max(last.rpm, Fraction(setup.slow))
            if not motion.linear:
                tail = up_or_down(setup, motion, v0, 0)
            elif last.rung:
                index = (last.rung[0] + geared) * last.weight * last.rung[1] // motion.acc100
                if geared:
                    index -= index % setup.m
                tail = up_or_down(setup, motion, v0, index)
            else:
                tail = up_or_down(setup, motion, v0, setup.steps_to(v0, motion.acc100) * setup.m)
        tail += [cruising(setup, motion)] * cruise
        return Run(motion, setup, (*done, *tail))

    def _first(self, t: int) -> tuple[Pulse, ...]:
        return self.pulses[: self.issued(t)]


def changes_gears(setup: Setup, motion: Motion) -> bool:
    """Auto-micro counts in full steps, so a command that does not is left alone."""
    return setup.auto and not motion.pulses and not motion.extra_pulses


def in_gear(setup: Setup, steps: int, ramp_at: Callable[[Setup], list[Pulse]]) -> list[Pulse]:
    """A ramp of full steps, each made of as many microsteps as pulses stay long enough with."""
    ramps = [ramp_at(setup.at(ustep)) for ustep in range(setup.ustep + 1)]
    pulses: list[Pulse] = []
    for step in range(steps):
        for ustep in range(setup.ustep, -1, -1):
            m = 1 << ustep
            made = ramps[ustep][step * m : (step + 1) * m]
            if min(pulse.period for pulse in made) >= LONG_ENOUGH or ustep == 0:
                pulses += [replace(pulse, weight=setup.m // m) for pulse in made]
                break
    return pulses


def cruising(setup: Setup, motion: Motion) -> Pulse:
    if changes_gears(setup, motion):
        (*_, pulse) = in_gear(setup, 1, lambda at: [cruising(at, motion)] * at.m)
        return pulse
    ticks = motion.cycle_us * 2 // setup.m
    return Pulse(setup.real(ticks), "CRUISE", Fraction(motion.rpm))


def up_or_down(setup: Setup, motion: Motion, v0: Fraction, index: int) -> list[Pulse]:
    """The whole ramp of a command from a velocity, or (linear) from an index."""
    target = Fraction(motion.rpm)

    def ramp(at: Setup) -> list[Pulse]:
        if not motion.linear:
            return harmonic_ramp(at, motion.acc100, v0, target)
        begin = index * at.m // setup.m
        return linear_ramp(at, motion.acc100, begin, at.steps_to(target, motion.acc100) * at.m)

    if changes_gears(setup, motion):
        return in_gear(setup, len(ramp(setup.at(0))), ramp)
    return ramp(setup)


def harmonic_ramp(setup: Setup, acc100: int, v0: Fraction, target: Fraction) -> list[Pulse]:
    """The whole ramp between two velocities, up or down."""
    steps = math.floor(abs(target - v0) * 100 / acc100)
    way = 1 if target >= v0 else -1
    pulses = []
    for k in range(steps * setup.m):
        rpm = changed(v0, way * acc100 * k, 100 * setup.m)
        pulses.append(Pulse(setup.real(setup.ticks_at(rpm)), "ACCEL", rpm))
    return pulses


def changed(v0: Fraction | int, by: int, of: int) -> Fraction:
    """v0 + by / of, in one go: there are many of them."""
    return Fraction(v0.numerator * of + by * v0.denominator, v0.denominator * of)


def linear_pulse(setup: Setup, acc100: int, n: int, terms: list[int], state: str) -> Pulse:
    real = setup.real(terms[n])
    # The velocity of such a pulse is what its timer count says, the tuning taken off again.
    nominal = max(1, real - (setup.xclk - setup.ihd + 8))
    # It is cut off where the node's integers end: hundredths of an RPM times its finest microsteps.
    finest = setup.finest or setup.m
    hundredths = 12_000_000_000 * (finest // setup.m) // setup.sprf // nominal
    return Pulse(real, state, Fraction(hundredths, 100 * finest), (n, acc100))


def linear_ramp(setup: Setup, acc100: int, index: int, target: int) -> list[Pulse]:
    terms = setup.austin(acc100, max(index, target))
    order = range(index, target) if target >= index else range(index - 1, target - 1, -1)
    return [linear_pulse(setup, acc100, n, terms, "ACCEL") for n in order]


def coming_down(setup: Setup, dec100: int, linear: bool, count: int, top: Pulse) -> list[Pulse]:
    """`count` pulses that end at slow (linear: at index 0), none faster than `top`."""
    terms = setup.austin(dec100, count) if linear else []
    pulses = []
    for j in range(count - 1, -1, -1):
        held = Pulse(top.period, "DECEL", top.rpm, held=True)
        if linear:
            own = linear_pulse(setup, dec100, j, terms, "DECEL")
            pulses.append(own if own.period >= top.period else held)
        else:
            rpm = changed(setup.slow, dec100 * j, 100 * setup.m)
            own = Pulse(setup.real(setup.ticks_at(rpm)), "DECEL", rpm)
            pulses.append(own if rpm <= top.rpm else held)
    return pulses


def geared_down(
    setup: Setup, dec100: int, linear: bool, steps: int, rest: int, top: Pulse
) -> list[Pulse]:
    """The same with auto-micro: the gear of `top` is kept until a full step is the ramp's own."""
    low = setup.at(setup.ustep - (top.weight.bit_length() - 1))
    kept = [
        replace(pulse, weight=top.weight)
        for pulse in coming_down(low, dec100, linear, steps * low.m + rest, top)
    ]
    free = 0
    while free < steps and not kept[len(kept) - (free + 1) * low.m].held:
        free += 1
    down = whole_ramp_down(setup, dec100, linear, free)
    return kept[: len(kept) - free * low.m] + down


FASTEST = Pulse(0, "", Fraction(10**12))
"""Holds nothing back."""


def whole_ramp_down(setup: Setup, dec100: int, linear: bool, steps: int) -> list[Pulse]:
    """Full steps that end at slow, from a velocity that none of them is above."""

    def up(at: Setup) -> list[Pulse]:
        return coming_down(at, dec100, linear, steps * at.m, FASTEST)[::-1]

    return in_gear(setup, steps, up)[::-1]


def run(motion: Motion, setup: Setup, start: Fraction | int = 0, cruise: int = 0) -> Run:
    """A command from rest (0) or from a kept velocity; continuous ones cruise so many pulses."""
    target, slow, m = Fraction(motion.rpm), Fraction(setup.slow), setup.m
    geared = changes_gears(setup, motion)
    v0 = max(Fraction(start), slow)
    up: list[Pulse] = []
    dec_steps = 0
    if target > slow and motion.acc100 != NONE:
        index = setup.steps_to(v0, motion.acc100) * m if motion.linear and start else 0
        up = up_or_down(setup, motion, v0, index)
    if target > slow and motion.dec100 != NONE:
        if motion.linear:
            dec_steps = setup.steps_to(target, motion.dec100)
        else:
            dec_steps = math.floor((target - slow) * 100 / motion.dec100)
    top = cruising(setup, motion)
    if motion.steps is None:
        return Run(motion, setup, (*up, *[top] * cruise))
    unit = 1 if motion.pulses else m
    n_acc, n_dec = sum(p.weight for p in up) // unit, dec_steps * m // unit
    n_cruise = motion.steps - n_acc - n_dec
    extra = motion.extra_pulses
    if n_cruise < 0:
        if up:
            top = up[0]
        n_acc = n_acc * motion.steps // (n_acc + n_dec)
        n_dec, n_cruise, extra = motion.steps - n_acc, 0, 0
        travels = accumulate(pulse.weight for pulse in up)
        up = up[: sum(travel <= n_acc * unit for travel in travels)]
        if up:
            top = up[-1]
        if geared:
            down = geared_down(setup, motion.dec100, motion.linear, n_dec, 0, top)
        else:
            down = coming_down(setup, motion.dec100, motion.linear, n_dec * unit, top)
    elif geared:
        down = whole_ramp_down(setup, motion.dec100, motion.linear, n_dec)
    else:
        # Coming down from V itself, a ramp begins a step below it and needs no holding back.
        down = coming_down(setup, motion.dec100, motion.linear, n_dec * unit, FASTEST)
    level = cruising(setup, motion)
    levels = [level] * ((n_cruise * unit + extra) // level.weight)
    kept = Fraction(motion.rpm if motion.dec100 == NONE else 0)
    return Run(motion, setup, (*up, *levels, *down), kept=kept)
