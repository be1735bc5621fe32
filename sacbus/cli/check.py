"""``sacbus check``: what is wrong with configurations, or what they would host."""

from __future__ import annotations

import json

import click

from sacbus.cli.options import USAGE_STATUS, shortened, verbose

__all__ = ["check_command"]


@click.command("check")
@click.argument("configs", nargs=-1, required=True, metavar="CONFIG.toml...")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@verbose
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
            click.echo(shortened(f"error: {mistake}"), err=True)
    return USAGE_STATUS if any(one.mistakes for one in found) else 0
