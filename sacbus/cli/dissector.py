"""``sacbus dissector``: where Wireshark finds what it needs to read a capture."""

from __future__ import annotations

import click

from sacbus.cli.options import verbose

__all__ = ["dissector_command"]


@click.command("dissector")
@verbose
def dissector_command() -> None:
    """Print the path of the dissector, by which Wireshark and tshark read captures.

    A link to it in Wireshark's folder of personal Lua plugins installs it for good; Help, About,
    Folders and `tshark -G folders` tell which that is.

    \b
    Example: sacbus dissector
             tshark -X lua_script:"$(sacbus dissector)" -r capture.pcapng
             ln -s "$(sacbus dissector)" ~/.local/lib/wireshark/plugins/
    """
    from sacbus.trace.capture import DISSECTOR

    click.echo(DISSECTOR)
