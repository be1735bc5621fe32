"""What a command takes on a line, by its figures and as it is measured."""

from __future__ import annotations

import pytest

from sacbus import Mother, open_bus
from sacbus.bus import Port
from sacbus.daemon import Configuration
from sacbus.host import run_virtual
from sacbus.kernel import MS, Kernel, LineRate
from sacbus.mother.pace import command_seconds, measured_command_seconds, round_trip
from sacbus.node import Heard


def test_a_round_trip_is_what_it_takes_on_a_line_without_delays() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            mother = bus.mother()
            for line in ("", "q1m400v100a1"):
                answer = await mother.send(10, line)
                assert answer.round_trip == pytest.approx(round_trip(mother.rate, len(line)), abs=2)
            assert await measured_command_seconds(mother, [10]) == command_seconds(mother.rate)

    run_virtual(Kernel(), scene())


def test_a_hundred_commands_a_second_are_what_38400_baud_carry() -> None:
    assert 1 / command_seconds(LineRate(38_400)) == pytest.approx(120, abs=20)
    assert command_seconds(LineRate(9_600)) > 3 * command_seconds(LineRate(38_400))


def test_a_link_that_is_late_is_measured_once_a_command() -> None:
    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 11))) as bus:
            kernel = bus.host.kernel

            def hear(heard: Heard, _now: int) -> None:
                kernel.at(kernel.now + 20 * MS, mother.caller.hear, heard.data)

            port = Port(bus.bus.medium, hear, latency=0, name="far")
            mother = Mother(kernel, port.talk, slack=100 * MS, arrive=bus.host.arrive)
            measured = await measured_command_seconds(mother, [10, 11])
            assert measured == pytest.approx(command_seconds(mother.rate) + 0.020, abs=1e-6)

    run_virtual(Kernel(), scene())
