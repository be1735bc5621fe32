"""A real line and a virtual one are one: two buses, each with an adapter at one end of a wire."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest

from sacbus.cli import run
from tests.links.socat import Wire, needs_socat
from tests.serving import Sacbus, served

pytestmark = [pytest.mark.slow, needs_socat]


@pytest.fixture
def wire() -> Iterator[Wire]:
    wire = Wire()
    wire.plug()
    yield wire
    wire.close()


def warnings(bus: Sacbus) -> list[str]:
    lines = [json.loads(line) for line in bus.text.split("\n")[:-1]]
    return [one["text"] for one in lines if one.get("what") == "warning"]


def test_a_virtual_node_answers_a_mother_on_the_real_line(wire: Wire) -> None:
    with served("--ephemeral", "--nodes", "10", "--port", wire.near):
        assert run(["send", wire.far, "10m400"]) == 0


def test_a_mother_reaches_nodes_here_and_on_the_real_line(wire: Wire) -> None:
    with (
        served("--ephemeral", "--nodes", "10", "--port", wire.near, "--tcp", "0") as here,
        served("--ephemeral", "--nodes", "20", "--port", wire.far),
    ):
        url = next(link["url"] for link in here.ready["links"] if link["kind"] == "tcp")
        for node in (10, 20, 10, 20):
            assert run(["send", url, f"{node}m400"]) == 0
        assert run(["send", url, "30V100"]) == 4


def test_a_bus_survives_its_adapter_and_tells_of_its_loss_and_its_return(wire: Wire) -> None:
    with served("--ephemeral", "--nodes", "10", "--port", wire.near) as bus:
        for turn in range(1, 4):
            wire.unplug()
            bus.read_until(lambda text: text.count(" is gone (") == turn)
            wire.plug()
            bus.read_until(lambda text: text.count(" is back after ") == turn)
            assert run(["send", wire.far, "10m400"]) == 0
        told = [re.sub(r"[\d.]+ s", "N s", text) for text in warnings(bus)]
    why = "unplugged, or closed by its other end"
    lost = f"adapter {wire.near} is gone ({why}); trying to reach it again"
    assert told == [lost, f"adapter {wire.near} is back after N s"] * 3
