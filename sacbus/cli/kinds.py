"""``sacbus kinds``: the kinds of node that are installed, in words and as JSON."""

from __future__ import annotations

import json

import click

from sacbus.cli.options import verbose

__all__ = ["kinds_command"]


@click.command("kinds")
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@verbose
def kinds_command(as_json: bool) -> int:
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
