"""A line that goes on outside: two processes, joined by a cable of socat's, are one bus."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.links.socat import Wire, needs_socat
from tests.serving import Sacbus, served, started

pytestmark = [pytest.mark.slow, needs_socat]

TURNS = 10


@pytest.fixture
def cable() -> Iterator[Wire]:
    """Two serial ports whose wires are joined while it is plugged in."""
    cable = Wire()
    cable.plug()
    yield cable
    cable.close()


def acknowledged(link: Path, line: str) -> bool:
    """Whether ``sacbus send`` had its ACK."""
    with started("send", str(link), line) as send:
        return send.wait() == 0


def told(sacbus: Sacbus, word: str) -> int:
    """How many reports with that word there are by now."""
    events = [json.loads(line) for line in sacbus.text.split("\n")[:-1]]
    return sum(one["event"] == "report" and word in one["text"] for one in events)


def read_until_told(sacbus: Sacbus, word: str, times: int) -> None:
    sacbus.read_until(lambda _: told(sacbus, word) >= times)


def test_mother_reaches_the_nodes_of_both_however_often_the_cable_is_pulled(
    tmp_path: Path, cable: Wire
) -> None:
    pty = tmp_path / "pty"
    here_options = ("--nodes", "10,11", "--port", cable.near, "--pty", str(pty))
    there_options = ("--nodes", "20,21", "--port", cable.far)
    with (
        served("--ephemeral", *here_options) as here,
        served("--ephemeral", *there_options) as there,
    ):
        for node in (10, 20, 11, 21):
            assert acknowledged(pty, f"{node}V100")
        for turn in range(1, TURNS + 1):
            cable.unplug()
            for one in (here, there):
                read_until_told(one, "is gone", turn)
            assert acknowledged(pty, "10V100")
            if turn == 1:
                assert not acknowledged(pty, "20V100")
            cable.plug()
            for one in (here, there):
                read_until_told(one, "is back", turn)
            assert acknowledged(pty, "20V100")
        for one in (here, there):
            assert one.send_signal(signal.SIGTERM) == 0
            assert (told(one, "is gone"), told(one, "is back")) == (TURNS, TURNS)
            (bus,) = json.loads(one.text.splitlines()[-1])["buses"]
            assert bus["collided"] == 0
            assert [link["reconnects"] for link in bus["links"] if link["kind"] == "adapter"] == [
                TURNS
            ]
