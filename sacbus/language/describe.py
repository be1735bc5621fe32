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
    ClearQueue,
    Command,
    Configure,
    Deceleration,
    Edit,
    EditQueue,
    Empty,
    EndLoop,
    Forward,
    Leave,
    LoopCommand,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    MapPins,
    Message,
    Move,
    Next,
    OperationCommand,
    ProgramQueue,
    ProgramReferences,
    QueueCommand,
    Ramp,
    Reboot,
    ReleaseSync,
    RestoreQueue,
    RunPosition,
    RunReferences,
    SaveQueue,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    SetReference,
    ShowConfiguration,
    ShowMemory,
    ShowQueue,
    ShowReferences,
    ShowSession,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    StepMode,
    Stop,
    SystemCommand,
    ThrowAway,
    ToggleDebug,
    ToggleEncoder,
    ToggleGap,
    ToggleStepMode,
    TrafficCommand,
    UnaryCommand,
    Undo,
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
    if isinstance(command, Move):
        return _move(command)
    if isinstance(command, ThrowAway):
        return f"thrown away afterwards: {_move(command.move)}"
    if isinstance(command, UnaryCommand):
        return _unary(command)
    if isinstance(command, QueueCommand):
        return _queue(command)
    if isinstance(command, LoopCommand):
        return _loop(command)
    if isinstance(command, OperationCommand):
        return _operation(command)
    if isinstance(command, SystemCommand):
        return _system(command)
    if isinstance(command, TrafficCommand):
        return _traffic(command)
    assert isinstance(command, Leave)
    return "leave this mode"


def _unary(command: UnaryCommand) -> str:
    match command:
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
        case _:
            assert_never(command)


def _queue(command: QueueCommand) -> str:
    match command:
        case ShowQueue():
            return "show the queue"
        case ProgramQueue():
            return "enter the program mode of the queue"
        case EditQueue(position, edit):
            return f"edit queue position {position}: {_edit(edit)}"
        case SaveQueue():
            return "save the queue"
        case RestoreQueue():
            return "restore the queue as it was saved"
        case ClearQueue():
            return "clear the queue to the session defaults"
        case _:
            assert_never(command)


def _loop(command: LoopCommand) -> str:
    match command:
        case LoopStart(position):
            return f"loop from queue position {position}"
        case LoopFinish(position):
            return f"loop up to queue position {position}"
        case LoopCount(count):
            return f"the next loop runs {_times(count)}"
        case LoopQueue():
            return "loop over the whole queue"
        case EndLoop():
            return "end the loop with grace"
        case RunReferences(count):
            return f"run the xRef array {_times(count)}"
        case RunPosition(position):
            return f"run queue position {position} at once"
        case ProgramReferences():
            return "enter the program mode of the xRef array"
        case SetReference(index, 0):
            return f"the xRef array ends before entry {index}"
        case SetReference(index, position):
            return f"xRef entry {index} is queue position {position}"
        case ShowReferences():
            return "show the xRef array"
        case _:
            assert_never(command)


def _operation(command: OperationCommand) -> str:
    match command:
        case ToggleGap():
            return "toggle GAP testing"
        case ToggleDebug():
            return "toggle debug mode"
        case ShowConfiguration():
            return "show the configuration"
        case ShowSession():
            return "show the session defaults"
        case Undo():
            return "undo the last change of the queue"
        case _:
            assert_never(command)


def _system(command: SystemCommand) -> str:
    match command:
        case Configure():
            return "enter the configure screen"
        case SetParameter(parameter):
            return f"store {parameter.title} = {command.entry()[1:]}"
        case MapPins(exponent, pins):
            step = f"1/{1 << exponent}" if exponent else "full"
            return f"store the pins {pins:03b} for {step} steps"
        case ShowMemory():
            return "show the EEPROM"
        case StepMode(full_step):
            return f"count {'full steps' if full_step else 'pulses'} in this session"
        case ToggleStepMode():
            return "toggle between full steps and pulses"
        case SendCrcs(on):
            return f"send {'CRCs' if on else 'no CRCs'} in this session"
        case SendAcks(on):
            return f"send {'ACK and NAK' if on else 'neither ACK nor NAK'} in this session"
        case Ramp(linear):
            return f"{'linear' if linear else 'harmonic'} ramps in this session"
        case ToggleEncoder():
            return "toggle the encoder between throttle and follow"
        case SendSoftOps(on):
            return f"send {'soft ops' if on else 'no soft ops'} in this session"
        case Reboot():
            return "warm reboot"
        case _:
            assert_never(command)


def _traffic(command: TrafficCommand) -> str:
    match command:
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


# --- motion ------------------------------------------------------------------------------------


def _move(move: Move) -> str:
    words = [_distance(move.steps, pulses=bool(move.pulses))]
    if move.opposite:
        words[0] += " in the opposite direction"
    if move.rpm is not None or move.cycle_us is not None:
        words[0] += f" at {_speed(move.rpm, move.cycle_us)}"
    words += _ramps(move)
    words += _start(move.extra_pulses or 0, move.wait_us or 0, sync=bool(move.sync))
    return ", ".join(words)


def _edit(edit: Edit) -> str:
    words = []
    if edit.steps is not None:
        words.append(_distance(edit.steps, pulses=bool(edit.pulses)))
    elif edit.pulses is not None:
        words.append("counted in pulses" if edit.pulses else "counted in full steps")
    if edit.opposite is not None:
        words.append(f"in the {'opposite' if edit.opposite else 'default'} direction")
    if edit.rpm is not None or edit.cycle_us is not None:
        words.append(f"at {_speed(edit.rpm, edit.cycle_us)}")
    words += _ramps(edit)
    if edit.extra_pulses is not None:
        words += _start(edit.extra_pulses, 0, sync=False) or ["no extra pulses"]
    if edit.wait_us is not None:
        words += _start(0, edit.wait_us, sync=False) or ["no wait"]
    if edit.sync is not None:
        words.append("held for sync" if edit.sync else "not held for sync")
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


def _ramps(of: Move | Edit) -> list[str]:
    words = []
    if of.acc100 is not None:
        words.append(_ramp("acceleration", of.acc100))
    if of.dec100 is not None:
        words.append(_ramp("deceleration", of.dec100))
    if of.linear is not None:
        words.append("linear ramp" if of.linear else "harmonic ramp")
    return words


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


def _times(count: int) -> str:
    if not count:
        return "for ever"
    return "once" if count == 1 else f"{count} times"
