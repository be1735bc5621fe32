"""An adapter on a wire that can be pulled out, as its tests need it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from sacbus.links.adapter import AdapterLink
from sacbus.links.echo import Echo
from tests.links.programs import PtyProgram
from tests.links.rig import until
from tests.links.socat import Wire

__all__ = ["Bench", "on_the_line"]


class Bench:
    """An adapter on a wire, what it has heard and told, and what hangs on the line."""

    def __init__(self, wire: Wire, *, echo: bool = False) -> None:
        self.wire = wire
        self.heard = bytearray()
        self.told: list[str] = []
        self.link = AdapterLink(wire.near, 38_400, echo=echo, tell=self.told.append)
        if self.link._echo is not None:
            # socat and this machine may be later than any adapter.
            self.link._echo = Echo(260_417, grace_ns=20_000_000_000)

    def open(self) -> None:
        self.link.open(self.heard.extend)

    async def unplug(self) -> None:
        lost = len(self.told)
        self.wire.unplug()
        await until(lambda: len(self.told) > lost)

    async def plug(self) -> None:
        returns = self.link.counters.reconnects
        self.wire.plug()
        await until(lambda: self.link.counters.reconnects > returns)


@contextmanager
def on_the_line(wire: Wire) -> Iterator[PtyProgram]:
    program = PtyProgram(wire.far)
    try:
        yield program
    finally:
        program.close()
