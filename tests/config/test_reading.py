"""Reading whole configurations: what comes out, and every mistake by its key and line."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given

from sacbus.config import Setup, examine, read
from sacbus.daemon import Configuration, NodeAt, check
from sacbus.links.places import AdapterAt, PtyAt, Rfc2217At, TcpAt
from sacbus.state import default_directory
from tests.config.cases import cases, mistakes
from tests.config.strategies import configurations, dumped


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "x.toml"


# ---- what is right ------------------------------------------------------------------------------


def test_the_least_configuration_is_a_bus_without_anything(file: Path) -> None:
    file.write_text("[[bus]]\n")
    assert read(file) == Setup((Configuration(nodes=(), state=default_directory()),), precise=False)


def test_everything_that_is_given_arrives(file: Path) -> None:
    file.write_text(
        """
        state = "memory"
        speed = 1
        precise = true
        [[bus]]
        name = "left"
        protocol = "sac"
        baud = 9600
        lanes = 2
        seed = -7
        pace = false
        [[bus.nodes]]
        addresses = "10-11,85"
        ustep = 3
        receiver = "robust"
        [[bus.nodes]]
        address = 4
        kind = "sac"
        [[bus.links]]
        kind = "pty"
        [[bus.links]]
        kind = "pty"
        path = "port"
        echo = true
        latency_us = 0
        [[bus.links]]
        kind = "tcp"
        listen = 7000
        latency_us = 5
        [[bus.links]]
        kind = "rfc2217"
        listen = "[::1]:7001"
        [[bus.links]]
        kind = "tcp"
        [[bus]]
        name = "right"
        state = false
        links = [{kind = "adapter", device = "/dev/ttyX", rts = true, echo = true},
                 {kind = "adapter", device = "COM5"}]
        """
    )
    settings = {"receiver": "robust", "ustep": 3}
    here = file.parent
    left, right = read(file).buses
    assert left == Configuration(
        name="left",
        nodes=(*(NodeAt(address, "sac", settings) for address in (10, 11, 85)), NodeAt(4)),
        baud=9_600,
        lanes=2,
        seed=-7,
        links=(
            PtyAt(),
            PtyAt(here / "port", echo=True, latency_us=0),
            TcpAt("127.0.0.1", 7000, latency_us=5),
            Rfc2217At("::1", 7001),
            TcpAt(),
        ),
        state=here / "memory",
        pace=False,
    )
    assert right == Configuration(
        name="right",
        nodes=(),
        links=(AdapterAt("/dev/ttyX", rts=True, echo=True), AdapterAt("COM5")),
        state=None,
    )
    assert read(file).precise is True


def test_paths_are_relative_to_the_file_and_home_is_known(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/somebody")
    file.write_text(
        """
        state = "~/memory"
        bus = [{links = [{kind = "pty", path = "../a"}, {kind = "pty", path = "~/b"},
                         {kind = "adapter", device = "dev/x"}, {kind = "pty", path = "~x~/c"}]}]
        """
    )
    (bus,) = read(file).buses
    here = file.parent
    assert bus.state == Path("/home/somebody/memory")
    assert bus.links == (
        PtyAt(here / "../a"),
        PtyAt(Path("/home/somebody/b")),
        AdapterAt(str(here / "dev/x")),
        PtyAt(here / "~x~/c"),
    )


def test_speed_is_a_number_of_seconds_whole_or_not(file: Path) -> None:
    for text, speed in (("10", 10.0), ("0.5", 0.5), ("1e3", 1000.0)):
        file.write_text(f"speed = {text}\n[[bus]]")
        (bus,) = read(file).buses
        assert (bus.speed, type(bus.speed)) == (speed, float)


# ---- mistakes -----------------------------------------------------------------------------------

CASES = cases("mistakes.txt")

NODE = "[[bus]]\n[[bus.nodes]]\n"


@pytest.mark.parametrize(("text", "told"), CASES, ids=[" ".join(told)[:60] for _, told in CASES])
def test_mistakes_are_told_once_with_key_line_and_what_to_do(
    file: Path, text: str, told: list[str]
) -> None:
    assert mistakes(file, text) == told


def test_a_number_that_is_too_long_to_be_shown_is_not(file: Path) -> None:
    (told,) = mistakes(file, f"{NODE}address = 10\nustep = 0x{'f' * 5_000}")
    assert "expected a whole number from 0 to 7, got a number of more than 64 bits" in told


def test_a_mistake_has_its_parts_as_values(file: Path) -> None:
    file.write_text("[[bus]]\nbaud = 1")
    (mistake,) = examine(file).mistakes
    assert (mistake.file, mistake.line, mistake.column) == (str(file), 2, None)
    assert mistake.key == "bus 'bus': baud"
    assert mistake.what == "expected a whole number from 300 to 4000000, got 1"


# ---- kinds of others ----------------------------------------------------------------------------


@pytest.mark.usefixtures("kiln")
def test_a_third_partys_kind_brings_its_settings_and_its_protocol(file: Path) -> None:
    file.write_text(NODE + "address = 10\nkind = 'kiln'\nfuel = 'wood'\nlogs = 3")
    (bus,) = read(file).buses
    assert bus.nodes == (NodeAt(10, "kiln", {"fuel": "wood", "logs": 3}),)
    assert check(bus).name == "smoke"
    file.write_text("[[bus]]\nprotocol = 'smoke'")
    (bus,) = read(file).buses
    assert check(bus).name == "smoke"


@pytest.mark.usefixtures("kiln")
def test_all_that_a_third_partys_kind_does_not_take_is_told(file: Path) -> None:
    # That logs need wood would be told on top of it if coal had been taken for the default.
    told = mistakes(file, NODE + "address = 10\nkind = 'kiln'\nfuel = 'coal'\nlogs = 3\nlog = 1")
    assert told == [
        (
            "bus 'bus': nodes[0].fuel: expected gas or wood, got 'coal', line 5, "
            "correct it, or leave it out for 'gas'"
        ),
        (
            "bus 'bus': nodes[0].log: unknown key, line 7, remove it; known here: address, "
            "addresses, kind, fuel, logs"
        ),
    ]


@pytest.mark.usefixtures("kiln")
def test_what_a_kind_has_against_settings_together_is_told(file: Path) -> None:
    assert mistakes(file, NODE + "address = 10\nkind = 'kiln'\nlogs = 1") == [
        "bus 'bus': nodes[0]: logs: expected 0 with fuel = gas, line 2, correct it"
    ]


@pytest.mark.usefixtures("kiln")
def test_a_kind_that_cannot_be_loaded_is_told_and_the_others_still_work(file: Path) -> None:
    (told,) = mistakes(
        file,
        "[[bus]]\nprotocol = 'smoke'\n[[bus.nodes]]\naddress = 10\nkind = 'broken'\n"
        "[[bus.nodes]]\naddress = 11\nkind = 'kiln'",
    )
    assert told == (
        "bus 'bus': nodes[0].kind: node kind 'broken' (nowhere:KIND) cannot be loaded: "
        "ModuleNotFoundError(\"No module named 'nowhere'\"), line 5, mend or uninstall its package"
    )


# ---- anything at all ----------------------------------------------------------------------------


@pytest.mark.slow
@given(configurations())
def test_any_nonsense_is_mistakes_of_one_line_or_what_the_daemon_takes(
    tmp_path_factory: pytest.TempPathFactory, content: dict[str, object]
) -> None:
    file = tmp_path_factory.getbasetemp() / "nonsense.toml"
    lines = [f"{dumped({key: value})[1:-1]}\n" for key, value in content.items()]
    file.write_text("".join(lines))
    examined = examine(file)
    for one in (*examined.mistakes, *examined.warnings):
        assert len(str(one).splitlines()) == 1
        assert one.line is None or 1 <= one.line <= len(lines)
    assert (examined.setup is None) == bool(examined.mistakes)
    if examined.setup is not None:
        for bus in examined.setup.buses:
            check(bus)
