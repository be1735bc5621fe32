"""What a SAC tells of its motion, and how that is read back.

Owns the stored form of an engine that goes its way (``sacbus.movement``): the profile and the board
that it runs on, which many have in common, and where this one stands in it. What is read back is an
engine again, so that it answers as the node's own did.

A node has a :class:`SacMovement` once somebody asks for it; it looks whether anything has changed
after everything the node does, as the pins do.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol, TypeVar

import numpy as np

from nodes.sac.command import CommandProcessor, shortest
from nodes.sac.engine import FROM_REST, Engine, Standing, Where
from nodes.sac.memory import Memory
from sacbus.kernel import Ns
from sacbus.language import Defaults, Motion
from sacbus.motion import Drive, Entry, Profile, Rpm, State, Timebase, plan
from sacbus.motion.legs import Leg
from sacbus.motion.profile import WINDOW_END
from sacbus.motion.stored import profile_from, store_profile
from sacbus.movement import Watcher

if TYPE_CHECKING:
    from sacbus.movement import Times

__all__ = ["Moving", "SacMovement", "SacSegment", "SacShape"]

_STANDBY: Final = State.STANDBY.name
#: Texts of profiles that are kept for nodes that are alike.
SHAPES_KEPT: Final = 1_024

_Key = TypeVar("_Key")


class Moving(Protocol):
    """The node that moves."""

    @property
    def engine(self) -> Engine: ...

    @property
    def commands(self) -> CommandProcessor: ...

    @property
    def obeyed(self) -> Memory:
        """The memory that it booted with."""
        ...

    @property
    def microstep_pins(self) -> int:
        """MS3 MS2 MS1 as bits 2 to 0."""
        ...

    @property
    def off_or_booting(self) -> str:
        """The word for what keeps it from obeying; empty while it obeys."""
        ...


class _Board(NamedTuple):
    """What of a node's settings shows in how it moves and what its pins say."""

    clock: Timebase
    ustep: int
    cw: int
    ops: int
    ms: int


class SacMovement:
    """The motion of one node, in the shape of ``sacbus.movement.Movement``."""

    __slots__ = ("_engine", "_memory", "_ms", "_node", "_shapes", "_standing", "_watcher", "_word")

    def __init__(self, node: Moving) -> None:
        self._node = node
        self._watcher: Watcher | None = None
        #: What the watcher knows: the engine, how it stood, and what the node is doing instead.
        self._engine = node.engine
        self._standing = node.engine.standing
        self._word = ""
        #: The shapes of nodes with such a board, and what made it one.
        self._memory = node.obeyed
        self._ms = -1
        self._shapes: _Shapes | None = None

    def watch(self, watcher: Watcher | None, now: Ns) -> None:
        """Have ``watcher`` told at once how the node moves, and of each change; None: nobody."""
        self._watcher = watcher
        self._engine = self._node.engine
        self._tell(now, self._idle_word(), anew=True)

    def look(self, now: Ns) -> None:
        """Tell of what has changed since the last look; the node does so after all it does."""
        node = self._node
        engine = node.engine
        word = node.off_or_booting
        if not word and node.commands.held is not None:
            word = "SYNC"
        if engine is self._engine:
            if word == self._word and engine.stands_as(self._standing):
                return
            self._tell(now, word, anew=False)
        else:
            self._engine = engine
            self._tell(now, word, anew=True)

    def _idle_word(self) -> str:
        """The state whatever the engine does; empty where that is the engine's own."""
        word = self._node.off_or_booting
        return word or ("SYNC" if self._node.commands.held is not None else "")

    def _tell(self, now: Ns, word: str, *, anew: bool) -> None:
        self._word = word
        clock = self._standing.clock
        standing = self._standing = self._engine.standing
        if self._watcher is None:
            return
        node = self._node
        shapes = self._shapes
        if (
            shapes is None
            or standing.clock is not clock
            or node.obeyed is not self._memory
            or node.microstep_pins != self._ms
        ):
            shapes = self._see_board(standing.clock)
        profile = standing.profile
        shape = shapes.at_rest if profile is None else shapes.of(profile)
        self._watcher(now, shape, _values(standing, word, anew=anew))

    def _see_board(self, clock: Timebase) -> _Shapes:
        node = self._node
        memory = self._memory = node.obeyed
        ms = self._ms = node.microstep_pins
        board = _Board(clock, memory.ustep, memory.cw, int(bool(memory.ops)), ms)
        self._shapes = _shapes_on(board, node.commands.session.defaults)
        return self._shapes


def _values(standing: Standing, word: str, *, anew: bool) -> str:
    """What is of one segment alone; what is as usual is left out."""
    pulses, microsteps, rotor = standing.rest
    text = f'"rest":[{pulses},{microsteps},{rotor}],"sign":{standing.sign}'
    if word:
        text += f',"state":"{word}"'
    if anew:
        text += ',"anew":true'
    if standing.profile is not None:
        started = "null" if standing.started is None else standing.started
        text += f',"anchor":{standing.anchor},"tick":{standing.tick},"started":{started}'
        entry = standing.entry
        if entry is not FROM_REST:
            text += f',"entry":[{float(entry.rpm)!r},{"true" if entry.stalled else "false"}]'
    return text


class _Shapes:
    """The shapes, as text, of nodes that have the same board and the same defaults."""

    def __init__(self, board: _Board, defaults: Defaults) -> None:
        self._defaults = defaults
        self._board = {**board._asdict(), "clock": [board.clock.ns, board.clock.ticks]}
        self.at_rest = _text({"board": self._board, "profile": None})
        #: Of profiles that are not laid out by what they were planned from, since the planner makes
        #: the same ones again; of others by what they are.
        self._planned: dict[tuple[Motion, Drive, Rpm], str] = {}
        self._laid_out: dict[tuple[Motion, Drive, int | None, tuple[Leg, ...]], str] = {}

    def of(self, profile: Profile) -> str:
        """That of a profile."""
        motion, drive = profile.motion, profile.drive
        if profile.is_laid_out:
            laid_out = motion, drive, profile.duration, profile.course.legs
            text = self._laid_out.get(laid_out)
            if text is None:
                text = _keep(self._laid_out, laid_out, self._text_of(profile))
            return text
        planned = motion, drive, profile.start_rpm
        text = self._planned.get(planned)
        if text is None:
            text = _keep(self._planned, planned, self._text_of(plan(*planned)))
        return text

    def _text_of(self, profile: Profile) -> str:
        return _text(
            {
                "command": shortest(profile.motion, self._defaults),
                "board": self._board,
                "profile": store_profile(profile),
            }
        )


def _keep(texts: dict[_Key, str], key: _Key, text: str) -> str:
    if len(texts) >= SHAPES_KEPT:
        texts.clear()
    texts[key] = text
    return text


#: Of all nodes with the same board.
_shapes_on = lru_cache(maxsize=64)(_Shapes)


def _text(stored: Mapping[str, object]) -> str:
    return json.dumps(stored, separators=(",", ":"))[1:-1]


class SacShape:
    """What segments have in common, read once for all of them."""

    __slots__ = ("board", "command", "profile")

    def __init__(self, stored: Mapping[str, Any]) -> None:
        """From what JSON has; KeyError, TypeError or ValueError for what is none."""
        board = dict(stored["board"])
        board["clock"] = Timebase(*board["clock"])
        self.board = _Board(**board)
        self.command = str(stored.get("command", ""))
        profile = stored["profile"]
        self.profile = None if profile is None else profile_from(profile)


class SacSegment:
    """A stored stretch of motion, in the shape of ``sacbus.movement.Segment``."""

    __slots__ = ("_board", "_engine", "_word", "anew", "command", "since")

    def __init__(self, since: Ns, shape: SacShape, values: Mapping[str, Any]) -> None:
        """``values`` as JSON has them; KeyError, TypeError or ValueError for what is none."""
        self.since = since
        self.anew = bool(values.get("anew", False))
        self.command = shape.command
        self._board = shape.board
        self._word = str(values.get("state", ""))
        profile = shape.profile
        entry = values.get("entry")
        self._engine = Engine.of(
            Standing(
                clock=shape.board.clock,
                rest=Where(*values["rest"]),
                profile=profile,
                sign=values["sign"],
                anchor=values["anchor"] if profile is not None else 0,
                tick=values["tick"] if profile is not None else 0,
                started=values["started"] if profile is not None else 0,
                entry=FROM_REST if entry is None else Entry(*entry),
            )
        )

    @property
    def started(self) -> Ns | None:
        """When its first pulse is issued, or was."""
        engine = self._engine
        return None if engine.profile is None or engine.profile.pulses == 0 else engine.started

    @property
    def end(self) -> Ns | None:
        """When its last pulse's period is over."""
        return self._engine.end

    def position(self, at: Ns) -> int:
        """Pulses from where the node was switched on."""
        return self._engine.position(at)

    def steps(self, at: Ns) -> float:
        """The same in full steps."""
        return self._engine.where(at).microsteps / (1 << self._board.ustep)

    def rotor(self, at: Ns) -> float:
        """Where the motor stands in full steps."""
        return self._engine.where(at).rotor / (1 << self._board.ustep)

    def rpm(self, at: Ns) -> float:
        """Velocity, signed."""
        return self._engine.rpm(at)

    def state(self, at: Ns) -> str:
        """As the node's own: what has come to its end is in STANDBY."""
        if self._word:
            return self._word
        end = self._engine.end
        return _STANDBY if end is not None and at >= end else self._engine.state(at).name

    def states(self) -> Sequence[tuple[Ns, str]]:
        """From when on it is in which state."""
        engine, since = self._engine, self.since
        found = [(since, self.state(since))]
        profile = engine.profile
        if self._word or profile is None:
            return found
        course = profile.course
        starts = [
            (engine.when(tick), leg.state.name)
            for tick, leg in zip(course.began, course.legs, strict=False)
        ]
        for when, name in (*starts, (engine.end, _STANDBY)):
            if when is None or when <= since or name == found[-1][1]:
                continue
            if engine.end is not None and name != _STANDBY and when >= engine.end:
                continue
            found.append((when, name))
        return found

    def pulse_times(self, since: Ns, until: Ns) -> Times:
        """When pulses are issued in [since, until)."""
        return self._in_ns(*self._window(since, until), falls=False)

    def pulse_ends(self, since: Ns, until: Ns) -> Times:
        """When clk falls again after each of these."""
        return self._in_ns(*self._window(since, until), falls=True)

    def _window(self, since: Ns, until: Ns) -> tuple[int, int]:
        before = self._engine.ticks_before
        return before(since), min(before(until), WINDOW_END)

    def _in_ns(self, first: int, last: int, *, falls: bool) -> Times:
        engine = self._engine
        profile = engine.profile
        if profile is None or last <= first or not self._board.clock.runs:
            return np.empty(0, dtype=np.int64)
        ask = profile.clk_falls if falls else profile.pulse_times
        return engine.whens(ask(first, last))

    def levels(self, at: Ns) -> Mapping[str, int]:
        """Levels of dir, the op pins and the driver's, as the pins have them."""
        board, engine = self._board, self._engine
        runs = int(self._runs(at)) if board.ops else 0
        return {
            "dir": board.cw if engine.clockwise else 1 - board.cw,
            "ms1": board.ms & 1,
            "ms2": board.ms >> 1 & 1,
            "ms3": board.ms >> 2,
            "op_sa": runs,
            "op_sb": 1 - runs if board.ops else 0,
        }

    def _runs(self, at: Ns) -> bool:
        engine = self._engine
        return (
            engine.profile is not None
            and engine.begun(at)
            and (engine.end is None or at < engine.end)
        )
