"""An SS-MST67's motor, step by step and list by list: slow, and plainly what the decisions say."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, repeat
from typing import NamedTuple

from sacbus.wire.superstepper import ChangeSpeed, MoveAtSpeed, MoveSteps, Stop


class Period(NamedTuple):
    value: int
    divider: int
    sign: int


def ramp(slow: int, fast: int, rate: int, beat: int, divider: int) -> list[int]:
    """The values of the periods of a ramp, one by one."""
    tick, found = 0, []
    while rate:
        value = max(slow - rate * (tick // beat), fast)
        if value <= fast:
            break
        found.append(value)
        tick += 2 * divider * value
    return found


class SlowMotor:
    """Time in ticks of the timer; steps as a list of (tick, sign)."""

    def __init__(self, *, start: int, rate: int, beat: int) -> None:
        self.start, self.rate, self.beat = start, rate, beat
        self.steps: list[tuple[int, int]] = []
        self.begin = 0
        self.period: Period | None = None
        self.rest: Iterator[Period] = iter(())
        self.move: MoveAtSpeed | MoveSteps | None = None
        self.left = 0
        self.stored: int | None = None

    # ---- time ----

    def run(self, tick: int) -> None:
        """Up to and with a tick."""
        while self.period is not None:
            half = self.period.divider * self.period.value
            step = self.begin + half
            if step <= tick and (not self.steps or self.steps[-1][0] < step):
                self.steps.append((step, self.period.sign))
            if self.begin + 2 * half > tick:
                return
            self.begin += 2 * half
            self._next()

    def _next(self) -> None:
        self.period = next(self.rest, None)
        if self.period is not None and isinstance(self.move, MoveSteps):
            self.left -= self.period.sign == self._sign

    @property
    def _sign(self) -> int:
        assert self.move is not None
        return 1 if self.move.clockwise else -1

    def position(self, tick: int) -> int:
        return sum(sign for at, sign in self.steps if at <= tick)

    # ---- commands ----

    def command(self, command: MoveAtSpeed | MoveSteps | ChangeSpeed | Stop, tick: int) -> None:
        self.run(tick)
        if self.period is None:
            self.begin = tick
        match command:
            case MoveAtSpeed(speed=speed):
                self.move = command
                stored, self.stored = self.stored, None
                self._take(
                    self._at_speed(speed if stored is None else stored, ramps=command.accelerate)
                )
            case MoveSteps(speed=speed, steps=steps):
                self.move, self.left = command, steps
                if steps:
                    self._take(self._for_steps(speed))
                else:
                    self._halt()
            case ChangeSpeed(speed):
                if self.period is None or self.move is None:
                    self.stored = speed
                elif isinstance(self.move, MoveSteps):
                    self._take(self._for_steps(speed))
                else:
                    self._take(self._at_speed(speed, ramps=True))
            case Stop(decelerate=True):
                if self.period is not None:
                    self.move = None
                    self.rest = iter(self._brake())
            case Stop():
                self._halt()

    def _halt(self) -> None:
        self.period, self.move, self.rest = None, None, iter(())

    def _take(self, periods: Iterator[Period]) -> None:
        self.rest = periods
        if self.period is None:
            self._next()

    def _up(self, slow: int, fast: int, divider: int) -> list[int]:
        return ramp(slow, fast, self.rate, self.beat, divider)

    def _brake(self) -> list[Period]:
        period = self.period
        assert period is not None
        down = reversed(self._up(self.start, period.value, period.divider))
        return [period._replace(value=value) for value in down]

    def _enter(self, target: int) -> tuple[list[Period], int]:
        """What comes first, and the value that it then goes on from."""
        assert self.move is not None
        divider = self.move.rate.divider
        if self.period is None:
            return [], max(self.start, target)
        if self.period.sign != self._sign:
            return self._brake(), max(self.start, target)
        exact = self.period.value * self.period.divider
        return [], min(max(-(-exact // divider), 1), 65_536)

    def _periods(self, values: Iterator[int]) -> Iterator[Period]:
        assert self.move is not None
        divider, sign = self.move.rate.divider, self._sign
        return (Period(value, divider, sign) for value in values)

    def _between(self, first: int, last: int, divider: int) -> list[int]:
        if first > last:
            return self._up(first, last, divider)
        return self._up(last, first, divider)[::-1]

    def _at_speed(self, speed: int, *, ramps: bool) -> Iterator[Period]:
        assert self.move is not None
        target = speed or 65_536
        before, first = self._enter(target)
        way = self._between(first, target, self.move.rate.divider) if ramps else []
        return chain(before, self._periods(chain(way, repeat(target))))

    def _for_steps(self, speed: int) -> Iterator[Period]:
        assert self.move is not None
        target, divider, steps = speed or 65_536, self.move.rate.divider, self.left
        before, first = self._enter(target)
        way = self._between(first, target, divider)
        down = self._up(self.start, target, divider)[::-1]
        if len(way) + len(down) <= steps:
            values = [*way, *[target] * (steps - len(way) - len(down)), *down]
        elif first > target:
            values = self._peak(first, way, steps, divider)
        elif self.start <= first:
            values = way[:steps]
        else:
            down = self._up(self.start, first, divider)[::-1]
            values = [*[first] * (steps - len(down)), *down[:steps]]
        return chain(before, self._periods(iter(values)))

    def _peak(self, first: int, way: list[int], steps: int, divider: int) -> list[int]:
        """The fastest value on the way for which there are steps enough, up to it and down."""
        for value in sorted(set(way)):
            up = way[: way.index(value)]
            down = self._up(self.start, value, divider)[::-1]
            if len(up) + len(down) <= steps:
                return [*up, *[value] * (steps - len(up) - len(down)), *down]
        return self._up(self.start, first, divider)[::-1][:steps]
