"""Calibration: a minute of motion, timed by mother's clock, and what would set a node right.

Owns the command that is timed, the factor that comes of it, and the ``ihd`` and ``xclk`` proposed.

Theory. A node counts half microseconds of its own oscillator: a pulse at speed lasts twice its
cycle, plus ``xclk``, minus ``ihd``, plus the 8 that serving the pulse takes and the factory's ihd
of 8 makes up for. Soft ops tell when a command begins and when its last period has run out, each by
a packet of the same length, so their distance is that of the events. What it differs by from what
was planned is the oscillator. ``ihd`` and ``xclk`` add the same time to every pulse, so they are
exact at one velocity: at half of it they make up for half of the error.

Source: manual, "ihd", "xclk", "Control Area" (Calibrate); spec, mother ("Calibrate").
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from math import isfinite
from typing import TYPE_CHECKING, Final

from sacbus.kernel import SECOND, US, Ns
from sacbus.language import NO_RAMP, Defaults, Motion, Move, Session, ThrowAway
from sacbus.language.queue_file import BITS_32
from sacbus.mother.errors import BadRequest, MotherError, Stopped
from sacbus.mother.soft_ops import SoftOpHeard
from sacbus.motion import TICKS_PER_US, Drive, plan

if TYPE_CHECKING:
    from sacbus.mother.mother import Mother

__all__ = ["RPMS", "Calibration", "NoSoftOp", "Unlikely", "calibrate"]

#: What the companion offers; any other will do.
RPMS: Final = (5, 20, 60, 160)

#: The factory's settings, with which a pulse at speed lasts just what its cycle says.
_EXACT_IHD: Final = 8
_EXACT_XCLK: Final = 0

#: Ticks that ihd and xclk can hold, 8 bits each.
_MOST: Final = 255

#: The start wait: the node's ACK is out before it tells of the start, or DC1 would come late.
_WAIT_US: Final = 50_000

#: How much longer than planned an end is waited for: by a tenth, for an oscillator that is far off,
#: and by two seconds for what is between us and the line. A start as well.
_OFF: Final = 10
_LATE: Final[Ns] = 2 * SECOND

#: No oscillator is off by more than a fifth: an RC oscillator without any tuning is by a tenth.
_LIKELY: Final = 5

#: Ramps of velocities above slow, 1 RPM a step: the factory's.
_RAMP100: Final = 100

#: How often who looks on is told.
_LOOK: Final[Ns] = SECOND // 4

_PPM: Final = 1_000_000


class NoSoftOp(MotherError, TimeoutError):
    """A node has not told of the start, or of the end, of the command that was to be timed."""

    def __init__(self, node: int, what: str, waited: Ns) -> None:
        self.node = node
        super().__init__(
            f"node {node}: expected it to tell of the {what} of its motion, got nothing within "
            f"{waited / SECOND:.1f} s; see that nothing else drives or stops it, and try again"
        )


class Unlikely(MotherError):
    """What was measured is no oscillator's error."""

    def __init__(self, node: int, planned: Ns, took: Ns) -> None:
        self.node = node
        super().__init__(
            f"node {node}: {planned / SECOND:.3f} s of motion took {took / SECOND:.3f} s, expected "
            "an oscillator to be off by a fifth at most; see that the settings given are the "
            "node's, and that its bus runs in real time (serve without --speed)"
        )


@dataclass(frozen=True, slots=True)
class Calibration:
    """What a node's time is worth.

    nominal_ns: how long the command takes by the figures on it; measured_ns: by mother's clock.
    clock_ppm: by how much its oscillator is fast, in parts in a million, with the settings that it
    was said to have. ihd, xclk: what brings the velocity at ``rpm`` nearest to what it should be;
    None when that is beyond both. left_ppm: by how much the motor then is still fast.
    """

    node: int
    rpm: int
    steps: int
    nominal_ns: Ns
    measured_ns: Ns
    clock_ppm: float
    ihd: int | None
    xclk: int | None
    left_ppm: float | None

    @property
    def factor(self) -> float:
        """How long the node takes for what should take 1: above 1 it is slow."""
        return self.measured_ns / self.nominal_ns


async def calibrate(
    mother: Mother,
    node: int,
    *,
    rpm: int = 60,
    seconds: float = 60.0,
    drive: Drive | None = None,
    soft_ops_after: bool = False,
    progress: Callable[[float], object] | None = None,
) -> Calibration:
    """Have a node turn at ``rpm`` for about ``seconds``, and time it.

    The motor must be free to turn so far, in its default direction. ``drive`` holds the node's
    settings as they are now, of which ihd, xclk, sprf, slow and ustep count; without one, the
    factory's. Its queue and session stay as they are, but soft ops are switched on, which ends all
    motion, and afterwards off again, or left on if ``soft_ops_after``.

    ``progress`` is called now and then with the part that is done, 0 to 1. Whatever ends it early,
    a cancelled call too, the node is stopped with S. Raises :class:`NoSoftOp`,
    :class:`Unlikely`, :class:`BadRequest`, and what :meth:`Mother.send` does.
    """
    drive = drive or Drive()
    line, motion = _command(rpm, seconds, drive)
    planned = _duration(motion, drive)
    heard = _Heard(node)
    listeners = mother.caller.soft_op_listeners
    listeners.append(heard.take)
    switch_back = f"$O{int(soft_ops_after)}"
    stops = mother.caller.stops
    try:
        await mother.send(node, "$O1")
        await mother.send(node, line)
        if mother.caller.stops != stops:
            raise Stopped(0, "")  # it will not tell of a start
        begun = await _within(_WAIT_US * US + _LATE, mother, heard.begin, "start", node, None)
        part = None if progress is None else _Part(progress, begun, planned)
        patience = planned + planned // _OFF + _LATE
        ended = await _within(patience, mother, heard.end, "end", node, part)
        if mother.caller.stops != stops:
            raise Stopped(0, "")  # the end that was told of was that
    except BaseException:
        # What went wrong is worth telling, not what more goes wrong because of it.
        with suppress(MotherError):
            await mother.send(node, "S")
            await mother.send(node, switch_back)
        raise
    finally:
        listeners.remove(heard.take)
    await mother.send(node, switch_back)
    _check_likely(node, planned, ended - begun)
    return _worked_out(node, motion, drive, ended - begun)


def _command(rpm: int, seconds: float, drive: Drive) -> tuple[str, Motion]:
    """The command that is timed: thrown away afterwards, so it changes neither queue nor session.

    With the start wait, which is over when the start is told of.
    """
    if not isfinite(seconds):
        raise BadRequest(f"calibration at {rpm} RPM for {seconds} s: expected a time that ends")
    steps = round(rpm * drive.steps_per_rev * seconds / 60)
    if rpm < 1 or steps < 1:
        raise BadRequest(
            f"calibration at {rpm} RPM for {seconds:g} s: expected 1 RPM and one step at least"
        )
    if steps > BITS_32:
        raise BadRequest(
            f"calibration at {rpm} RPM for {seconds:g} s: expected at most {BITS_32} steps, got "
            f"{steps}; take fewer seconds"
        )
    ramp = _RAMP100 if rpm > drive.slow else NO_RAMP
    move = Move(
        steps,
        rpm=rpm,
        acc100=ramp,
        dec100=ramp,
        linear=False,
        extra_pulses=0,
        wait_us=_WAIT_US,
        pulses=False,
    )
    session = Session.start(Defaults(sprf=drive.steps_per_rev))
    return ThrowAway(move).text(), session.resolve(move)[0]


def _check_likely(node: int, planned: Ns, took: Ns) -> None:
    """Refuse to make an oscillator's error of what cannot be one."""
    if not planned * (_LIKELY - 1) <= took * _LIKELY <= planned * (_LIKELY + 1):
        raise Unlikely(node, planned, took)


def _duration(motion: Motion, drive: Drive) -> Ns:
    """From the first pulse to the end of the last period, ns of the node's own time."""
    ticks = plan(motion, drive).duration
    assert ticks is not None, "the command has steps"
    return ticks * US // TICKS_PER_US


class _Heard:
    """When a node has told of a start, and after that of an end."""

    def __init__(self, node: int) -> None:
        self._node = node
        loop = asyncio.get_running_loop()
        self.begin: asyncio.Future[Ns] = loop.create_future()
        self.end: asyncio.Future[Ns] = loop.create_future()

    def take(self, heard: SoftOpHeard) -> None:
        """A soft op of any node's."""
        if heard.node != self._node:
            return
        if heard.begins and not self.begin.done():
            self.begin.set_result(heard.at)
        elif not heard.begins and self.begin.done() and not self.end.done():
            self.end.set_result(heard.at)


@dataclass(slots=True)
class _Part:
    """Tells which part of a time is over."""

    tell: Callable[[float], object]
    begun: Ns
    length: Ns

    def look(self, now: Ns) -> None:
        """Tell it as of now."""
        self.tell(min(1.0, (now - self.begun) / self.length))


async def _within(
    patience: Ns,
    mother: Mother,
    awaited: asyncio.Future[Ns],
    what: str,
    node: int,
    part: _Part | None,
) -> Ns:
    """When it was told of; who looks on is told meanwhile. :class:`NoSoftOp` when it was not."""
    limit = mother.now + patience
    while True:
        until = limit if part is None else min(limit, mother.now + _LOOK)
        look = asyncio.ensure_future(mother.until(until))
        try:
            await asyncio.wait((awaited, look), return_when=asyncio.FIRST_COMPLETED)
            if not awaited.done():
                look.result()  # raises when the line is lost
        finally:
            look.cancel()
        if part is not None:
            part.look(mother.now)
        if awaited.done():
            return awaited.result()
        if mother.now >= limit:
            raise NoSoftOp(node, what, patience)


def _worked_out(node: int, motion: Motion, drive: Drive, measured: Ns) -> Calibration:
    """What the measured time says, in exact fractions up to the end."""
    nominal = _duration(motion, replace(drive, ihd=_EXACT_IHD, xclk=_EXACT_XCLK))
    # How long a tick of this node's really lasts, 1 being half a microsecond.
    tick = Fraction(measured, _duration(motion, drive))
    exact = drive.cruise_period(motion.cycle_us) - drive.offset
    offset = round(exact / tick) - exact
    ihd, xclk = max(0, _EXACT_IHD - offset), max(0, offset - _EXACT_IHD)
    possible = max(ihd, xclk) <= _MOST
    left = exact / (tick * (exact + offset)) - 1 if possible else None
    assert motion.steps is not None
    return Calibration(
        node,
        motion.rpm,
        motion.steps,
        nominal,
        measured,
        float((1 / tick - 1) * _PPM),
        ihd if possible else None,
        xclk if possible else None,
        None if left is None else float(left * _PPM),
    )
