"""``sacbus monitor``: its options."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click

from sacbus.cli.options import WholeNumber

__all__ = ["monitor_command"]


@click.command("monitor")
@click.argument("link", required=False)
@click.option(
    "--baud",
    type=WholeNumber(300, 4_000_000),
    default=None,
    help="Line rate of a link that no sacbus serves. Default: its kind's own.",
)
@click.option("--kind", default=None, help="The kind whose protocol is spoken. Default: sac.")
@click.option(
    "--node",
    "nodes",
    type=WholeNumber(0, 255),
    multiple=True,
    metavar="ADDRESS",
    help="Show only what is from or to this node, or to all. May be repeated.",
)
@click.option("--errors", is_flag=True, help="Show only what went wrong.")
@click.option("--clock", is_flag=True, help="Tell the time of day, not seconds.")
@click.option("--wait", is_flag=True, help="Wait for LINK: at the start, and when it has gone.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line instead of text.")
@click.option(
    "--pcap",
    metavar="FILE",
    help="Write a capture for Wireshark too (pcapng); - : to standard output, in place of text.",
)
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Show senders and bytes too, and the traceback of an error.",
)
def monitor_command(
    nodes: tuple[int, ...],
    pcap: str | None,
    **given: Any,  # noqa: ANN401 (what Wanted takes under the same names)
) -> int:
    """Show what is said on a line, decoded as it happens. Ctrl-C ends it.

    LINK is what a running bus serves: its port, or a URL; then times, senders and collisions are
    exact, and the port is left to the program that uses it. Without LINK, the one bus that runs
    here. Any other LINK is opened and listened to; not a byte is written to it. A summary comes
    last, on standard error. Status: 1 when LINK has gone, 130 after Ctrl-C.

    \b
    Example: sacbus monitor /tmp/sacbus
             sacbus monitor --node 10 --errors
             sacbus monitor socket://127.0.0.1:7000 --json
             sacbus monitor --pcap - | wireshark -k -i -
    """
    from sacbus.monitor.run import monitor
    from sacbus.monitor.wanted import Wanted

    if pcap == "-" and given["as_json"]:
        raise click.UsageError("--pcap - and --json both want standard output, give --pcap a file")
    with _opened(pcap) as descriptor:
        return asyncio.run(monitor(Wanted(nodes=frozenset(nodes), pcap=descriptor, **given)))


@contextmanager
def _opened(pcap: str | None) -> Iterator[int | None]:
    """The descriptor that a capture goes to. Of a named pipe, it waits for the reader."""
    if pcap is None:
        yield None
    elif pcap == "-":
        if sys.stdout.isatty():
            raise click.UsageError(
                "--pcap - writes bytes that are not for a terminal, "
                "pipe them to a program (| wireshark -k -i -) or give --pcap a file"
            )
        yield sys.stdout.fileno()
    else:
        # What the file held is kept until there is something to look at.
        descriptor = os.open(pcap, os.O_WRONLY | os.O_CREAT, 0o666)
        try:
            yield descriptor
        finally:
            os.close(descriptor)
