"""The command line: parses, calls the same public API as everyone, prints.

Owns arguments, messages and exit statuses; no rule and no state of a bus. Errors are one line,
``error: WHAT, WHERE, WHAT TO DO``, on standard error; ``-v`` adds the traceback.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeVar

import click
from click.core import ParameterSource

from sacbus import __version__
from sacbus.config.notation import NotationError, addresses, endpoint

if TYPE_CHECKING:
    from sacbus.daemon import Configuration

__all__ = ["main", "run"]

_T = TypeVar("_T")
_F = TypeVar("_F", bound=Callable[..., Any])  # whatever parameters a command has

#: Exit statuses of ``send`` (spec, cli).
NAK_STATUS: Final = 3
NO_ANSWER_STATUS: Final = 4
UNKNOWN_STATUS: Final = 5
INTERRUPTED: Final = 130
USAGE_STATUS: Final = 2


def _verbose(command: _F) -> _F:
    """``-v``, before a command's name or behind it; :func:`run` looks for it itself."""
    option = click.option(
        "-v",
        "--verbose",
        is_flag=True,
        expose_value=False,
        help="Show the traceback of an error.",
    )
    return option(command)


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    invoke_without_command=True,
)
@click.version_option(__version__, prog_name="sacbus", message="%(prog)s %(version)s")
@_verbose
@click.pass_context
def root(context: click.Context) -> int | None:
    """A software RS485 bus of virtual SAC motion controllers.

    \b
    Example: sacbus serve --nodes 10-19 --pty /tmp/sacbus
             sacbus send /tmp/sacbus 10m400
    """
    if context.invoked_subcommand is not None:
        return None
    # Nothing was asked for; whoever wrote this into a script should notice.
    click.echo(context.get_help(), err=True)
    return USAGE_STATUS


def _addresses(_ctx: click.Context, _param: click.Parameter, given: str) -> tuple[int, ...]:
    """``10-19,85``, or ``none``."""
    return () if given == "none" else _noted(addresses, given)


def _endpoints(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> tuple[tuple[str, int], ...]:
    """Each ``[HOST:]PORT``."""
    return tuple(_noted(endpoint, one) for one in given)


def _noted(read: Callable[[str], _T], text: str) -> _T:
    try:
        return read(text)
    except NotationError as fault:
        raise click.BadParameter(str(fault)) from fault


def _setting(
    _ctx: click.Context, _param: click.Parameter, given: Sequence[str]
) -> dict[str, object]:
    """``--set NAME=VALUE``: whole numbers, true/false, or a word."""
    settings: dict[str, object] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise click.BadParameter(f"expected NAME=VALUE, got {text!r}")
        if value.lower() in ("true", "false"):
            settings[name] = value.lower() == "true"
        else:
            settings[name] = int(value) if value.isascii() and value.isdecimal() else value
    return settings


_baud = click.option(
    "--baud",
    type=click.IntRange(300, 4_000_000),
    default=38_400,
    show_default=True,
    help="Line rate.",
)


@root.command()
@click.argument("config", required=False, metavar="[CONFIG.toml]")
@click.option(
    "--nodes",
    callback=_addresses,
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
    callback=_setting,
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
    callback=_endpoints,
    metavar="[HOST:]PORT",
    help="A TCP server, bytes as they are (socket:// in pyserial).",
)
@click.option(
    "--rfc2217",
    multiple=True,
    callback=_endpoints,
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
@click.option("--rts", is_flag=True, help="Adapters switch their direction by RTS.")
@click.option(
    "--baud",
    type=click.IntRange(300, 4_000_000),
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
    type=click.FloatRange(0, min_open=True),
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
@click.option("--no-table", is_flag=True, help="No live table on a terminal.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line instead of text.")
@_verbose
@click.pass_context
def serve(
    context: click.Context,
    /,
    config: str | None,
    precise: bool,
    as_json: bool,
    no_table: bool,
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
    from sacbus.serve import serve as run

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
        return runner.run(run(buses, as_json=as_json, show_table=not no_table))


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


@root.command()
@click.argument("link")
@click.argument("line")
@_baud
@click.option(
    "--accept-duplicates",
    is_flag=True,
    help="After silence send again even what may then run twice.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
@_verbose
def send(link: str, line: str, baud: int, accept_duplicates: bool, as_json: bool) -> int:
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
    statuses = {
        Refused: ("nak", NAK_STATUS),
        NoAnswer: ("no answer", NO_ANSWER_STATUS),
        UnknownOutcome: ("unknown", UNKNOWN_STATUS),
    }
    report: dict[str, object] = {"node": node, "line": command}
    try:
        report |= asyncio.run(_send(link, node, command, baud, accept_duplicates))
    except (Refused, NoAnswer, UnknownOutcome) as failure:
        outcome, status = statuses[type(failure)]
        if as_json:
            report |= {"outcome": outcome, "attempts": failure.attempts, "round_trip_us": None}
            click.echo(json.dumps(report))
        click.echo(f"error: {failure}", err=True)
        return status
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
    from sacbus.mother import Mother

    async with Mother.connect(link, baud=baud) as mother:
        if node == 0:
            await mother.broadcast(command)
            return {"outcome": "broadcast", "attempts": 1, "round_trip_us": None}
        answer = await mother.send(node, command, accept_duplicates=accept_duplicates)
    return {
        "outcome": "ack",
        "attempts": answer.attempts,
        "round_trip_us": answer.round_trip // 1_000,
    }


class _WrongInput(click.ClickException):
    """What stands in a file or a command is wrong, as an argument is; no help tells more of it."""

    exit_code = USAGE_STATUS


@root.command("monitor")
@click.argument("link", required=False)
@click.option(
    "--baud",
    type=click.IntRange(300, 4_000_000),
    default=None,
    help="Line rate of a link that no sacbus serves. Default: its kind's own.",
)
@click.option("--kind", default=None, help="The kind whose protocol is spoken. Default: sac.")
@click.option(
    "--node",
    "nodes",
    type=click.IntRange(0, 255),
    multiple=True,
    metavar="ADDRESS",
    help="Show only what is from or to this node, or to all. May be repeated.",
)
@click.option("--errors", is_flag=True, help="Show only what went wrong.")
@click.option("--clock", is_flag=True, help="Tell the time of day, not seconds.")
@click.option("--wait", is_flag=True, help="Wait for LINK: at the start, and when it has gone.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object a line instead of text.")
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Show senders and bytes too, and the traceback of an error.",
)
def monitor_command(
    nodes: tuple[int, ...],
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
    """
    from sacbus.monitor.run import monitor
    from sacbus.monitor.wanted import Wanted

    return asyncio.run(monitor(Wanted(nodes=frozenset(nodes), **given)))


@root.command("plan")
@click.argument("commands", nargs=-1, metavar="[COMMAND]...")
@click.option("--queue", metavar="FILE.csv", help="Plan a queue file, as the companion writes it.")
@click.option("--list", "one_shots", metavar="FILE", help="Plan a list of commands, a line each.")
@click.option("--table", is_flag=True, help="Steps of linear ramps: the manual's Appendix D.")
@click.option(
    "--loop",
    "loops",
    type=click.IntRange(1, 65_535),
    default=1,
    show_default=True,
    metavar="N",
    help="Run the whole N times.",
)
@click.option(
    "--ustep",
    type=click.IntRange(0, 7),
    default=0,
    show_default=True,
    help="Microsteps, as a power of two.",
)
@click.option(
    "--sprf",
    type=click.IntRange(1, 65_535),
    default=200,
    show_default=True,
    help="Full steps per revolution.",
)
@click.option(
    "--slow",
    type=click.IntRange(1, 255),
    default=10,
    show_default=True,
    help="RPM up to which there are no ramps.",
)
@click.option(
    "--start-rpm",
    type=click.IntRange(0, 2**32 - 1),
    default=0,
    show_default=True,
    help="Velocity kept from a command before; 0: from rest.",
)
@click.option(
    "--gap/--no-gap",
    default=True,
    show_default=True,
    help="Whether a kept velocity is lost when the next command comes too late.",
)
@click.option("--pulses", metavar="FILE", help="Write the time of every pulse: .csv, .npy or -.")
@click.option("--plot", "picture", metavar="FILE", help="Draw it: .png or .svg.")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@_verbose
def plan_command(
    ustep: int,
    sprf: int,
    slow: int,
    **given: Any,  # noqa: ANN401 (what Request takes under the same names)
) -> int:
    """Work out what motion commands do: steps in each state, peak speed, duration, warnings.

    Several commands are planned as a sequence, each as soon as the last has ended. A COMMAND of -
    reads them from standard input, a line each; a FILE of - is standard input or output as well.

    \b
    Example: sacbus plan m200v100a1d1
             sacbus plan m500v100a1d999 m500v100a1d1 --plot motion.svg
             sacbus plan --queue queue.csv --loop 3 --json
    """
    from sacbus.motion import Drive
    from sacbus.plan import PlanError
    from sacbus.plan.command import Request, carry_out

    drive = Drive(sprf=sprf, slow_rpm=slow, ustep=ustep)
    try:
        carry_out(Request(drive=drive, **given))
    except PlanError as fault:
        # Caught here, so that no other command waits for numpy to be imported.
        raise _WrongInput(str(fault)) from fault
    return 0


@root.command()
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@_verbose
def kinds(as_json: bool) -> int:
    """List the kinds of node that are installed, and their settings.

    \b
    Example: sacbus kinds
    """
    from sacbus.node import kinds as installed
    from sacbus.node import setting_list

    found = installed()
    if as_json:
        click.echo(
            json.dumps(
                {
                    "kinds": [
                        {
                            "kind": name,
                            "summary": kind.summary,
                            "protocol": kind.protocol.name,
                            "settings": [
                                {
                                    "name": one.name,
                                    "default": one.default,
                                    "allowed": one.allowed,
                                    "help": one.help,
                                }
                                for one in setting_list(kind.settings)
                            ],
                        }
                        for name, kind in found.items()
                    ]
                }
            )
        )
        return 0
    for name, kind in found.items():
        click.echo(f"{name}: {kind.summary}")
        for one in setting_list(kind.settings):
            default = str(one.default).lower() if isinstance(one.default, bool) else one.default
            click.echo(f"  {one.name} = {default}  ({one.allowed})")
            click.echo(f"      {one.help}")
    return 0


@root.command("check")
@click.argument("configs", nargs=-1, required=True, metavar="CONFIG.toml...")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@_verbose
def check_command(configs: tuple[str, ...], as_json: bool) -> int:
    """Say all that is wrong with configurations, or what they would host. Opens nothing.

    Mistakes are errors, status 2; what is only odd, here and now, is a warning. A CONFIG of - is
    standard input.

    \b
    Example: sacbus check workshop.toml
    """
    from sacbus.check import as_json as in_json
    from sacbus.check import as_text
    from sacbus.config import examine

    found = [examine(config) for config in configs]
    if as_json:
        click.echo(json.dumps(in_json(found)))
    for one in found:
        if not as_json:
            for line in as_text(one):
                click.echo(line)
        for warning in one.warnings:
            click.echo(f"warning: {warning}", err=True)
        for mistake in one.mistakes:
            click.echo(f"error: {mistake}", err=True)
    return USAGE_STATUS if any(one.mistakes for one in found) else 0


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """The entry point ``sacbus``: runs a command and exits with its status."""
    sys.exit(run(sys.argv[1:] if arguments is None else list(arguments)))


def run(arguments: list[str]) -> int:
    """Run a command; its exit status. Errors that users can do something about are one line.

    Any other exception comes out with its traceback: it is a defect of ours, and worth a report.
    When whoever read our output has left (head, less), click ends the process with status 1.
    """
    verbose = bool({"-v", "--verbose"} & set(arguments))
    try:
        status = root.main(arguments, prog_name="sacbus", standalone_mode=False)
    except click.ClickException as fault:
        return _failed(_usage(fault), fault.exit_code, verbose)
    except (click.Abort, KeyboardInterrupt):
        click.echo("interrupted", err=True)
        return INTERRUPTED
    except OSError as fault:
        # Links and the state directory say it in full; the system only what and where.
        named = f", {fault.filename}" if fault.filename is not None else ""
        return _failed(f"{fault.strerror}{named}" if fault.strerror else str(fault), 1, verbose)
    except Exception as fault:
        if (mistakes := _mistakes(fault)) is not None:
            return _failed("\nerror: ".join(mistakes), USAGE_STATUS, verbose)
        if not _is_for_users(fault):
            raise
        return _failed(str(fault.args[0]) if fault.args else str(fault), 1, verbose)
    return status if isinstance(status, int) else 0


def _is_for_users(fault: Exception) -> bool:
    """Whether its text is a line that a user can act on."""
    # Imported only now: a command that goes well does not wait for what it does not need.
    from sacbus.mother import MotherError
    from sacbus.node import KindError, SettingError

    return isinstance(fault, MotherError | KindError | SettingError)


def _mistakes(fault: Exception) -> list[str] | None:
    """The lines about a configuration that is wrong; None for other faults."""
    from sacbus.config.mistake import ConfigError

    return [str(one) for one in fault.mistakes] if isinstance(fault, ConfigError) else None


def _usage(fault: click.ClickException) -> str:
    """Click's message on one line, with what to do at its end."""
    text = " ".join(fault.format_message().split()).rstrip(".")
    context = getattr(fault, "ctx", None)
    if isinstance(fault, click.UsageError) and context is not None:
        return f"{text}, see {context.command_path} --help"
    return text


def _failed(text: str, status: int, verbose: bool) -> int:
    # A terminal that has been closed takes no message; the status still says it.
    with contextlib.suppress(OSError):
        if verbose:
            traceback.print_exc()
        click.echo(f"error: {text}", err=True)
    return status
