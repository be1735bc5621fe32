"""Somebody at the terminal of a node on a bench."""

from __future__ import annotations

from sacbus.kernel import MS, Ns
from sacbus.language import Mode
from sacbus.language.queue_screen import QueueScreen
from tests.nodes.sac.bench import Bench

__all__ = ["Console", "lines"]


class Console:
    """A bench with somebody at the terminal of its first node."""

    def __init__(self, *addresses: int) -> None:
        self.bench = Bench(*addresses)
        self.terminal = self.bench.node.terminal
        self.shown = bytearray()
        self.terminal.show = self.shown.extend

    def types(self, keys: str | bytes) -> str:
        """What is shown from here on, once the line has come to rest for 20 ms."""
        begin = len(self.shown)
        bench = self.bench
        keys = keys.encode("latin-1") if isinstance(keys, str) else keys
        self.terminal.type(keys, bench.kernel.now)
        bench.bus.touch(bench.node)
        self.until(bench.kernel.now + 20 * MS)
        return self.shown[begin:].decode("latin-1")

    def until(self, at: Ns) -> None:
        """Let it be that late."""
        self.bench.kernel.run_until(at)

    @property
    def mode(self) -> Mode:
        """The mode that the terminal is in."""
        terminal = self.bench.node.board.terminal_port
        assert terminal is not None
        return terminal.mode

    def queue(self) -> QueueScreen:
        screen = QueueScreen.read(self.types("q\r"))
        assert screen is not None
        return screen


def lines(*parts: str) -> str:
    """Lines, each with its end, and the prompt."""
    return "".join(part + "\r\n" for part in parts) + "SAC>"
