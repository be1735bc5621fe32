"""``sacbus queue``: queue files from and to a SAC."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import click

from sacbus.cli.options import NO_ANSWER_STATUS, baud, help_unless_asked, verbose

__all__ = ["queue_group"]

STANDARD = "-"
"""The name of standard output."""


@click.group("queue", invoke_without_command=True)
@verbose
@click.pass_context
def queue_group(context: click.Context) -> int | None:
    """Queue files, as the companion reads and writes them.

    \b
    Example: sacbus queue get /tmp/sacbus-10 queue.csv
    """
    return help_unless_asked(context)


@queue_group.command("get")
@click.argument("terminal")
@click.argument("file", metavar="FILE.csv")
@baud
@click.option("--json", "as_json", is_flag=True, help="Report as JSON.")
@verbose
def get_command(terminal: str, file: str, baud: int, as_json: bool) -> int:
    """Write the queue of a SAC to a file, in the companion's form of 12 fields.

    TERMINAL is a SAC's terminal port: that of a real one, or one of sacbus serve --terminals. A
    FILE of - is standard output; another appears whole, or not at all. Status: 1 when what answers
    has no queue, 4 when nobody answers.

    \b
    Example: sacbus queue get /tmp/sacbus-10 queue.csv
             sacbus queue get /tmp/sacbus-10 - | sacbus plan --queue -
    """
    from sacbus.fresh import fresh_file
    from sacbus.language.queue_file import write_rows
    from sacbus.terminal.dialog import NoAnswer
    from sacbus.terminal.queue import read_queue

    if as_json and file == STANDARD:
        raise click.UsageError("--json and - both want standard output, name a file")
    try:
        screen = asyncio.run(read_queue(terminal, baud))
    except NoAnswer as fault:
        click.echo(f"error: {fault}", err=True)
        return NO_ANSWER_STATUS
    content = "".join(write_rows(screen.rows)).encode("ascii")
    if file == STANDARD:
        click.echo(content, nl=False)
        return 0
    with fresh_file(Path(file)) as opened:
        opened.write(content)
    if as_json:
        report = {
            "terminal": terminal,
            "file": file,
            "positions": len(screen.rows),
            "next_free": screen.next_free,
        }
        click.echo(json.dumps(report))
    else:
        click.echo(f"{len(screen.rows)} positions written to {file}; Q is at {screen.next_free}")
    return 0
