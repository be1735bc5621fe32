"""What a service manager is told: real datagrams to a real socket."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from sacbus.notify import notify
from tests.serving import PATIENCE, served, started


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    """A service manager's end, bound to ``manager`` in the test's directory."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(tmp_path / "manager"))
        end.settimeout(PATIENCE)
        yield end


def test_a_manager_hears_what_is_said(
    manager: socket.socket, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", manager.getsockname())
    assert notify("READY=1")
    assert manager.recv(100) == b"READY=1"


def test_an_abstract_socket_is_found_by_its_at_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind("")  # Linux chooses an abstract name
        name = end.getsockname()
        monkeypatch.setenv("NOTIFY_SOCKET", "@" + name[1:].decode())
        assert notify("READY=1")
        assert end.recv(100) == b"READY=1"


@pytest.mark.parametrize("where", [None, "", "nobody/is/here"])
def test_without_a_manager_nothing_is_said(
    where: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    if where is not None:
        monkeypatch.setenv("NOTIFY_SOCKET", where)
    assert not notify("READY=1")


@pytest.mark.slow
def test_serve_is_ready_when_it_can_be_connected_to_and_stops_when_it_is_told_to(
    manager: socket.socket,
) -> None:
    with served("--ephemeral", NOTIFY_SOCKET=manager.getsockname()) as sacbus:
        assert manager.recv(100) == b"READY=1"
        assert sacbus.send_signal(signal.SIGTERM) == 0
        assert manager.recv(100) == b"STOPPING=1"


@pytest.mark.slow
def test_serve_that_cannot_open_is_never_ready(manager: socket.socket, tmp_path: Path) -> None:
    taken = tmp_path / "file"
    taken.touch()
    options = ("serve", "--ephemeral", "--pty", str(taken))
    with started(*options, NOTIFY_SOCKET=manager.getsockname()) as sacbus:
        assert sacbus.wait() == 1
    manager.setblocking(False)
    with pytest.raises(BlockingIOError):
        manager.recv(100)
