"""``sacbus send``: one command as mother, and what came of it."""

from __future__ import annotations

import asyncio
import json

import click

from sacbus.cli.mothers_line import mothers_line
from sacbus.cli.options import baud, verbose
from sacbus.cli.outcomes import told

__all__ = ["send_command"]


@click.command("send")
@click.argument("link")
@click.argument("line")
@baud
@click.option(
    "--accept-duplicates",
    is_flag=True,
    help="After silence send again even what may then run twice.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
@verbose
def send_command(link: str, line: str, baud: int, accept_duplicates: bool, as_json: bool) -> int:
    """Send LINE as mother and wait for the ACK. LINE begins with an address: 85m3000a2d1.

    LINK is the path of a serial port or of a bus's pty, socket://host:port or rfc2217://host:port.
    Address 0 is everybody; nobody answers it. Status: 0 ACK, 3 NAK, 4 no answer, 5 unknown outcome
    (silence after a command that must not run twice).

    \b
    Example: sacbus send /tmp/sacbus 10m400v120
             sacbus send socket://127.0.0.1:7000 0S
    """
    from sacbus.mother import NoAnswer, Refused, UnknownOutcome, addressed_line

    node, command = addressed_line(line)
    words = {Refused: "nak", NoAnswer: "no answer", UnknownOutcome: "unknown"}
    report: dict[str, object] = {"node": node, "line": command}
    try:
        report |= asyncio.run(_send(link, node, command, baud, accept_duplicates))
    except (Refused, NoAnswer, UnknownOutcome) as failure:
        if as_json:
            outcome = words[type(failure)]
            report |= {"outcome": outcome, "attempts": failure.attempts, "round_trip_us": None}
            click.echo(json.dumps(report))
        return told(failure)
    if as_json:
        click.echo(json.dumps(report))
    elif report["outcome"] == "ack":
        attempts = report["attempts"]
        again = f" after {attempts} attempts" if attempts != 1 else ""
        click.echo(f"ACK from node {node}{again}, {report['round_trip_us']} us")
    else:
        click.echo("sent to all nodes; nobody answers a broadcast")
    return 0


async def _send(
    link: str, node: int, command: str, baud: int, accept_duplicates: bool
) -> dict[str, object]:
    async with mothers_line(link, baud) as mother:
        if node == 0:
            await mother.broadcast(command)
            return {"outcome": "broadcast", "attempts": 1, "round_trip_us": None}
        answer = await mother.send(node, command, accept_duplicates=accept_duplicates)
    return {
        "outcome": "ack",
        "attempts": answer.attempts,
        "round_trip_us": answer.round_trip // 1_000,
    }
