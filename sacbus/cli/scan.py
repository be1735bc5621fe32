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
    """Ask every address whether a node is there, and print who answers, when it does, and how soon.

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
    found = asyncio.run(_scan(link, nodes, baud, as_they_come=not as_json))
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


async def _scan(
    link: str, nodes: tuple[int, ...], baud: int, *, as_they_come: bool
) -> list[Acknowledged]:
    progress = _Progress(found=as_they_come)
    async with mothers_line(link, baud) as mother:
        try:
            return await mother.scan(nodes, progress=progress.come_to)
        finally:
            progress.clear()


class _Progress:
    """Who has answered so far, a line each, and how far it is, on a terminal's last line.

    ``found``: whether the lines are printed.
    """

    def __init__(self, *, found: bool) -> None:
        self._found = found
        self._told: set[int] = set()
        self._far = sys.stderr.isatty()

    def come_to(self, progress: ScanProgress) -> None:
        """Tell what is new. click flushes each line: whoever reads has it at once."""
        new = [one for one in progress.found if one.node not in self._told]
        if new and self._found:
            self.clear()
            for one in new:
                self._told.add(one.node)
                again = f", asked {one.attempts} times" if one.attempts != 1 else ""
                click.echo(f"node {one.node}: {one.round_trip // 1_000} us{again}")
        if self._far:
            click.echo(
                f"\r\x1b[Ksweep {progress.sweep}: {progress.asked} of {progress.of}, "
                f"{len(progress.found)} found",
                nl=False,
                err=True,
            )

    def clear(self) -> None:
        """Take the last line away."""
        if self._far:
            click.echo("\r\x1b[K", nl=False, err=True)
