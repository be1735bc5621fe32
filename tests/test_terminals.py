"""Terminals of nodes from end to end: real processes, real ptys, programs that know only a port."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sacbus import open_bus
from sacbus.cli import run
from sacbus.daemon import Configuration
from sacbus.language.queue_file import read_rows
from sacbus.language.queue_screen import QueueScreen
from sacbus.links import PathTaken
from sacbus.links.places import PtyAt
from tests.serving import PATIENCE, Sacbus, client, served, started, until
from tests.terminal.rig import person

pytestmark = pytest.mark.slow

DATA = Path(__file__).with_name("data")

Captured = pytest.CaptureFixture[str]


def terminal(sacbus: Sacbus, node: int) -> str:
    path = sacbus.ready["terminals"][str(node)]
    assert isinstance(path, str)
    return path


def ask(link: str, line: bytes) -> str:
    """What a program that knows only the port is shown upon a line."""
    with client(link) as port:
        port.write(line + b"\r")
        return port.read_until(b"\r\nSAC>").decode()


# --------------------------------------------------------------------------- serve


def test_a_program_opens_the_terminal_of_a_node_and_reads_its_screens(tmp_path: Path) -> None:
    path = tmp_path / "sacbus"
    with served("--terminals", "--pty", str(path), "--ephemeral") as sacbus:
        expected = {str(node): f"{path}-{node}" for node in (10, 11, 12)}
        assert sacbus.ready["terminals"] == expected
        assert sacbus.ready["buses"][0]["terminals"] == expected
        assert [link["path"] for link in sacbus.ready["links"]] == [str(path)]
        shown = ask(terminal(sacbus, 11), b"m400v120")
        assert shown == "m400v120\r\nSAC>"
        screen = QueueScreen.read(ask(terminal(sacbus, 11), b"q"))
        assert screen is not None
        assert len(screen.rows) == 30
        assert (screen.next_free, screen.rows[0].motion.rpm) == (2, 120)
        other = QueueScreen.read(ask(terminal(sacbus, 10), b"q"))
        assert other is not None
        assert other.next_free == 1
        assert sacbus.send_signal(signal.SIGTERM) == 0
        (bus,) = sacbus.read_event("stopped")["buses"]
        assert [node["position_steps"] > 0 for node in bus["nodes"]] == [False, True, False]
    assert list(tmp_path.iterdir()) == []


def test_nodes_that_boot_have_done_so_before_anybody_is_told_where_their_terminals_are() -> None:
    # So the first key restores nothing: the queue in the EEPROM is kept.
    with served("--terminals", "--ephemeral", "--set", "boot=cold") as sacbus:
        assert ask(terminal(sacbus, 10), b"vd") == "vd\r\n100 RPM  cycle 3000\r\nSAC>"


def test_a_signal_ends_it_while_nodes_still_boot(tmp_path: Path) -> None:
    path = tmp_path / "sacbus"
    options = ("--set", "boot=cold", "--speed", "0.0001", "--pty", str(path))
    with started("serve", "--ephemeral", "--json", *options) as sacbus:
        until(path.is_symlink)
        assert sacbus.send_signal(signal.SIGTERM) == 0
        assert sacbus.errors() == ""
    assert list(tmp_path.iterdir()) == []


def test_without_a_stable_path_terminals_have_their_ptys_names() -> None:
    with served("--terminals", "--ephemeral", "--nodes", "10,85") as sacbus:
        paths = sacbus.ready["terminals"]
        assert set(paths) == {"10", "85"}
        assert all(path.startswith("/dev/pts/") for path in paths.values())
        assert ask(paths["85"], b"vd") == "vd\r\n100 RPM  cycle 3000\r\nSAC>"


def test_the_text_form_says_where_they_are(tmp_path: Path) -> None:
    path = tmp_path / "sacbus"
    with started("serve", "--terminals", "--ephemeral", "--pty", str(path)) as sacbus:
        text = sacbus.read_until(lambda text: "Ctrl-C ends it\n" in text)
        assert text.splitlines()[1:] == [
            f"connect to {path}",
            f"terminals at {path}-ADDRESS (10-12)",
            "Ctrl-C ends it",
        ]
    with started("serve", "--terminals", "--ephemeral", "--nodes", "10,11") as sacbus:
        text = sacbus.read_until(lambda text: "Ctrl-C ends it\n" in text)
        ten, eleven = text.splitlines()[2:4]
        assert ten.startswith("terminal of node 10 at /dev/pts/")
        assert eleven.startswith("terminal of node 11 at /dev/pts/")


def test_of_two_buses_each_has_its_own(tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    file.write_text(
        "state = false\n"
        "[[bus]]\nname = 'a'\nterminals = true\nnodes = [{addresses = '10,11'}]\n"
        "links = [{kind = 'tcp'}, {kind = 'pty', path = 'a'}]\n"
        "[[bus]]\nname = 'b'\nterminals = true\nnodes = [{addresses = '10,12'}]\n"
        "[[bus]]\nname = 'c'\nnodes = [{addresses = '13'}]\nlinks = [{kind = 'pty', path = 'c'}]\n"
    )
    with served(str(file)) as sacbus:
        a, b, c = (bus["terminals"] for bus in sacbus.ready["buses"])
        assert a == {"10": f"{tmp_path}/a-10", "11": f"{tmp_path}/a-11"}
        assert set(b) == {"10", "12"}
        assert c == {}
        assert sacbus.ready["terminals"] == {**b, **a}


def test_what_stands_at_a_terminals_path_is_left_alone_and_nothing_stays_open(
    tmp_path: Path,
) -> None:
    (tmp_path / "sacbus-11").write_text("mine")
    with started(
        "serve", "--terminals", "--ephemeral", "--pty", str(tmp_path / "sacbus")
    ) as sacbus:
        assert sacbus.wait() == 1
        expected = f"error: a file is in the way, {tmp_path}/sacbus-11, remove it or choose another"
        error = sacbus.errors()
    assert error.startswith(expected)
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["sacbus-11"]


# That no descriptor is left is looked after by conftest.py.
def test_a_bus_that_opens_in_vain_leaves_no_path_and_no_descriptor(tmp_path: Path) -> None:
    (tmp_path / "sacbus-12").touch()

    async def scene() -> None:
        configuration = Configuration(links=(PtyAt(tmp_path / "sacbus"),), terminals=True)
        with pytest.raises(PathTaken):
            async with open_bus(configuration):
                pass

    asyncio.run(scene())
    assert [path.name for path in tmp_path.iterdir()] == ["sacbus-12"]


def test_a_node_without_a_terminal_is_told_of_and_served_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("nodes.sac.node.SacNode.terminal", None)

    async def scene() -> list[str]:
        async with open_bus(Configuration(nodes=(10,), terminals=True)) as bus:
            assert bus.terminals == {}
            return [str(one) for one in bus.bus.reports]

    assert asyncio.run(scene()) == [
        "node 10: warning: a node of kind sac has no terminal port, so none is served"
    ]


def test_a_fault_of_a_link_is_not_taken_for_a_node_without_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: object) -> None:
        raise KeyError("a defect of a link")

    monkeypatch.setattr("sacbus.links.PtyLink.open", fail)

    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,), terminals=True)):
            pass

    with pytest.raises(KeyError, match="a defect of a link"):
        asyncio.run(scene())


def test_two_hundred_and_fifty_nodes_have_a_terminal_each(tmp_path: Path) -> None:
    path = tmp_path / "sacbus"
    options = ("--nodes", "4-253", "--pty", str(path), "--ephemeral")
    with served("--terminals", *options) as sacbus:
        assert len(sacbus.ready["terminals"]) == 250
        for node in (4, 130, 253):
            assert ask(f"{path}-{node}", b"vd") == "vd\r\n100 RPM  cycle 3000\r\nSAC>"
        # They share what tells who has come and gone, of which a user may have 128.
        opened = Path(f"/proc/{sacbus.process.pid}/fd")
        if opened.is_dir():
            targets = [str(one.readlink()) for one in opened.iterdir()]
            assert 0 < targets.count("anon_inode:inotify") <= 2
        assert sacbus.send_signal(signal.SIGINT) == 130
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("stable", [True, False])
def test_more_files_than_a_user_may_open_are_told_of_in_one_line(
    tmp_path: Path, stable: bool
) -> None:
    place = f"--pty {tmp_path}/sacbus" if stable else ""
    command = (
        f"ulimit -n 100; exec {sys.executable} -m sacbus serve --terminals --ephemeral "
        f"--nodes 4-253 {place}"
    )
    ran = subprocess.run(
        ["sh", "-c", command], capture_output=True, timeout=PATIENCE, check=False, text=True
    )
    assert ran.returncode == 1
    assert ran.stdout == ""
    assert ran.stderr.startswith("error: ")
    assert "Too many open files" in ran.stderr
    assert "raise this user's limit of open files (ulimit -n)" in ran.stderr
    assert ran.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


# ---------------------------------------------------------------- terminal and queue


def test_a_person_talks_with_a_node(tmp_path: Path) -> None:
    with (
        served("--terminals", "--ephemeral") as sacbus,
        person("terminal", terminal(sacbus, 10), HOME=str(tmp_path)) as who,
    ):
        who.sees(lambda seen: seen.endswith("SAC>"))
        who.types("vd\r")
        seen = who.sees(lambda seen: seen.count("SAC>") == 2)
        assert seen.replace("\r", "").endswith("SAC>vd\n100 RPM  cycle 3000\nSAC>")
        who.types("11 hello\r")
        who.sees(lambda seen: seen.count("SAC>") == 3)
        who.types("\x04")
        assert who.leaves() == 0


def test_a_list_of_one_shots_is_typed_from_a_pipe(capsys: Captured) -> None:
    text = (DATA / "companion-one-shot.txt").read_bytes()
    with served("--terminals", "--ephemeral") as sacbus:
        link = terminal(sacbus, 10)
        ran = subprocess.run(
            [sys.executable, "-m", "sacbus", "terminal", link],
            input=text + b"vd\n",
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )
        assert (ran.returncode, ran.stderr) == (0, b"")
        # Of all lines only the one that was added shows anything: vc1900 was the list's last V.
        assert ran.stdout == b"157 RPM  cycle 1900\n"
        assert sacbus.send_signal(signal.SIGTERM) == 0
        (bus,) = sacbus.read_event("stopped")["buses"]
        assert bus["nodes"][0]["position_steps"] > 0


def test_a_line_that_is_too_long_is_answered_without_its_beginning() -> None:
    with served("--terminals", "--ephemeral") as sacbus:
        ran = subprocess.run(
            [sys.executable, "-m", "sacbus", "terminal", terminal(sacbus, 10)],
            input=b"11 " + b"x" * 60 + b"\nvd\n",
            capture_output=True,
            timeout=PATIENCE,
            check=False,
        )
        assert (ran.returncode, ran.stderr) == (0, b"")
        assert ran.stdout == b"2big.\n100 RPM  cycle 3000\n"


def test_a_queue_that_was_typed_is_got_back_one_to_one(capsys: Captured, tmp_path: Path) -> None:
    rows = [one.row for one in read_rows((DATA / "companion-queue.txt").read_text().splitlines())]
    file = tmp_path / "queue.csv"
    with served("--terminals", "--ephemeral") as sacbus:
        link = terminal(sacbus, 10)
        for row in rows:
            ask(link, f"q{row.position}{row.move().text()}".encode())
        assert run(["queue", "get", "--json", link, str(file)]) == 0
        report = json.loads(capsys.readouterr().out)
        assert (report["positions"], report["next_free"]) == (30, 1)
    got = [one.row for one in read_rows(file.read_text().splitlines())]
    assert got[: len(rows)] == rows
    assert file.read_bytes().count(b"\r\n") == 30
