"""``sacbus eeprom``: what lies in a node's EEPROM file, in words and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sacbus.cli.options import help_unless_asked, verbose

if TYPE_CHECKING:
    from sacbus.node import MemoryTable, MemoryWords

__all__ = ["eeprom_group"]


@click.group("eeprom", invoke_without_command=True)
@verbose
@click.pass_context
def eeprom_group(context: click.Context) -> int | None:
    """Look into the EEPROM files of nodes.

    \b
    Example: sacbus eeprom show ~/.local/state/sacbus/bus/10
    """
    return help_unless_asked(context)


@eeprom_group.command("show")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print as JSON.")
@verbose
def show_command(file: Path, as_json: bool) -> int:
    """Show what a node remembers: every parameter with its meaning, pin map, saved queue.

    FILE is ADDRESS in the directory of a bus. What differs from the factory's value is marked: that
    is the manual's, and for d_id the configured address. A factory restore brings the values of the
    node's configuration, which may be others.

    \b
    Example: sacbus eeprom show ~/.local/state/sacbus/bus/10
    """
    from sacbus.node import find_kind
    from sacbus.state import read_memory

    stored = read_memory(file)
    kind = find_kind(stored.kind)
    # The file is named for the configured address, unless somebody has moved it.
    address = int(file.name) if file.name.isascii() and file.name.isdecimal() else None
    if address is not None and address > 255:
        address = None
    words = kind.memory_words(stored.memory, address)
    if as_json:
        click.echo(
            json.dumps(
                {
                    "file": str(file),
                    "kind": stored.kind,
                    "node": address,
                    "memory": stored.memory,
                    **asdict(words),
                }
            )
        )
        return 0
    who = "" if address is None else f", configured at {address}"
    click.echo(f"{file}: a {stored.kind} node{who}")
    for line in _lines(words):
        click.echo(line)
    return 0


def _lines(words: MemoryWords) -> Iterator[str]:
    rows = [
        (
            one.key,
            one.name,
            one.value,
            one.meaning + ("" if one.factory is None else f"  (factory: {one.factory})"),
        )
        for one in words.values
    ]
    yield from _aligned(rows)
    for table in words.tables:
        yield from _table(table)
    yield from words.remarks


def _table(table: MemoryTable) -> Iterator[str]:
    yield ""
    yield f"{table.title}:"
    yield from _aligned([table.columns, *table.rows])


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """The cells below each other, two spaces between."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield f"  {'  '.join(cells)}".rstrip()
