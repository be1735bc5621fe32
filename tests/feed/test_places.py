"""Where feeds lie, who may look there, and by which names a bus is known."""

from __future__ import annotations

import socket
import stat
from pathlib import Path

import pytest

from sacbus.feed import Way, same_link
from sacbus.feed.places import default_directory, private_directory, remove_stale, sockets


def test_the_directory_is_the_users_runtime_directory(
    runtime: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    assert default_directory() == runtime / "sacbus"
    assert not default_directory().exists()
    assert private_directory(None) == runtime / "sacbus"
    assert stat.S_IMODE((runtime / "sacbus").stat().st_mode) == 0o700


def test_a_directory_that_others_could_enter_is_closed_to_them(runtime: Path) -> None:
    runtime.chmod(0o755)
    assert private_directory(runtime) == runtime
    assert stat.S_IMODE(runtime.stat().st_mode) == 0o700


def test_a_directory_that_is_a_symlink_is_not_trusted(runtime: Path) -> None:
    (runtime / "link").symlink_to(runtime)
    with pytest.raises(PermissionError, match="belongs to somebody else"):
        private_directory(runtime / "link")


def test_only_sockets_that_nobody_listens_at_are_removed(runtime: Path) -> None:
    with socket.socket(socket.AF_UNIX) as alive, socket.socket(socket.AF_UNIX) as dead:
        alive.bind(str(runtime / "1-1.feed"))
        alive.listen()
        dead.bind(str(runtime / "2-1.feed"))
    with socket.socket(socket.AF_UNIX) as alive:
        (runtime / "1-1.feed").unlink()
        alive.bind(str(runtime / "1-1.feed"))
        alive.listen()
        (runtime / "notes.txt").write_text("mine")
        remove_stale(runtime)
        assert [path.name for path in sockets(runtime)] == ["1-1.feed"]
        assert (runtime / "notes.txt").exists()


def test_where_there_is_no_directory_there_are_no_feeds(runtime: Path) -> None:
    assert sockets(runtime / "none") == []


def test_a_pty_is_known_by_its_symlink_its_device_and_other_symlinks(runtime: Path) -> None:
    device = runtime / "pts"
    device.write_bytes(b"")
    way = Way("pty", str(runtime / "sac"), str(device))
    (runtime / "sac").symlink_to(device)
    (runtime / "other").symlink_to(runtime / "sac")
    for name in ("sac", "pts", "other"):
        assert same_link(str(runtime / name), way)
    assert not same_link(str(runtime / "sac2"), way)
    assert not same_link("socket://127.0.0.1:7000", way)


@pytest.mark.parametrize(
    ("asked", "served", "same"),
    [
        ("socket://127.0.0.1:7000", "socket://127.0.0.1:7000", True),
        ("socket://localhost:7000", "socket://127.0.0.1:7000", True),
        ("socket://localhost:7000", "socket://[::1]:7000", True),
        ("socket://127.0.0.1:7000", "socket://0.0.0.0:7000", True),
        ("socket://127.0.0.1:7001", "socket://127.0.0.1:7000", False),
        ("rfc2217://127.0.0.1:7000", "socket://127.0.0.1:7000", False),
        ("socket://example.org:7000", "socket://0.0.0.0:7000", False),
        ("socket://example.org:7000", "socket://127.0.0.1:7000", False),
        ("socket://127.0.0.1", "socket://127.0.0.1:7000", False),
        ("socket://127.0.0.1:http", "socket://127.0.0.1:7000", False),
        ("socket://10.0.0.2:7000", "socket://10.0.0.2:7000", True),
        ("/run/sac", "socket://127.0.0.1:7000", False),
    ],
)
def test_a_server_is_known_by_every_name_of_its_address(
    asked: str, served: str, same: bool
) -> None:
    assert same_link(asked, Way("tcp", served, None)) is same


@pytest.mark.parametrize("asked", ["socket://[::1", "rfc2217://[zz]:1", "socket://127.0.0.1:port"])
def test_what_is_no_url_is_no_link(asked: str) -> None:
    assert not same_link(asked, Way("tcp", "socket://127.0.0.1:7000", None))


@pytest.mark.parametrize(
    ("asked", "served", "same"),
    [
        ("socket://[::1]:7000", "socket://127.0.0.1:7000", False),
        ("socket://127.0.0.1:7000", "socket://[::1]:7000", False),
        ("socket://[::1]:7000", "socket://[::]:7000", True),
        ("socket://[::1]:7000", "socket://0.0.0.0:7000", False),
    ],
)
def test_two_loopbacks_are_two_places(asked: str, served: str, same: bool) -> None:
    assert same_link(asked, Way("tcp", served, None)) is same
