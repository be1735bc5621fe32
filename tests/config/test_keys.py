"""The vocabulary: as the pages say, as the daemon takes it, and complete."""

from __future__ import annotations

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import click
import pytest

from sacbus.cli import root
from sacbus.config.keys import ANY_LINK, BUS, LINKS, NODE, TOP, Key, shown
from sacbus.daemon import Configuration, NodeAt, check
from sacbus.links.places import AdapterAt, PtyAt, Rfc2217At, TcpAt
from sacbus.node import SettingError, find_kind, setting_list
from tests.config.reference import TABLES, rows

PAGE = Path(__file__).parents[2] / "docs" / "configuration.md"


@pytest.mark.parametrize("heading", TABLES)
def test_the_page_has_the_table_that_the_code_has(heading: str) -> None:
    section = PAGE.read_text().split(f"\n## {heading}\n")[1].split("\n## ")[0]
    assert [line for line in section.splitlines() if line.startswith("|")] == rows(TABLES[heading])


def test_the_page_has_no_other_table() -> None:
    found = [line for line in PAGE.read_text().splitlines() if line.startswith("|")]
    assert len(found) == sum(len(rows(keys)) for keys in TABLES.values())


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        ("pty", PtyAt()),
        ("tcp", TcpAt()),
        ("rfc2217", Rfc2217At()),
        ("adapter", AdapterAt("/dev/ttyUSB0")),
    ],
)
def test_a_link_has_a_key_for_every_field_and_its_default(
    kind: str, place: PtyAt | TcpAt | Rfc2217At | AdapterAt
) -> None:
    keys = {key.name: key.default for key in LINKS[kind]}
    assert keys.pop("kind") is None
    fields = dataclasses.asdict(place)
    if isinstance(place, AdapterAt):
        assert fields.pop("path") == "/dev/ttyUSB0"
        assert keys.pop("device") is None
    if isinstance(place, TcpAt | Rfc2217At):
        assert keys.pop("listen") == f"{fields.pop('host')}:{fields.pop('port')}"
    assert keys == fields


def test_every_kind_of_link_can_be_chosen() -> None:
    for keys in LINKS.values():
        (kind,) = [key for key in keys if key.name == "kind"]
        assert kind.choices == tuple(LINKS)
        assert all(kind.fits(name) for name in LINKS)
    assert {key.name for key in ANY_LINK} == {key.name for keys in LINKS.values() for key in keys}
    assert [key.name for key in ANY_LINK if key.required] == ["kind"]


def test_a_bus_has_a_key_for_every_field_and_its_default() -> None:
    keys = {key.name: key for key in (*TOP, *BUS)}
    fields = {one.name: one for one in dataclasses.fields(Configuration)}
    # What a configuration of Python says of all nodes, a file says of each.
    assert {*fields} - {"kind", "settings"} <= {*keys}
    for name in ("name", "baud", "lanes", "seed", "speed", "pace"):
        assert keys[name].default == fields[name].default
    (kind,) = [key for key in NODE if key.name == "kind"]
    assert kind.default == fields["kind"].default == NodeAt(10).kind


def test_no_setting_of_a_sac_is_called_like_a_key_of_a_node() -> None:
    settings = {one.name for one in setting_list(find_kind("sac").settings)}
    assert not settings & {key.name for key in NODE}


@pytest.mark.parametrize(
    "key",
    [
        pytest.param(key, id=f"{heading}: {key.name}")
        for heading, keys in TABLES.items()
        for key in keys
        if key.default is not None
    ],
)
def test_every_default_fits_and_reads_back_from_toml(key: Key) -> None:
    assert key.fits(key.default)
    assert tomllib.loads(f"x = {shown(key.default)}") == {"x": key.default}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("baud", value) for value in (299, 300, 4_000_000, 4_000_001)],
        *[("lanes", value) for value in (0, 1, 2, 3)],
        *[("speed", value) for value in (-1.0, 0.0, 0.5, 1.0, 1000.0, math.inf, math.nan)],
    ],
)
def test_a_file_takes_what_the_daemon_takes(name: str, value: float) -> None:
    (key,) = [key for key in (*TOP, *BUS) if key.name == name]
    given: dict[str, Any] = {name: value}
    try:
        check(Configuration(**given))
    except SettingError:
        taken = False
    else:
        taken = True
    assert key.fits(value) is taken


@pytest.mark.parametrize(("kind", "addresses"), [("sac", range(4, 256)), ("ss-mst67", range(32))])
def test_the_daemon_takes_the_addresses_that_a_kinds_protocol_has(
    kind: str, addresses: range
) -> None:
    (key,) = [key for key in NODE if key.name == "address"]
    for address in range(-1, 257):
        try:
            check(Configuration(nodes=(address,), kind=kind))
        except SettingError:
            taken = False
        else:
            taken = True
        assert taken is (address in addresses)
        assert key.fits(address) or not taken


def test_the_command_line_takes_the_same_rates() -> None:
    (baud,) = [one for one in root.commands["serve"].params if one.name == "baud"]
    (key,) = [key for key in BUS if key.name == "baud"]
    assert isinstance(baud.type, click.IntRange)
    assert key.allowed == f"a whole number from {baud.type.min} to {baud.type.max}"


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("state", [False, "x", "~/x", "/x"], [True, "", " ", "a\0b", "a\nb", 1, []]),
        ("precise", [True, False], [0, 1, "true"]),
        ("speed", [1, 0.000_001, 1_000_000], [True, "1", 2**70, -1]),
        ("name", ["left", "Bank 3", "ä", "x" * 100], ["", ".", "..", ".x", "-x", "x.", "a/b"]),
        (
            "name",
            ["a-b", "a.b", "a_b"],
            ["a\\b", "a:b", " a", "a ", "a\n", "x" * 101, "a\u0308", 1],
        ),
        ("seed", [0, -1, 2**63 - 1, -(2**63)], [2**63, 1.0, True, "1"]),
    ],
)
def test_keys_take_what_they_say(name: str, right: list[object], wrong: list[object]) -> None:
    (key,) = [key for key in (*TOP, *BUS[:-3]) if key.name == name]
    assert [value for value in right if not key.fits(value)] == []
    assert [value for value in wrong if key.fits(value)] == []


@pytest.mark.parametrize(
    ("name", "right", "wrong"),
    [
        ("path", ["x", "/x y"], ["", "\t", "a\0", False, 1]),
        ("device", ["/dev/ttyUSB0", "COM5"], ["socket://h:1", "", 1]),
        ("listen", ["anything", 0, 65_535], [-1, 65_536, True, 1.5, []]),
        ("latency_us", [0, 1_000_000], [-1, 1_000_001, 1.0, False]),
        ("kind", ["pty"], ["PTY", "", [], 1]),
    ],
)
def test_keys_of_links_take_what_they_say(
    name: str, right: list[object], wrong: list[object]
) -> None:
    (key,) = [key for key in ANY_LINK if key.name == name]
    assert [value for value in right if not key.fits(value)] == []
    assert [value for value in wrong if key.fits(value)] == []


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (1.5, "1.5"),
        ("a\nb", r"'a\nb'"),
        ("\u2028", r"'\u2028'"),
        ("x" * 100, repr("x" * 57) + "…"),
        (-(2**80), "a number of more than 64 bits"),
        (1 << 100_000, "a number of more than 64 bits"),
        ({}, "a table"),
        ([1 << 100_000], "[a number of more than 64 bits]"),
        ([5, 3.5, "a"], "[5, 3.5, 'a']"),
        ([1, 2, 3, 4], "an array"),
        ([[1]], "an array"),
        (tomllib.loads("x = 1979-05-27 07:32:00")["x"], "1979-05-27 07:32:00"),
    ],
    ids=lambda one: str(type(one)),
)
def test_a_value_is_shown_on_one_line_and_not_at_any_length(value: object, text: str) -> None:
    assert shown(value) == text


def test_the_settings_key_of_a_sac_takes_what_the_sac_takes() -> None:
    keys = {key.name: key for key in TABLES["Settings of the kind `sac`"]}
    assert keys["ustep"].fits(7)
    assert not keys["ustep"].fits(8)
    assert keys["receiver"].allowed == "device or robust"
