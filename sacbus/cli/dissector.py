"""``sacbus dissector``: where Wireshark finds what it needs to read a capture."""

from __future__ import annotations

import click

from sacbus.cli.options import verbose

__all__ = ["dissector_command"]


@click.command("dissector")
@click.argument("kind", default="sac")
@verbose
def dissector_command(kind: str) -> None:
    """Print the path of the dissector, by which Wireshark and tshark read captures.

    KIND is a kind of node, whose protocol it reads; sac when left out.

    A link to it in Wireshark's folder of personal Lua plugins installs it for good; Help, About,
    Folders and `tshark -G folders` tell which that is.

    \b
    Example: sacbus dissector
             tshark -X lua_script:"$(sacbus dissector)" -r capture.pcapng
             ln -s "$(sacbus dissector ss-mst67)" ~/.local/lib/wireshark/plugins/
    """
    from sacbus.node import KindError, find_kind

    found = find_kind(kind)
    if found.protocol.dissector is None:
        raise KindError(
            f"no dissector for {found.protocol.name}, kind {kind}, its package brings none"
        )
    click.echo(found.protocol.dissector)
