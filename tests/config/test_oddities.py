"""What is odd here and now: told as a warning, and never a mistake."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from sacbus.config import examine

LINK = "[[bus]]\nnodes = [{{address = 10}}]\n[[bus.links]]\n{}\n"


def warnings(directory: Path, text: str) -> list[str]:
    """What is odd about a text that is right, without the names of the directory and the file."""
    file = directory / "x.toml"
    file.write_text(text)
    examined = examine(file)
    assert examined.mistakes == ()
    told = [str(one).replace(f"{file}:", "line ") for one in examined.warnings]
    return [one.replace(f"{directory}/", "./") for one in told]


def pty(path: str) -> str:
    return LINK.format(f"kind = 'pty'\npath = '{path}'")


def adapter(path: str) -> str:
    return LINK.format(f"kind = 'adapter'\ndevice = '{path}'")


def test_a_path_that_is_free_is_not_odd(tmp_path: Path) -> None:
    assert warnings(tmp_path, pty("port")) == []
    assert warnings(tmp_path, LINK.format("kind = 'pty'")) == []


def test_a_path_that_something_stands_at_is(tmp_path: Path) -> None:
    (tmp_path / "port").symlink_to("/nowhere")
    (tmp_path / "file").touch()
    assert warnings(tmp_path, pty("port")) == [
        "bus 'bus': links[0].path: ./port is there already, line 5, stop what serves it, if it runs"
    ]
    assert warnings(tmp_path, pty("file")) == [
        "bus 'bus': links[0].path: ./file is there already and no link, line 5, choose another path"
    ]


def test_a_path_without_a_directory_is(tmp_path: Path) -> None:
    assert warnings(tmp_path, pty("a/b")) == [
        "bus 'bus': links[0].path: there is no directory ./a now, line 5, create it"
    ]


def test_a_path_that_cannot_be_looked_at_is_left_alone(tmp_path: Path) -> None:
    assert warnings(tmp_path, pty("a" * 5_000)) == []


def test_an_adapter_that_is_not_there_is_odd(tmp_path: Path) -> None:
    assert warnings(tmp_path, adapter("ttyX9")) == []  # a name without a path cannot be looked for
    assert warnings(tmp_path, adapter("./ttyX9")) == [
        "bus 'bus': links[0].device: ./ttyX9 is not there now, line 5, plug it in before serving"
    ]


def test_one_adapter_under_two_names_is(tmp_path: Path) -> None:
    master, slave = os.openpty()
    try:
        device = os.ttyname(slave)
        (tmp_path / "by-id").symlink_to(device)
        text = adapter(device) + "[[bus.links]]\nkind = 'adapter'\ndevice = './by-id'\n"
        assert warnings(tmp_path, adapter(device)) == []
        assert warnings(tmp_path, text) == [
            (
                "bus 'bus': links[1].device: ./by-id is the same device as that of line 5, line 8, "
                "an adapter is on one bus only"
            )
        ]
    finally:
        os.close(slave)
        os.close(master)


@pytest.mark.parametrize("host", ["0.0.0.0", "[::]"])  # noqa: S104
@pytest.mark.parametrize("kind", ["tcp", "rfc2217"])
def test_a_server_that_is_open_to_everybody_is(tmp_path: Path, kind: str, host: str) -> None:
    assert warnings(tmp_path, LINK.format(f"kind = '{kind}'\nlisten = '{host}:7000'")) == [
        (
            "bus 'bus': links[0].listen: everybody who reaches this machine can drive the bus, "
            "line 5, name one of its addresses, if that is not meant"
        )
    ]
    assert warnings(tmp_path, LINK.format(f"kind = '{kind}'\nlisten = '7000'")) == []


def test_a_bus_that_nobody_can_use_is(tmp_path: Path) -> None:
    assert warnings(tmp_path, "[[bus]]\n") == [
        "bus 'bus': no program can reach this bus, line 1, add [[bus.links]]"
    ]
    assert warnings(tmp_path, "[[bus]]\n[[bus.links]]\nkind = 'pty'\n") == [
        "bus 'bus': there is nobody to talk to, line 1, add [[bus.nodes]]"
    ]
    # A server in front of an adapter is a use of its own.
    both = (
        "[[bus]]\n[[bus.links]]\nkind = 'tcp'\n[[bus.links]]\nkind = 'adapter'\ndevice = 'COM5'\n"
    )
    assert warnings(tmp_path, both) == []


def test_terminals_are_a_way_to_nodes_if_there_are_some(tmp_path: Path) -> None:
    text = "[[bus]]\nterminals = true\n"
    assert warnings(tmp_path, text) == [
        "bus 'bus': no program can reach this bus, line 1, add [[bus.links]]"
    ]
    assert warnings(tmp_path, f"{text}nodes = [{{address = 10}}]\n") == []
    assert len(warnings(tmp_path, "[[bus]]\nnodes = [{address = 10}]\n")) == 1


def test_an_echo_that_no_lane_gives_is(tmp_path: Path) -> None:
    text = "[[bus]]\nlanes = 2\nlinks = [{kind = 'pty', echo = true}]\nnodes = []\n"
    assert warnings(tmp_path, text) == [
        "bus 'bus': links[0].echo: there is no echo with lanes = 2, line 3, leave one of them out"
    ]
    assert warnings(tmp_path, text.replace("2", "1")) == []
