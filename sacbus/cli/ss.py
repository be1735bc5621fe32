"""``sacbus ss``: one message as the master of a Super Stepper Bus, and what came of it."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import click

from sacbus.cli.options import NO_ANSWER_STATUS, verbose
from sacbus.cli.outcomes import NAK_STATUS, UNKNOWN_STATUS

if TYPE_CHECKING:
    from sacbus.wire.superstepper import Answer, Message

__all__ = ["ss_group"]

_RATES: Final = ("fast", "medium", "slow")
_DECAYS: Final = ("fast", "mixed", "slow")

#: What is made of an answer: the fields that JSON adds, and the words for people.
_Shown = Callable[["Answer"], tuple[dict[str, object], str]]


class _Number(click.ParamType[int]):
    """A whole number, decimal or 0x and hexadecimal."""

    name = "number"

    def __init__(self, high: int) -> None:
        self._high = high

    def convert(
        self,
        value: Any,  # noqa: ANN401 (text, or a default that is a number already)
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> int:
        """click's: from text."""
        try:
            number = value if isinstance(value, int) else int(value, 0)
        except ValueError:
            number = -1
        if not 0 <= number <= self._high:
            self.fail(f"expected a number from 0 to {self._high}, got {value!r}", param, ctx)
        return number


_BYTE: Final = _Number(0xFF)
_WORD: Final = _Number(0xFFFF)
_rate = click.option(
    "--rate", type=click.Choice(_RATES), default="fast", show_default=True, help="/ 1, / 8, / 64."
)
_speed = click.option(
    "--speed", type=_WORD, required=True, help="Half a step's ticks of 250 ns: larger is slower."
)


@click.group("ss")
@click.argument("link")
@click.argument("address", type=click.IntRange(0, 31))
@click.option(
    "--baud",
    type=click.IntRange(300, 4_000_000),
    default=9_600,
    show_default=True,
    help="Line rate.",
)
@click.option("--nine", is_flag=True, help="9-bit mode (JMP2 closed), by mark and space parity.")
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
@verbose
@click.pass_context
def ss_group(context: click.Context, /, **_given: object) -> None:
    """Send a message to an SS-MST67 module as master, and wait for its acknowledge.

    LINK is the path of a serial port or of a bus's pty, socket://host:port or rfc2217://host:port.
    Status: 0 acknowledged, 3 NAK, 4 no answer, 5 a damaged answer, or another's.

    \b
    Example: sacbus ss /tmp/steppers 3 move-steps 400 --speed 10000
             sacbus ss /tmp/steppers 3 status
             sacbus ss /tmp/steppers 3 read 0x07 --word
    """
    context.obj = context.params


def _command(name: str) -> Callable[[Callable[..., int]], click.Command]:
    """A message's command: it is given the line, and takes --json as well as the group does."""

    def asked(context: click.Context, _param: click.Parameter, given: bool) -> None:
        context.obj["as_json"] |= given

    def made(command: Callable[..., int]) -> click.Command:
        as_json = click.option(
            "--json", is_flag=True, expose_value=False, callback=asked, help="Print as JSON."
        )
        return ss_group.command(name)(as_json(click.pass_obj(command)))

    return made


@_command("move-at-speed")
@click.argument("speed", type=_WORD)
@_rate
@click.option("--ccw", is_flag=True, help="Counterclockwise.")
@click.option("--at-once", is_flag=True, help="Without acceleration.")
def move_at_speed(line: dict[str, Any], speed: int, rate: str, ccw: bool, at_once: bool) -> int:
    """Move until something else is said."""
    from sacbus.wire.superstepper import MoveAtSpeed, Rate

    message = MoveAtSpeed(not ccw, speed, Rate[rate.upper()], not at_once)
    return _exchange(line, message, _acknowledged)


@_command("move-steps")
@click.argument("steps", type=_WORD)
@_speed
@_rate
@click.option("--ccw", is_flag=True, help="Counterclockwise.")
def move_steps(line: dict[str, Any], steps: int, speed: int, rate: str, ccw: bool) -> int:
    """Move a number of (micro)steps."""
    from sacbus.wire.superstepper import MoveSteps, Rate

    message = MoveSteps(not ccw, speed, steps, Rate[rate.upper()])
    return _exchange(line, message, _acknowledged)


@_command("home")
@_speed
@_rate
@click.option("--cw", is_flag=True, help="Clockwise.")
@click.option("--most", type=_WORD, default=0xFFFF, show_default=True, help="Steps at most.")
def home(line: dict[str, Any], speed: int, rate: str, cw: bool, most: int) -> int:
    """Move until the home sensor falls."""
    from sacbus.wire.superstepper import MoveSteps, Rate

    message = MoveSteps(cw, speed, most, Rate[rate.upper()], home=True)
    return _exchange(line, message, _acknowledged)


@_command("change-speed")
@click.argument("speed", type=_WORD)
def change_speed(line: dict[str, Any], speed: int) -> int:
    """Change the speed of the move that runs."""
    from sacbus.wire.superstepper import ChangeSpeed

    return _exchange(line, ChangeSpeed(speed), _acknowledged)


@_command("microsteps")
@click.argument("per_step", type=click.Choice(("1", "2", "4", "8")))
@click.option("--decay", type=click.Choice(_DECAYS), default="fast", show_default=True)
def microsteps(line: dict[str, Any], per_step: str, decay: str) -> int:
    """Set the microsteps per step, and the decay mode."""
    from sacbus.wire.superstepper import Decay, Microsteps

    message = Microsteps(int(per_step).bit_length() - 1, Decay[decay.upper()])
    return _exchange(line, message, _acknowledged)


@_command("stop")
@click.option("--at-once", is_flag=True, help="Without deceleration.")
@click.option("--off", is_flag=True, help="Then take the driver's current off.")
def stop(line: dict[str, Any], at_once: bool, off: bool) -> int:
    """Stop the motor."""
    from sacbus.wire.superstepper import Stop

    return _exchange(line, Stop(not at_once, not off), _acknowledged)


@_command("read")
@click.argument("place", type=_BYTE)
@click.option("--word", is_flag=True, help="The byte there, and the next one, of RAM.")
@click.option("--eeprom", is_flag=True, help="Of the EEPROM.")
def read(line: dict[str, Any], place: int, word: bool, eeprom: bool) -> int:
    """Read a byte or a word at PLACE of the module's memory."""
    from sacbus.wire.superstepper import Read

    if word and eeprom:
        raise click.UsageError("a word is read of RAM alone, leave --word or --eeprom out")
    return _exchange(
        line,
        Read(place, eeprom, word),
        lambda answer: ({}, f"{answer.value} (0x{answer.value:02x})"),
    )


@_command("write")
@click.argument("place", type=_BYTE)
@click.argument("byte", type=_BYTE)
@click.option("--eeprom", is_flag=True, help="Into the EEPROM.")
def write(line: dict[str, Any], place: int, byte: int, eeprom: bool) -> int:
    """Write BYTE to PLACE of the module's memory."""
    from sacbus.wire.superstepper import Write

    return _exchange(line, Write(place, byte, eeprom), _acknowledged)


@_command("status")
def status(line: dict[str, Any]) -> int:
    """Read the status register."""
    from sacbus.wire.superstepper import Read, decode_status

    def show(answer: Answer) -> tuple[dict[str, object], str]:
        fields = decode_status(answer.value)._asdict()
        words = ", ".join(name.replace("_", " ") for name, on in fields.items() if on)
        return {"status": fields}, words or "at rest"

    return _exchange(line, Read(6), show)


@_command("steps-run")
def steps_run(line: dict[str, Any]) -> int:
    """Read how many steps the last move has run, modulo 65536."""
    from sacbus.wire.superstepper import Read

    return _exchange(line, Read(7, word=True), lambda answer: ({}, f"{answer.value} steps"))


def _acknowledged(_answer: Answer) -> tuple[dict[str, object], str]:
    return {}, "ACK"


def _exchange(line: dict[str, Any], message: Message, show: _Shown) -> int:
    """Send it, print what came of it; the exit status."""
    from sacbus.mother.superstepper import BadChecksum, Nak, NoReply
    from sacbus.wire.superstepper import describe

    statuses = {
        Nak: ("nak", NAK_STATUS),
        NoReply: ("no answer", NO_ANSWER_STATUS),
        BadChecksum: ("bad checksum", UNKNOWN_STATUS),
    }
    report: dict[str, object] = {"module": line["address"], "message": describe(message)}
    try:
        answer = asyncio.run(_send(line, message))
    except (Nak, NoReply, BadChecksum) as failure:
        outcome, exit_status = statuses[type(failure)]
        if line["as_json"]:
            report |= {"outcome": outcome, "attempts": failure.attempts}
            click.echo(json.dumps(report))
        click.echo(f"error: {failure}", err=True)
        return exit_status
    fields, words = show(answer)
    if line["as_json"]:
        report |= {
            "outcome": "ack",
            "value": answer.value,
            "framing_error": answer.framing,
            "overrun": answer.overrun,
        }
        click.echo(json.dumps(report | fields))
        return 0
    click.echo(words + (f" (it has seen: {', '.join(answer.flags)})" if answer.flags else ""))
    return 0


async def _send(line: dict[str, Any], message: Message) -> Answer:
    from sacbus.mother.superstepper import SuperStepper

    connected = SuperStepper.connect(line["link"], baud=line["baud"], nine=line["nine"])
    async with connected as master:
        return await master.send(line["address"], message)
