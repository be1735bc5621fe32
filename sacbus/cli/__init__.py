"""The command line: parses, calls the same public API as everyone, prints.

Owns arguments, messages and exit statuses, a file a command; no rule and no state of a bus. Errors
are one line, ``error: WHAT, WHERE, WHAT TO DO``, on standard error; ``-v`` adds the traceback.
"""

from __future__ import annotations

import contextlib
import os
import sys
import traceback

import click

from sacbus import __version__
from sacbus.cli.calibrate import calibrate_command
from sacbus.cli.check import check_command
from sacbus.cli.diff import diff_command
from sacbus.cli.dissector import dissector_command
from sacbus.cli.eeprom import eeprom_group
from sacbus.cli.estop import estop_command
from sacbus.cli.export import export_command
from sacbus.cli.gcode import gcode_command
from sacbus.cli.kinds import kinds_command
from sacbus.cli.monitor import monitor_command
from sacbus.cli.options import INTERRUPTED, USAGE_STATUS, help_unless_asked, shortened, verbose
from sacbus.cli.plan import plan_command
from sacbus.cli.queue import queue_group
from sacbus.cli.run import run_command
from sacbus.cli.scan import scan_command
from sacbus.cli.send import send_command
from sacbus.cli.serve import serve_command
from sacbus.cli.simad import simad_group
from sacbus.cli.ss import ss_group
from sacbus.cli.terminal import terminal_command
from sacbus.fresh import NO_ROOM

__all__ = ["root", "run"]


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    invoke_without_command=True,
)
@click.version_option(__version__, prog_name="sacbus", message="%(prog)s %(version)s")
@verbose
@click.pass_context
def root(context: click.Context) -> int | None:
    """A software RS485 bus of virtual SAC motion controllers.

    \b
    Example: sacbus serve --nodes 10-19 --pty /tmp/sacbus
             sacbus send /tmp/sacbus 10m400
    """
    return help_unless_asked(context)


for command in (
    serve_command,
    send_command,
    ss_group,
    estop_command,
    scan_command,
    terminal_command,
    monitor_command,
    run_command,
    plan_command,
    gcode_command,
    queue_group,
    calibrate_command,
    export_command,
    diff_command,
    simad_group,
    check_command,
    eeprom_group,
    kinds_command,
    dissector_command,
):
    root.add_command(command)


def run(arguments: list[str]) -> int:
    """Run a command; its exit status. Errors that users can do something about are one line.

    Any other exception comes out with its traceback: it is a defect of ours, and worth a report.
    When whoever read our output has left (head, less), click ends the process with status 1.
    """
    verbose = bool({"-v", "--verbose"} & set(arguments))
    if sys.stdout is None:  # closed before we were started (`>&-`): nobody is to read it
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 (for good)
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
        if fault.errno in NO_ROOM and not named:
            named = ", what is printed is not whole, make room there"
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
    """The lines about a file of the user's that is wrong; None for other faults."""
    from sacbus.config.mistake import ConfigError

    recording = sys.modules.get("sacbus.trace.reading")  # who has met none needs no numpy
    if recording is not None and isinstance(fault, recording.RecordingError):
        return [str(fault)]
    return [str(one) for one in fault.mistakes] if isinstance(fault, ConfigError) else None


def _usage(fault: click.ClickException) -> str:
    """Click's message on one line, with what to do at its end."""
    text = " ".join(fault.format_message().split()).rstrip(".")
    context = getattr(fault, "ctx", None)
    advised = ", see sacbus " in text
    if isinstance(fault, click.UsageError) and context is not None and not advised:
        return f"{text}, see {context.command_path} --help"
    return text


def _failed(text: str, status: int, verbose: bool) -> int:
    # A terminal that has been closed takes no message; the status still says it.
    with contextlib.suppress(OSError):
        if verbose:
            traceback.print_exc()
        click.echo(shortened(f"error: {text}"), err=True)
    return status
