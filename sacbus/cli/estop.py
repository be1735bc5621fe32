"""``sacbus estop``: everybody stops, at once."""

from __future__ import annotations

import asyncio
import json

import click

from sacbus.cli.mothers_line import mothers_line
from sacbus.cli.options import baud, verbose

__all__ = ["estop_command"]


@click.command("estop")
@click.argument("link")
@baud
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
@verbose
def estop_command(link: str, baud: int, as_json: bool) -> int:
    """Emergency stop: send S to all nodes, at once and twice more 1 ms apart.

    LINK is the path of a serial port or of a bus's pty, socket://host:port or rfc2217://host:port.
    Nobody answers a broadcast: status 0 says that it was sent. A port that another program has
    cannot be had: stop that program, or have a link of its own for this. It is no substitute for a
    switch that takes the power away. It speaks SAC: a bus here that speaks another protocol is
    refused, on any other line its bytes mean something else to nodes that are no SACs.

    \b
    Example: sacbus estop /tmp/sacbus
             sacbus estop socket://127.0.0.1:7000
    """
    sent = asyncio.run(_estop(link, baud))
    if as_json:
        click.echo(json.dumps({"outcome": "broadcast", "line": "S", "sent": sent}))
    else:
        click.echo(f"S sent {sent} times to all nodes; nobody answers a broadcast")
    return 0


async def _estop(link: str, baud: int) -> int:
    async with mothers_line(link, baud) as mother:
        await mother.estop()
        return mother.statistics[0].sent
