"""``sacbus scan``: who answers on a line."""

from __future__ import annotations

import asyncio
import json
import sys
from typing import TYPE_CHECKING

import click

from sacbus.cli.mothers_line import mothers_line
from sacbus.cli.options import NO_ANSWER_STATUS, baud, read_addresses, verbose

if TYPE_CHECKING:
    from sacbus.mother import Acknowledged, ScanProgress

__all__ = ["scan_command"]


@click.command("scan")
@click.argument("link")
@click.option(
    "--nodes",
    callback=read_addresses,
    default="4-255",
    show_default=True,
    metavar="10-19,85",
    help="Addresses to ask.",
)
@baud
@click.option("--json", "as_json", is_flag=True, help="Print who answers as JSON.")
@verbose
def scan_command(link: str, nodes: tuple[int, ...], baud: int, as_json: bool) -> int:
    """Ask every address whether a node is there, and print who answers and how soon.

    LINK is the path of a serial port or of a bus's pty, socket://host:port or rfc2217://host:port.
    What is asked does nothing to a node. An absent one is asked three times; all 252 take some
    5 s at 38400 baud. Status: 0 when somebody answers, 4 when nobody does.

    \b
    Example: sacbus scan /tmp/sacbus
             sacbus scan /dev/ttyUSB0 --nodes 10-19,85 --json
    """
    if not nodes:
        raise click.BadParameter("expected addresses like 10-19,85", param_hint="--nodes")
    _check(nodes)
    found = asyncio.run(_scan(link, nodes, baud))
    if as_json:
        rows = [
            {
                "node": one.node,
                "round_trip_us": one.round_trip // 1_000,
                "attempts": one.attempts,
            }
            for one in found
        ]
        click.echo(json.dumps({"asked": len(nodes), "found": rows}))
    for one in found if not as_json else ():
        again = f", asked {one.attempts} times" if one.attempts != 1 else ""
        click.echo(f"node {one.node}: {one.round_trip // 1_000} us{again}")
    if found:
        return 0
    click.echo(
        f"error: nobody answers, {link}, check the wires, the power and the baud rate ({baud})",
        err=True,
    )
    return NO_ANSWER_STATUS


def _check(nodes: tuple[int, ...]) -> None:
    """Refuse, before a line is opened, addresses that mother cannot ask."""
    from sacbus.mother import BadRequest
    from sacbus.mother.request import checked_address

    try:
        for node in nodes:
            checked_address(node)
    except BadRequest as fault:
        raise click.BadParameter(str(fault), param_hint="--nodes") from fault


async def _scan(link: str, nodes: tuple[int, ...], baud: int) -> list[Acknowledged]:
    async with mothers_line(link, baud) as mother:
        if not sys.stderr.isatty():
            return await mother.scan(nodes)
        try:
            return await mother.scan(nodes, progress=_show)
        finally:
            click.echo("\r\x1b[K", nl=False, err=True)


def _show(progress: ScanProgress) -> None:
    """How far it is, on the terminal's last line."""
    click.echo(
        f"\r\x1b[Ksweep {progress.sweep}: {progress.asked} of {progress.of}, "
        f"{len(progress.found)} found",
        nl=False,
        err=True,
    )
