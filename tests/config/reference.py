"""The tables of docs/configuration.md as the code has them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from nodes.sac import SacSettings
from sacbus.config.keys import BUS, LINKS, NODE, TOP, Key, setting_keys, shown

__all__ = ["TABLES", "rows"]

#: The heading above each table, and its keys.
TABLES: Final[Mapping[str, Iterable[Key]]] = {
    "The whole": TOP,
    "A bus: `[[bus]]`": BUS,
    "Nodes: `[[bus.nodes]]`": NODE,
    "Settings of the kind `sac`": setting_keys(SacSettings),
    **{f'Links: `[[bus.links]]` with `kind = "{kind}"`': keys for kind, keys in LINKS.items()},
}


def rows(keys: Iterable[Key]) -> list[str]:
    """A table of keys in Markdown."""
    found = ["| key | takes | when it is left out | meaning |", "|---|---|---|---|"]
    for key in keys:
        if key.required:
            default = "*is required*"
        elif key.default is None:
            default = key.otherwise or "–"
        else:
            default = f"`{shown(key.default)}`".replace("'", '"')
        found.append(f"| `{key.name}` | {key.allowed} | {default} | {key.help} |")
    return found
