"""Commands in plain words, for monitor and live table.

Owns the English of the room; decides nothing. Speeds in RPM or us, accelerations without a unit,
because RPM per step and rad/s2 depend on a ramp that the line need not name.
"""

from __future__ import annotations

from typing import assert_never

from .commands import (
    BARE,
    NO_RAMP,
    Acceleration,
    Bare,
    Command,
    Deceleration,
    Empty,
    Forward,
    Message,
    Move,
    Next,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    Stop,
    Velocity,
)
from .grammar import Parsed
from .session import Motion

__all__ = ["describe"]


def describe(what: Command | Motion | Parsed) -> str:
    """One line of printable words, never empty: ``move 3000 full steps, acceleration 2.00``.

    A parsed line without a command begins with ``nothing``; remarks follow in parentheses.
    """
    if isinstance(what, Parsed):
        words = "nothing" if what.command is None else _command(what.command)
        remarks = "; ".join(str(remark) for remark in what.remarks)
        return f"{words} ({remarks})" if remarks else words
    return _motion(what) if isinstance(what, Motion) else _command(what)


def _command(command: Command) -> str:
    match command:
        case Move():
            return _move(command)
        case Velocity(rpm, cycle_us):
            return f"set the velocity to {_speed(rpm, cycle_us)}"
        case ShowVelocity():
            return "show the velocity"
        case Acceleration(acc100):
            return f"set: {_ramp('acceleration', acc100)}"
        case Deceleration(dec100):
            return f"set: {_ramp('deceleration', dec100)}"
        case Stop(grace):
            return f"stop {'with grace' if grace else 'at once'}"
        case Next(grace):
            return f"end the present command {'with grace' if grace else 'at once'}, go on"
        case ReleaseSync():
            return "release sync"
        case SinglePulses(signs):
            return f"single pulses: {signs.count('+')} clockwise, {signs.count('-')} back"
        case SoftOp(start):
            return "motion has begun (DC1)" if start else "motion has ended (DC2)"
        case Empty():
            return "empty line"
        case Message(body):
            return f"message {body[1:]!a}"
        case Forward(destination, rest):
            to = "the last sender" if destination is None else f"node {destination}"
            return f"for {to}: {rest!a}"
        case _:
            assert_never(command)


def _move(move: Move) -> str:
    words = [_distance(move.steps, pulses=bool(move.pulses))]
    if move.opposite:
        words[0] += " in the opposite direction"
    if move.rpm is not None or move.cycle_us is not None:
        words[0] += f" at {_speed(move.rpm, move.cycle_us)}"
    if move.acc100 is not None:
        words.append(_ramp("acceleration", move.acc100))
    if move.dec100 is not None:
        words.append(_ramp("deceleration", move.dec100))
    if move.linear is not None:
        words.append("linear ramp" if move.linear else "harmonic ramp")
    words += _start(move.extra_pulses or 0, move.wait_us or 0, sync=bool(move.sync))
    return ", ".join(words)


def _motion(motion: Motion) -> str:
    way = "clockwise" if motion.cw else "counterclockwise"
    speed = f"{motion.rpm} RPM (cycle {motion.cycle_us} us)"
    words = [
        f"{_distance(motion.steps, pulses=motion.pulses)} {way} at {speed}",
        _ramp("acceleration", motion.acc100),
        _ramp("deceleration", motion.dec100),
        "linear ramp" if motion.linear else "harmonic ramp",
    ]
    words += _start(motion.extra_pulses, motion.wait_us, sync=motion.sync)
    return ", ".join(words)


def _distance(steps: int | None, *, pulses: bool) -> str:
    if not steps:
        return "move continuously"
    unit = "pulse" if pulses else "full step"
    return f"move {steps} {unit}{'' if steps == 1 else 's'}"


def _speed(rpm: int | Bare | None, cycle_us: int | None) -> str:
    if cycle_us is not None:
        return f"a cycle of {cycle_us} us"
    return "the default velocity" if rpm is BARE else f"{rpm} RPM"


def _ramp(name: str, value100: int | Bare) -> str:
    if value100 is BARE:
        return f"default {name}"
    if value100 == NO_RAMP:
        return f"no {name} ramp"
    return f"{name} {value100 // 100}.{value100 % 100:02}"


def _start(extra_pulses: int, wait_us: int, *, sync: bool) -> list[str]:
    words = []
    if extra_pulses:
        words.append(f"{extra_pulses} extra pulse{'' if extra_pulses == 1 else 's'}")
    if wait_us:
        words.append(f"after a wait of {wait_us} us")
    if sync:
        words.append("held for sync")
    return words
