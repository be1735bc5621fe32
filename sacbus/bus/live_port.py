"""A live port: the place where the line goes on outside, over a real adapter.

Owns nothing but the passing on, at once and both ways: bytes from there have taken their time
already, and bytes to there take it on the real wires. That a real and a virtual talker overlap is
seen on the real line alone; here they follow each other.
"""

from __future__ import annotations

from collections.abc import Callable

from sacbus.bus.medium import Medium
from sacbus.bus.port import FULL
from sacbus.bus.transmission import Transmission

__all__ = ["LivePort"]


class LivePort:
    """A talker and listener for what hangs on a real line.

    ``send`` takes bytes the instant at which they begin on this line, so that they are on both at
    the same time. ``name`` is for people.
    """

    __slots__ = ("_held", "_hold", "_medium", "_send", "name")

    def __init__(
        self,
        medium: Medium,
        send: Callable[[bytes], None],
        *,
        name: str = "adapter",
        hold: Callable[[bool], None] | None = None,
    ) -> None:
        self.name = name
        self._medium = medium
        self._send = send
        self._hold = hold
        self._held = False
        medium.tap(self, self)

    def begun(self, sent: Transmission) -> None:
        """The medium's side: somebody here begins to talk."""
        passage = sent.passage
        data = sent.data if passage is None else bytes(passage.values)
        if data:
            self._send(data)

    def talk(self, data: bytes) -> None:
        """Bytes that have come over the real line."""
        if not data:
            return
        medium = self._medium
        sent = medium.relay(self, data, medium.master_lane)
        # More than a line of this rate can have brought: its end is no line, or at another rate.
        if not self._held and sent.end - medium.kernel.now > medium.rate.span(FULL):
            self._flow(held=True)
            medium.kernel.at(sent.end, self._go_on)

    def _go_on(self) -> None:
        self._flow(held=False)

    def _flow(self, *, held: bool) -> None:
        self._held = held
        if self._hold is not None:
            self._hold(held)

    def close(self) -> None:
        """Leave the line."""
        self._medium.untap(self)
