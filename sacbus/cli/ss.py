"""``sacbus ss``: one message as the master of a Super Stepper Bus, and what came of it."""

from __future__ import annotations

import asyncio
import json
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, Final

import click

from sacbus.cli.options import NO_ANSWER_STATUS, WholeNumber, verbose
from sacbus.cli.outcomes import NAK_STATUS, UNKNOWN_STATUS
from sacbus.cli.spoken import check_spoken

if TYPE_CHECKING:
    from sacbus.mother.superstepper_words import Command, Word
    from sacbus.wire.superstepper import Answer, Message

__all__ = ["ss_group"]

#: What stands before the words of a command.
_PLACES: Final = ("LINK", "ADDRESS", "COMMAND")

#: What is spoken without --nine and with it, and what to do where the line speaks the other.
_MODES: Final = (
    ("superstepper", {"superstepper-9": "add --nine"}),
    ("superstepper-9", {"superstepper": "leave --nine out"}),
)


class _Typed(click.ParamType["int | str"]):
    """What a word of a command takes."""

    def __init__(self, word: Word) -> None:
        self._word = word
        self.name = "number"

    def convert(
        self,
        value: Any,  # noqa: ANN401 (text, or a default that is a value already)
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> int | str:
        """click's: from text."""
        try:
            return self._word.read(str(value))
        except ValueError as fault:
            self.fail(str(fault), param, ctx)


class _Messages(click.Group):
    """The commands of the table; the group's own options may stand anywhere among their words."""

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """click's: those that move first."""
        from sacbus.mother.superstepper_words import COMMANDS

        return [*COMMANDS]

    def get_command(self, _ctx: click.Context, cmd_name: str) -> click.Command | None:
        """click's: by its name."""
        from sacbus.mother.superstepper_words import COMMANDS

        found = COMMANDS.get(cmd_name)
        return None if found is None else _made(found)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """click's: the one that is named; it knows none of ours by itself, and so none like it."""
        name, known = args[0], self.list_commands(ctx)
        if name not in known and not name.startswith("-"):
            near = get_close_matches(name, known, 1)
            meant = f"did you mean {near[0]!r}?" if near else f"expected {', '.join(known)}"
            ctx.fail(f"No such command {name!r}, {meant}")
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """click's: from words, of which the group's own options are taken first."""
        options = {
            name: option
            for option in self.params
            if isinstance(option, click.Option)
            for name in option.opts
        }
        own: list[str] = []
        others: list[str] = []
        left = iter(args)
        for word in left:
            if word == "--":
                others += [word, *left]
                break
            option = options.get(word.partition("=")[0])
            if option is None:
                early = word.startswith("-") and len(others) < len(_PLACES)
                if early:
                    self._refuse_early(word.partition("=")[0], ctx)
                (own if early else others).append(word)  # of one that is none click says so
                continue
            own.append(word)
            if not option.is_flag and "=" not in word:
                value = next(left, None)
                if value is None:  # or else click would take LINK for it
                    raise click.BadOptionUsage(word, f"Option {word!r} requires an argument", ctx)
                own.append(value)
        return super().parse_args(ctx, own + others)

    def _refuse_early(self, option: str, ctx: click.Context) -> None:
        """A command's option before the command, which alone tells whether it takes a value."""
        from sacbus.mother.superstepper_words import COMMANDS

        if any(option == one.name for command in COMMANDS.values() for one in command.options):
            ctx.fail(
                f"{option} is an option of a command, expected behind its name, as in "
                "3 move-steps 400 --speed 10000"
            )


class _Message(click.Command):
    """A command of the table."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """click's: from words, of which a number below 0 is no option, though no operand either."""
        from sacbus.mother.superstepper_words import is_negative

        ctx.ignore_unknown_options = any(map(is_negative, args))
        return super().parse_args(ctx, args)


@click.group("ss", cls=_Messages)
@click.argument("link")
@click.argument("address", type=WholeNumber(0, 31))
@click.option(
    "--baud",
    type=WholeNumber(300, 4_000_000),
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
    Options may stand behind the command too. What stands behind LINK is a line of a scenario as
    well: send = "3 stop". Status: 0 acknowledged, 3 NAK, 4 no answer, 5 a damaged answer, or
    another's.

    \b
    Example: sacbus ss /tmp/steppers 3 move-steps 400 --speed 10000
             sacbus ss /tmp/steppers 3 status
             sacbus ss /tmp/steppers 3 read 0x07 --word
    """
    context.obj = context.params


def _made(command: Command) -> click.Command:
    """A command of the table, as click has it."""

    def said(line: dict[str, Any], /, **values: object) -> int:
        try:
            message = command.message(**values)
        except ValueError as fault:
            raise click.UsageError(str(fault)) from fault
        return _exchange(line, command, message)

    operands = [click.Argument([word.key], type=_Typed(word)) for word in command.operands]
    options = [_option(word) for word in command.options]
    return _Message(
        command.name,
        callback=click.pass_obj(said),
        params=[*operands, *options],
        help=command.summary,
    )


def _option(word: Word) -> click.Option:
    if word.flag:
        return click.Option([word.name], is_flag=True, help=word.meaning)
    # A default of None would be one, and nothing required. ``Any``: the types that click has.
    default: dict[str, Any] = (
        {} if word.default is None else {"default": word.default, "show_default": True}
    )
    return click.Option(
        [word.name],
        type=_Typed(word),
        metavar=f"[{'|'.join(word.choices)}]" if word.choices else None,
        required=not default,
        help=word.meaning,
        **default,
    )


def _exchange(line: dict[str, Any], command: Command, message: Message) -> int:
    """Send it, print what came of it; the exit status."""
    from sacbus.mother.superstepper import BadChecksum, Nak, NoReply
    from sacbus.mother.superstepper_words import meaning
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
    if line["as_json"]:
        report |= {
            "outcome": "ack",
            "value": answer.value,
            "framing_error": answer.framing,
            "overrun": answer.overrun,
        }
        click.echo(json.dumps({**report, **meaning(command, answer).fields}))
    else:
        click.echo(meaning(command, answer).words)
    return 0


async def _send(line: dict[str, Any], message: Message) -> Answer:
    from sacbus.mother.superstepper import SuperStepper

    speaks, advice = _MODES[line["nine"]]
    await check_spoken(line["link"], speaks, advice)
    connected = SuperStepper.connect(line["link"], baud=line["baud"], nine=line["nine"])
    async with connected as master:
        return await master.send(line["address"], message)
