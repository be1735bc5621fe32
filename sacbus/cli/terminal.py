"""``sacbus terminal``: its options."""

from __future__ import annotations

import asyncio
import io
import sys

import click

from sacbus.cli.options import NO_ANSWER_STATUS, WrongInput, baud, verbose
from sacbus.cli.spoken import check_spoken

__all__ = ["terminal_command"]


@click.command("terminal")
@click.argument("link")
@baud
@click.option("--raw", is_flag=True, help="Send every key at once, such as + and -.")
@click.option("--no-history", is_flag=True, help="Do not keep what is typed for the next time.")
@verbose
def terminal_command(link: str, baud: int, raw: bool, no_history: bool) -> int:
    """Talk with a SAC as a dumb terminal does. Ctrl-D ends it.

    LINK is a SAC's terminal port: that of a real one, or one of sacbus serve --terminals. Lines can
    be edited, and earlier ones fetched back; they are sent when they are finished. Of a file or a
    pipe each line is typed when the one before has been answered, and the answers are printed.
    Status: 1 when LINK has gone, 4 when nobody answers, 130 after Ctrl-C.

    \b
    Example: sacbus terminal /tmp/sacbus-10
             sacbus terminal /tmp/sacbus-10 < one-shot.txt
    """
    from sacbus.terminal.dialog import NoAnswer

    if sys.stdin is None:  # closed before we were started (`<&-`)
        raise click.UsageError("standard input is closed, give a terminal, a file or a pipe")
    asyncio.run(check_spoken(link))  # what is typed is for SACs
    try:
        if raw:
            _type_keys(link, baud)
        elif sys.stdin.isatty():
            from sacbus.terminal.conversation import converse

            converse(link, baud, history=not no_history)
        else:
            from sacbus.terminal.lines import WrongLine, type_lines

            # What is no ASCII is refused with its place, whatever it would be decoded to.
            lines = io.TextIOWrapper(sys.stdin.buffer, encoding="latin-1")
            try:
                type_lines(link, baud, lines)
            except WrongLine as fault:
                raise WrongInput(str(fault)) from fault
    except NoAnswer as fault:
        click.echo(f"error: {fault}", err=True)
        return NO_ANSWER_STATUS
    return 0


def _type_keys(link: str, baud: int) -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise click.UsageError("--raw is for keys of a terminal, leave it out for a file or a pipe")
    try:
        from sacbus.terminal.keys import type_keys
    except ImportError as fault:
        raise click.UsageError("--raw needs what this system has not, leave it out") from fault
    asyncio.run(type_keys(link, baud))
