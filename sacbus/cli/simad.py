"""``sacbus simad``: steps to the N + 1 lines of SiMAD, and lines to steps."""

from __future__ import annotations

import click

from sacbus.cli.options import help_unless_asked, verbose
from sacbus.cli.simad_decode import decode_command
from sacbus.cli.simad_encode import encode_command

__all__ = ["simad_group"]


@click.group("simad", invoke_without_command=True)
@verbose
@click.pass_context
def simad_group(context: click.Context) -> int | None:
    """N step and direction axes on N + 1 lines: one DIR for all, a step line each.

    \b
    Example: sacbus simad encode two-axes.toml --axes 10,11 --vcd lines.vcd
             sacbus simad decode lines.vcd
    """
    return help_unless_asked(context)


simad_group.add_command(encode_command)
simad_group.add_command(decode_command)
