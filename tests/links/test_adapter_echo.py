"""An adapter that hears what it says: the far end of its wire gives back every byte, or another."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from sacbus.links import adapter
from sacbus.links.echo import Echo
from tests.links.bench import Bench, on_the_line
from tests.links.programs import PtyProgram
from tests.links.rig import until
from tests.links.socat import Wire, needs_socat

pytestmark = [pytest.mark.asyncio, needs_socat]

PACKET = b"\x02\x55\x01m3000a2d1\x03\x7f\x00"
ACK = b"\x02\x01\x55\x06"


class Echoing:
    """What hangs on the line of an adapter that hears itself: gives back every byte, or another."""

    def __init__(self, wire: Wire) -> None:
        self._program = PtyProgram(wire.far)
        self.got = bytearray()
        self.spoil: dict[int, int] = {}
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._program.descriptor, self._echo)

    def _echo(self) -> None:
        data = self._program.read()
        spoilt = bytes(
            self.spoil.get(at, byte) for at, byte in enumerate(data, start=len(self.got))
        )
        self.got += data
        self.say(spoilt)

    def say(self, data: bytes) -> None:
        assert self._program.write(data) == len(data)

    def close(self) -> None:
        self._loop.remove_reader(self._program.descriptor)
        self._program.close()


@pytest_asyncio.fixture
async def echoing(wire: Wire) -> AsyncIterator[tuple[Bench, Echoing]]:
    bench = Bench(wire, echo=True)
    bench.open()
    line = Echoing(wire)
    yield bench, line
    line.close()
    bench.link.close()


async def test_what_an_adapter_says_itself_is_not_heard(echoing: tuple[Bench, Echoing]) -> None:
    bench, line = echoing
    for _ in range(5):
        bench.link.send(PACKET)
        await until(lambda: len(line.got) % len(PACKET) == 0 and bench.link._echo)
        line.say(ACK)
    await until(lambda: len(bench.heard) == 5 * len(ACK))
    assert bench.heard == 5 * ACK
    assert line.got == 5 * PACKET
    assert (bench.told, bench.link.collisions) == ([], 0)


async def test_a_collision_is_counted_and_told_and_the_next_packet_is_whole(
    echoing: tuple[Bench, Echoing],
) -> None:
    bench, line = echoing
    line.spoil = {5: 0xEE, 6: 0xEE}
    bench.link.send(PACKET)
    await until(lambda: bench.told)
    what = "2 of its own bytes came back changed, somebody else was talking"
    assert bench.told == [f"adapter {bench.wire.near}: {what}"]
    assert bench.link.collisions == 2
    bench.link.send(PACKET)
    await until(lambda: len(line.got) == 2 * len(PACKET))
    line.say(ACK)
    await until(lambda: bench.heard == ACK)


async def test_collisions_again_and_again_are_told_once_in_a_while(
    echoing: tuple[Bench, Echoing], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adapter, "QUIET", 1000.0)
    bench, line = echoing
    line.spoil = dict.fromkeys(range(3, 5 * len(PACKET), len(PACKET)), 0xEE)
    for turn in range(1, 6):
        bench.link.send(PACKET)
        await until(lambda: bench.link.collisions == turn)
    assert [text.split(": ")[1][:1] for text in bench.told] == ["1"]
    assert bench.link._echo is not None
    for _ in range(2):  # the first time there is something to tell, the second time nothing
        assert bench.link._quiet is not None
        bench.link._quiet.cancel()
        bench.link._be_heard_again(bench.link._echo)
        assert [text.split(": ")[1][:1] for text in bench.told] == ["1", "4"]
    assert bench.link._quiet is None


async def test_an_adapter_without_the_echo_that_was_promised_is_told_of_once(wire: Wire) -> None:
    bench = Bench(wire, echo=True)
    bench.link._echo = Echo(260_417, grace_ns=1_000_000)
    bench.open()
    with on_the_line(wire) as program:
        for turn in range(1, 6):
            bench.link.send(ACK)
            program.write(b"a longer answer")
            await until(lambda: len(bench.heard) == turn * 15)
        assert bench.told == [
            f"adapter {wire.near} does not hear what it says, as echo expects; leave echo out"
        ]
        bench.link.close()


async def test_what_was_expected_to_come_back_is_forgotten_with_the_adapter(
    wire: Wire,
) -> None:
    bench = Bench(wire, echo=True)
    bench.open()
    with on_the_line(wire) as program:
        bench.link.send(PACKET)
        program.write(b"of others")
        await until(lambda: bench.link._echo and bench.link._echo._held)
    await bench.unplug()
    assert bench.heard == b"of others"
    await bench.plug()
    with on_the_line(wire) as program:
        program.write(PACKET)
        await until(lambda: bench.heard == b"of others" + PACKET)
    bench.link.close()
