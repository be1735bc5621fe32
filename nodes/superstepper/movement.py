"""What an SS-MST67 tells of its motion, and how that is read back.

Owns the stored form of a motor that goes its way (``sacbus.movement``): the course and the board,
and where this one stands in it. What is read back is an engine again, so that it answers as the
node's own did.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from nodes.superstepper.command import CommandProcessor
from nodes.superstepper.course import ACCEL, CRUISE, DECEL, Course, Stretch
from nodes.superstepper.engine import EIGHTHS, Engine, Standing
from nodes.superstepper.pins import TOLD, levels_of
from nodes.superstepper.ramp import TICKS_PER_MS, Pace, ramp
from sacbus.kernel import Ns
from sacbus.motion import Timebase
from sacbus.movement import Watcher
from sacbus.node import OFF
from sacbus.wire.superstepper import FULL_SPEED, Microsteps, describe

if TYPE_CHECKING:
    from sacbus.movement import Times

__all__ = ["Moving", "Shape", "SuperStepperMovement", "SuperStepperSegment"]

_STANDBY: Final = "STANDBY"

#: The largest divider, and the longest beat: a time base of 255 (``Rate``, ``Pace``).
_DIVIDER: Final = 64
_BEAT: Final = 256 * TICKS_PER_MS

#: The last tick that is looked at: 292 years of them are enough, and fit int64 with what is added.
_LAST: Final = 1 << 61


class Moving(Protocol):
    """The node that moves."""

    @property
    def commands(self) -> CommandProcessor: ...

    @property
    def steps_per_revolution(self) -> int: ...

    @property
    def powered(self) -> bool: ...


class _Board(NamedTuple):
    """What of a node shows in how it moves and what its pins say."""

    clock: Timebase
    ms_decay: int
    enabled: bool
    steps_per_revolution: int


class SuperStepperMovement:
    """The motion of one node, in the shape of ``sacbus.movement.Movement``."""

    __slots__ = ("_known", "_node", "_watcher")

    def __init__(self, node: Moving) -> None:
        self._node = node
        self._watcher: Watcher | None = None
        #: What the watcher knows.
        self._known: tuple[Engine, Standing, _Board, bool] = self._seen()

    def watch(self, watcher: Watcher | None, now: Ns) -> None:
        """Have ``watcher`` told at once how the node moves, and of each change; None: nobody."""
        self._watcher = watcher
        self._known = self._seen()
        self._tell(now, anew=True)

    def look(self, now: Ns) -> None:
        """Tell of what has changed since the last look; the node does so after all it does."""
        before, seen = self._known, self._seen()
        if seen == before:
            return
        self._known = seen
        self._tell(now, anew=seen[0] is not before[0])

    def _seen(self) -> tuple[Engine, Standing, _Board, bool]:
        node = self._node
        commands = node.commands
        engine = commands.engine
        board = _Board(
            engine.clock,
            commands.microsteps.byte,
            commands.enabled,
            node.steps_per_revolution,
        )
        return engine, engine.standing, board, node.powered

    def _tell(self, now: Ns, *, anew: bool) -> None:
        if self._watcher is None:
            return
        _, standing, board, powered = self._known
        course = standing.course
        command = self._node.commands.command
        shape: dict[str, object] = {
            "command": "" if command is None or course is None else describe(command),
            "clock": [board.clock.ns, board.clock.ticks],
            "ms_decay": board.ms_decay,
            "enabled": board.enabled,
            "steps_per_revolution": board.steps_per_revolution,
            "course": None if course is None else [_stored(one) for one in course.stretches],
        }
        values: dict[str, object] = {"rest": [standing.pulses, standing.eighths]}
        values["sign"] = standing.sign
        if course is not None:
            values["anchor"] = standing.anchor
        if not powered:
            values["state"] = OFF
        if anew:
            values["anew"] = True
        self._watcher(now, _text(shape), _text(values))


def _text(stored: Mapping[str, object]) -> str:
    return json.dumps(stored, separators=(",", ":"))[1:-1]


def _stored(stretch: Stretch) -> list[object]:
    up = stretch.ramp
    stored: list[object] = [
        stretch.state,
        stretch.sign,
        stretch.value,
        stretch.divider,
        stretch.periods,
    ]
    if up is not None:
        stored.append([up.slow, up.fast, up.pace.rate, up.pace.beat, stretch.backwards])
    return stored


class Shape:
    """What segments have in common, read once for all of them."""

    __slots__ = ("board", "command", "course")

    def __init__(self, stored: Mapping[str, Any]) -> None:
        """From what JSON has; KeyError, TypeError or ValueError for what is none."""
        self.command = str(stored["command"])
        self.board = _Board(
            Timebase(*stored["clock"]),
            _whole(stored["ms_decay"], 0, 0xFF),
            bool(stored["enabled"]),
            _whole(stored["steps_per_revolution"], 1),
        )
        course = stored["course"]
        self.course = None if course is None else Course([_stretch(one) for one in course])


def _stretch(stored: Sequence[Any]) -> Stretch:
    state, sign, value, divider, periods, *up = stored
    if state not in (ACCEL, CRUISE, DECEL) or sign not in (1, -1):
        raise ValueError(stored)
    value, divider = _whole(value, 1, FULL_SPEED), _whole(divider, 1, _DIVIDER)
    if periods is not None:
        _whole(periods, 0)
    if not up:
        return Stretch(state, sign, value, divider, periods)
    ((slow, fast, rate, beat, backwards),) = up
    pace = Pace(_whole(rate, 0, FULL_SPEED), _whole(beat, 1, _BEAT))
    found = ramp(_whole(slow, 1, FULL_SPEED), _whole(fast, 1, FULL_SPEED), pace, divider)
    if _whole(periods, 0) > found.periods:
        raise ValueError(stored)
    return Stretch(state, sign, value, divider, periods, found, bool(backwards))


def _whole(value: object, low: int, high: int = _LAST) -> int:
    if type(value) is not int or not low <= value <= high:
        raise ValueError(value)
    return value


class SuperStepperSegment:
    """A stored stretch of motion, in the shape of ``sacbus.movement.Segment``."""

    __slots__ = ("_board", "_engine", "_word", "anew", "command", "since")

    def __init__(self, since: Ns, shape: Shape, values: Mapping[str, Any]) -> None:
        """``values`` as JSON has them; KeyError, TypeError or ValueError for what is none."""
        self.since = since
        self.anew = bool(values.get("anew", False))
        self.command = shape.command
        self._board = board = shape.board
        self._word = str(values.get("state", ""))
        pulses, eighths = values["rest"]
        exponent = Microsteps.of(board.ms_decay).exponent
        anchor = 0 if shape.course is None else values["anchor"]
        sign = values["sign"]
        if sign not in (1, -1):
            raise ValueError(sign)
        self._engine = Engine.of(
            Standing(
                board.clock,
                _whole(pulses, -_LAST),
                _whole(eighths, -_LAST),
                EIGHTHS >> exponent,
                sign,
                shape.course,
                _whole(anchor, 0),
            )
        )

    @property
    def started(self) -> Ns | None:
        """When its first step is issued, or was."""
        course = self._engine.course
        if course is None or course.steps == 0:
            return None
        return self._engine.when(course.time_of(0))

    @property
    def end(self) -> Ns | None:
        """When its last step's period is over."""
        return self._engine.end

    def position(self, at: Ns) -> int:
        """Steps from where the node was switched on."""
        return self._engine.position(at)

    def steps(self, at: Ns) -> float:
        """The same in full steps."""
        return self._engine.eighths(at) / EIGHTHS

    def rotor(self, at: Ns) -> float:
        """Where the motor stands in full steps: it follows."""
        return self.steps(at)

    def rpm(self, at: Ns) -> float:
        """Velocity, signed."""
        return self._engine.rpm(at, self._board.steps_per_revolution)

    def state(self, at: Ns) -> str:
        """As the node's own."""
        return self._word or self._engine.state(at)

    def states(self) -> Sequence[tuple[Ns, str]]:
        """From when on it is in which state."""
        found = [(self.since, self.state(self.since))]
        engine = self._engine
        if self._word or engine.course is None:
            return found
        starts = [(engine.when(tick), state) for tick, state in engine.course.states()]
        if engine.end is not None:
            starts.append((engine.end, _STANDBY))
        for when, state in starts:
            if when > self.since and state != found[-1][1]:
                found.append((when, state))
        return found

    def pulse_times(self, since: Ns, until: Ns) -> Times:
        """When steps are issued in [since, until)."""
        return self._edges(since, until, falls=False)

    def pulse_ends(self, since: Ns, until: Ns) -> Times:
        """When clk falls again after each of these."""
        return self._edges(since, until, falls=True)

    def _edges(self, since: Ns, until: Ns, *, falls: bool) -> Times:
        engine = self._engine
        course = engine.course
        if course is None or until <= since:
            return np.empty(0, dtype=np.int64)
        window = engine.tick_at(since), min(engine.tick_at(until), _LAST)
        return engine.whens((course.step_ends if falls else course.step_times)(*window))

    def levels(self, at: Ns) -> Mapping[str, int]:
        """Levels of the outputs that are told of, as the pins have them."""
        if self._word == OFF:
            return dict.fromkeys(TOLD, 0)
        return levels_of(
            Microsteps.of(self._board.ms_decay),
            clockwise=self._engine.clockwise(at),
            enabled=self._board.enabled,
        )
