"""``sacbus queue``: queue files from and to a SAC."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import click

from sacbus.cli.options import (
    NO_ANSWER_STATUS,
    STANDARD,
    WholeNumber,
    baud,
    help_unless_asked,
    verbose,
)
from sacbus.cli.queue_put import put_command
from sacbus.cli.rows import opened_rows, positions

__all__ = ["queue_group"]


@click.group("queue", invoke_without_command=True)
@verbose
@click.pass_context
def queue_group(context: click.Context) -> int | None:
    """Queue files, as the companion reads and writes them.

    \b
    Example: sacbus queue put /tmp/sacbus 10 queue.csv
             sacbus queue get /tmp/sacbus-10 queue.csv
             sacbus queue compare /tmp/sacbus-10 queue.csv
    """
    return help_unless_asked(context)


queue_group.add_command(put_command)


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
        written = positions(len(screen.rows))
        click.echo(f"{written} written to {file}; Q is at {screen.next_free}")
    return 0


@queue_group.command("compare")
@click.argument("terminal")
@click.argument("file", metavar="FILE.csv")
@click.option(
    "--sprf",
    type=WholeNumber(1, 65_535),
    default=200,
    show_default=True,
    help="Full steps per revolution, by which RPM and cycle of the file go together.",
)
@baud
@click.option("--json", "as_json", is_flag=True, help="Report as JSON.")
@verbose
def compare_command(terminal: str, file: str, sprf: int, baud: int, as_json: bool) -> int:
    """Compare the queue of a SAC with a file, position by position; a FILE of - is standard input.

    TERMINAL is a SAC's terminal port, as for sacbus queue get. Positions that the file does not
    name may hold anything. Status: 0 when all are as in the file, 1 when not, with a line for each
    difference, or when what answers has no queue; 4 when nobody answers.

    \b
    Example: sacbus queue compare /tmp/sacbus-10 queue.csv
    """
    from sacbus.language import Defaults
    from sacbus.mother import differences
    from sacbus.terminal.dialog import NoAnswer
    from sacbus.terminal.queue import read_queue

    with opened_rows(file, Defaults(sprf=sprf)) as rows:
        try:
            screen = asyncio.run(read_queue(terminal, baud))
        except NoAnswer as fault:
            click.echo(f"error: {fault}", err=True)
            return NO_ANSWER_STATUS
        found = list(differences(screen.rows, rows))
        count = rows.count
    if as_json:
        told = [
            {"position": one.position, "field": one.field, "got": one.got, "expected": one.wanted}
            for one in found
        ]
        report = {"terminal": terminal, "file": file, "rows": count, "differences": told}
        click.echo(json.dumps(report))
    elif found:
        click.echo("\n".join(map(str, found)))
    else:
        click.echo(f"{positions(count)} {'is' if count == 1 else 'are'} as in {file}")
    return 1 if found else 0
