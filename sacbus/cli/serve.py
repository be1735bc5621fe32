"""``sacbus serve``: its options, and the bus that they describe."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from sacbus.cli.options import WholeNumber, read_addresses, read_endpoints, read_settings, verbose
from sacbus.cli.recordings import refuse_shared_files

if TYPE_CHECKING:
    from sacbus.daemon import Configuration

__all__ = ["serve_command"]


@click.command("serve")
@click.argument("config", required=False, metavar="[CONFIG.toml]")
@click.option(
    "--nodes",
    callback=read_addresses,
    default="10-12",
    show_default=True,
    metavar="10-19,85",
    help="Addresses of the virtual nodes; none: a line without any.",
)
@click.option("--kind", default="sac", show_default=True, help="Their kind (see sacbus kinds).")
@click.option(
    "--set",
    "settings",
    multiple=True,
    callback=read_settings,
    metavar="NAME=VALUE",
    help="A setting of the kind, such as soft_ops=true. May be repeated.",
)
@click.option(
    "--receiver",
    type=click.Choice(["device", "robust"]),
    default=None,
    help="How nodes read packets: as the firmware does, or as specified.",
)
@click.option(
    "--pty",
    "ptys",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="PATH",
    help="A serial port: a pty behind the stable symlink PATH. Without any way in, one pty.",
)
@click.option(
    "--tcp",
    multiple=True,
    callback=read_endpoints,
    metavar="[HOST:]PORT",
    help="A TCP server, bytes as they are (socket:// in pyserial).",
)
@click.option(
    "--rfc2217",
    multiple=True,
    callback=read_endpoints,
    metavar="[HOST:]PORT",
    help="A TCP server of a serial port with its rate, parity and RTS (rfc2217:// in pyserial).",
)
@click.option(
    "--port",
    "adapters",
    multiple=True,
    metavar="/dev/ttyUSB0",
    help="A real adapter: the nodes on its line and the virtual ones share the bus.",
)
@click.option(
    "--terminals",
    is_flag=True,
    help="A pty for each node's terminal too: PATH-10 beside the first --pty PATH.",
)
@click.option(
    "--watchdog",
    is_flag=True,
    help="Stop nodes that move when the link of a program that has talked goes away.",
)
@click.option("--rts", is_flag=True, help="Adapters switch their direction by RTS.")
@click.option(
    "--baud",
    type=WholeNumber(300, 4_000_000),
    help="Line rate. Default: the protocol's own, 38400 for sac.",
)
@click.option(
    "--state",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Where the nodes' EEPROM is kept. Default: the user's state directory.",
)
@click.option("--ephemeral", is_flag=True, help="Keep the EEPROM in memory only.")
@click.option("--no-pace", is_flag=True, help="Let the line run ahead of the clock.")
@click.option("--precise", is_flag=True, help="Be punctual to some 10 us; costs a processor.")
@click.option(
    "--speed",
    type=click.FloatRange(1e-6, 1e6),
    default=1.0,
    show_default=True,
    help="Bus seconds in a second.",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="For what overlapping bytes turn into."
)
@click.option(
    "--echo",
    is_flag=True,
    help="Give programs their own bytes back, as 2-wire adapters do, and expect that of adapters.",
)
@click.option(
    "--record",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="Record everything from the first instant on (see docs/recordings.md).",
)
@click.option("--no-table", is_flag=True, help="No live table on a terminal.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line instead of text.")
@verbose
@click.pass_context
def serve_command(
    context: click.Context,
    /,
    config: str | None,
    precise: bool,
    as_json: bool,
    no_table: bool,
    record: Path | None,
    **given: Any,  # noqa: ANN401 (what describes one bus, see _one_bus)
) -> int:
    """Host a bus, or all buses of a configuration, and print where to connect. Ctrl-C ends it.

    Servers are open to this machine alone unless a HOST says otherwise: 0.0.0.0:7000.

    \b
    Example: sacbus serve --nodes 10-19,85 --pty /tmp/sacbus --tcp 7000
             sacbus serve --port /dev/ttyUSB0 --nodes 30-39
             sacbus serve workshop.toml
    """
    from sacbus.config import ConfigError, examine
    from sacbus.selector import real_loop
    from sacbus.serve import serve

    refuse_shared_files({"--record": record}, [] if config is None else [config])
    if config is None:
        buses: tuple[Configuration, ...] = (_one_bus(**given),)
    else:
        for parameter in context.command.params:
            name = parameter.name or ""
            if (
                name in given.keys() - {"ephemeral"}
                and context.get_parameter_source(name) is ParameterSource.COMMANDLINE
            ):
                raise click.UsageError(
                    f"{parameter.opts[0]} and a configuration contradict each other, "
                    f"write it into {config}"
                )
        examined = examine(config)
        for warning in examined.warnings:
            click.echo(f"warning: {warning}", err=True)
        if examined.setup is None:
            raise ConfigError(examined.mistakes)
        buses = examined.setup.buses
        precise = precise or examined.setup.precise
        if given["ephemeral"]:
            buses = tuple(replace(bus, state=None) for bus in buses)
    with asyncio.Runner(loop_factory=lambda: real_loop(precise=precise)) as runner:
        return runner.run(serve(buses, as_json=as_json, show_table=not no_table, record=record))


def _one_bus(
    *,
    nodes: tuple[int, ...],
    kind: str,
    settings: dict[str, object],
    receiver: str | None,
    ptys: tuple[Path, ...],
    tcp: tuple[tuple[str, int], ...],
    rfc2217: tuple[tuple[str, int], ...],
    adapters: tuple[str, ...],
    rts: bool,
    echo: bool,
    state: Path | None,
    ephemeral: bool,
    no_pace: bool,
    **given: Any,  # noqa: ANN401 (what Configuration takes under the same names)
) -> Configuration:
    """The bus that options describe."""
    from sacbus.daemon import Configuration
    from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt
    from sacbus.state import default_directory

    if ephemeral and state is not None:
        raise click.UsageError("--state and --ephemeral contradict each other, leave one out")
    if rts and not adapters:
        raise click.UsageError("--rts is about an adapter, name it with --port or leave it out")
    if receiver is not None:
        settings = {**settings, "receiver": receiver}
    links: list[Place] = [
        *(PtyAt(path, echo=echo) for path in ptys),
        *(TcpAt(host, port, echo=echo) for host, port in tcp),
        *(Rfc2217At(host, port, echo=echo) for host, port in rfc2217),
        *(AdapterAt(path, rts=rts, echo=echo) for path in adapters),
    ]
    return Configuration(
        nodes=nodes,
        kind=kind,
        settings=settings,
        links=tuple(links) or (PtyAt(echo=echo),),
        state=None if ephemeral else state or default_directory(),
        pace=not no_pace,
        **given,
    )
