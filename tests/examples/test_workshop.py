"""The example configuration is right, is complete, and shows what is true."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sacbus.config import examine, read
from sacbus.config.keys import BUS, LINKS, NODE, TOP, setting_keys
from sacbus.config.lines import Path as Keys
from sacbus.config.lines import locate
from sacbus.daemon import check
from sacbus.links.places import AdapterAt, PtyAt, Rfc2217At, TcpAt
from sacbus.node import find_kind

EXAMPLE = Path(__file__).parents[2] / "examples" / "workshop.toml"
TEXT = EXAMPLE.read_text()

#: A key, or a table, that is shown behind a "#".
SHOWN = re.compile(r"^# (\w+ = .*|\[\[.*\]\])$", re.MULTILINE)

#: All of the example: what it shows is said.
FULL = SHOWN.sub(r"\1", TEXT)


def tables(content: dict[str, Any], *names: str) -> list[dict[str, Any]]:
    """All tables under these names, from the top. ``Any``: TOML's values."""
    found = [content]
    for name in names:
        found = [one for table in found for one in table.get(name, [])]
    return found


def given(found: list[dict[str, Any]]) -> set[str]:
    return {key for table in found for key in table}


def test_it_is_right_and_hosts_two_benches() -> None:
    left, right = read(EXAMPLE).buses
    assert [node.address for node in left.every_node] == [10, 11, 12, 85]
    assert [node.address for node in right.every_node] == [20, 21, 22, 23, 40]
    assert [type(link) for link in (*left.links, *right.links)] == [PtyAt, TcpAt, Rfc2217At]
    assert left.state is right.state is None


def test_all_that_it_shows_is_accepted(tmp_path: Path) -> None:
    file = tmp_path / "full.toml"
    file.write_text(FULL)
    assert [type(link) for bus in read(file).buses for link in bus.links] == [
        *(PtyAt, TcpAt, Rfc2217At, AdapterAt)
    ]


def test_it_shows_every_key_that_there_is() -> None:
    content = tomllib.loads(FULL)
    settings = setting_keys(find_kind("sac").settings)
    assert given([content]) == {key.name for key in TOP}
    assert given(tables(content, "bus")) == {key.name for key in BUS}
    assert given(tables(content, "bus", "nodes")) == {key.name for key in (*NODE, *settings)}
    for kind, keys in LINKS.items():
        links = [one for one in tables(content, "bus", "links") if one["kind"] == kind]
        assert given(links) == {key.name for key in keys}


def test_what_it_shows_behind_a_mark_holds_anyway(tmp_path: Path) -> None:
    file = tmp_path / "shown.toml"
    file.write_text(FULL.split("# ---- a real line")[0])
    assert read(file).precise == read(EXAMPLE).precise
    for one, other in zip(read(EXAMPLE).buses, read(file).buses, strict=True):
        protocol = check(one)
        assert (other.baud or protocol.rate.baud) == protocol.rate.baud
        assert (other.lanes or protocol.lanes) == protocol.lanes
        assert replace(other, nodes=one.nodes, baud=one.baud, lanes=one.lanes) == one
        for node, same in zip(one.every_node, other.every_node, strict=True):
            model = find_kind(node.kind).settings
            assert model(**node.settings) == model(**same.settings)


LINES = locate(FULL)
KEYS = [
    path for path in LINES if isinstance(path[-1], str) and "=" in FULL.split("\n")[LINES[path] - 1]
]


def corrupted(
    path: Keys, tmp_path: Path, pattern: str, instead: str
) -> list[tuple[int | None, str]]:
    """Lines and keys of the mistakes after the line of a key has been changed."""
    lines = FULL.split("\n")
    number = LINES[path] - 1
    changed, count = re.subn(pattern, instead, lines[number], count=1)
    assert count == 1
    lines[number] = changed
    file = tmp_path / "corrupted.toml"
    file.write_text("\n".join(lines))
    return [(one.line, one.key) for one in examine(file).mistakes]


@pytest.mark.parametrize("path", KEYS, ids=str)
def test_a_key_that_is_misspelled_is_named(tmp_path: Path, path: Keys) -> None:
    name = str(path[-1])
    for other in (f"x{name}", f"{name}_", name[:-1] + "\u00e9"):
        quoted = f'"{other}"' if not other.isascii() else other
        found = corrupted(path, tmp_path, r"^\w+", quoted)
        assert [line for line, _ in found] == [LINES[path]]
        assert re.search(rf"(^|[ .])'?{other}'?$", found[0][1])


@pytest.mark.parametrize("path", KEYS, ids=str)
@pytest.mark.parametrize("value", ["1979-05-27", "[[]]", "{ a = 1 }", "nan", "'  '"])
def test_a_value_that_cannot_be_is_named_by_its_key(tmp_path: Path, path: Keys, value: str) -> None:
    ((line, key),) = corrupted(path, tmp_path, r"= [^#]*", f"= {value} ")
    assert line == LINES[path]
    # A bus whose name is wrong is told by its number.
    assert re.search(rf"(^|[ .]){path[-1]}$", key)
