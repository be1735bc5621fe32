"""What the commands have in common: options, how arguments are read, exit statuses."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import click

from sacbus.config.notation import NotationError, addresses, endpoint, quoted

__all__ = [
    "INTERRUPTED",
    "NO_ANSWER_STATUS",
    "STANDARD",
    "USAGE_STATUS",
    "WholeNumber",
    "WrongInput",
    "baud",
    "help_unless_asked",
    "read_addresses",
    "read_endpoints",
    "read_parameters",
    "read_settings",
    "shortened",
    "verbose",
]

_T = TypeVar("_T")
_F = TypeVar("_F", bound=Callable[..., Any])  # whatever parameters a command has

#: Exit statuses (spec, cli): after Ctrl-C, for what was not understood, and when nobody answers.
INTERRUPTED: Final = 130
USAGE_STATUS: Final = 2
NO_ANSWER_STATUS: Final = 4

#: The name of standard input and of standard output, where they stand for a file.
STANDARD: Final = "-"


#: A word of 300 characters or more, and what stands behind it. No message is made of such words,
#: but what was given may be, and the system and click quote that whole.
_ENDLESS: Final = re.compile(r"(\S{57})\S{243,}?([,;:')\"]*)(?!\S)")


class WrongInput(click.ClickException):
    """What stands in a file or a command is wrong, as an argument is; no help tells more of it."""

    exit_code = USAGE_STATUS


class WholeNumber(click.IntRange):
    """click's, whose mistakes are told with what is expected and what came, however it is wrong."""

    def convert(
        self,
        value: Any,  # noqa: ANN401 (text, or a default that is a value already)
        param: click.Parameter | None,
        ctx: click.Context | None,
    ) -> int:
        """click's: from text."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter:
            span = f"of {self.min} or more"
            if self.max is not None:
                span = f"from {self.min} to {self.max}"
            self.fail(f"expected a whole number {span}, got {quoted(str(value))}", param, ctx)


def shortened(message: str) -> str:
    """A message whose words are not of any length, whatever was given."""
    return _ENDLESS.sub(r"\1…\2", message)


def verbose(command: _F) -> _F:
    """``-v``, before a command's name or behind it; :func:`run` looks for it itself."""
    option = click.option(
        "-v",
        "--verbose",
        is_flag=True,
        expose_value=False,
        help="Show the traceback of an error.",
    )
    return option(command)


def help_unless_asked(context: click.Context) -> int | None:
    """What a group does itself: without a command its help, told as an error is; and the status."""
    if context.invoked_subcommand is not None:
        return None
    # Nothing was asked for; whoever wrote this into a script should notice.
    click.echo(context.get_help(), err=True)
    return USAGE_STATUS


baud = click.option(
    "--baud",
    type=WholeNumber(300, 4_000_000),
    default=38_400,
    show_default=True,
    help="Line rate.",
)


def read_addresses(_ctx: click.Context, _param: click.Parameter, given: str) -> tuple[int, ...]:
    """``10-19,85``, or ``none``."""
    return () if given == "none" else _noted(addresses, given)


def read_endpoints(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> tuple[tuple[str, int], ...]:
    """Each ``[HOST:]PORT``."""
    return tuple(_noted(endpoint, one) for one in given)


def _noted(read: Callable[[str], _T], text: str) -> _T:
    try:
        return read(text)
    except NotationError as fault:
        raise click.BadParameter(str(fault)) from fault


def read_parameters(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> dict[str, object]:
    """``--set NAME=VALUE`` of a scenario's parameters."""
    from sacbus.scenario.parameters import given as read

    try:
        return dict(map(read, given))
    except ValueError as wrong:
        raise click.BadParameter(str(wrong)) from wrong


def read_settings(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> dict[str, object]:
    """``--set NAME=VALUE``: whole numbers, true/false, or a word."""
    settings: dict[str, object] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise click.BadParameter(f"expected NAME=VALUE, got {quoted(text)}")
        if value.lower() in ("true", "false"):
            settings[name] = value.lower() == "true"
        else:
            digits = value.removeprefix("-")
            settings[name] = int(value) if digits.isascii() and digits.isdecimal() else value
    return settings
