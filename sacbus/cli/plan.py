"""``sacbus plan``: its options, and the drive that they describe."""

from __future__ import annotations

from typing import Any

import click

from sacbus.cli.drive import drive_options
from sacbus.cli.options import WholeNumber, WrongInput, verbose

__all__ = ["plan_command"]


@click.command("plan")
@click.argument("commands", nargs=-1, metavar="[COMMAND]...")
@click.option("--queue", metavar="FILE.csv", help="Plan a queue file, as the companion writes it.")
@click.option(
    "--list",
    "one_shots",
    metavar="FILE",
    help="Plan a list of commands, a line each; # begins a comment.",
)
@click.option("--table", is_flag=True, help="Steps of linear ramps: the manual's Appendix D.")
@click.option(
    "--loop",
    "loops",
    type=WholeNumber(1, 65_535),
    default=1,
    show_default=True,
    metavar="N",
    help="Run the whole N times.",
)
@drive_options
@click.option(
    "--start-rpm",
    type=WholeNumber(0, 2**32 - 1),
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
@click.option(
    "--plot",
    "picture",
    metavar="FILE",
    help="Draw it, .png or .svg; needs: pip install 'sacbus[plot]'.",
)
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@verbose
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
        raise WrongInput(str(fault)) from fault
    return 0
