"""Lines that ask nothing of the motor: empty ones, messages, lines for other nodes, soft ops.

Owns the types and how each prints back.
Source: manual, "Communications" and "ops/soft_ops"; spec, "Two ports".
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Empty", "Forward", "Message", "SoftOp", "TrafficCommand"]


@dataclass(frozen=True, slots=True)
class SoftOp:
    """DC1 (start) or DC2 (end) as a body: what another node tells of its motion."""

    start: bool

    def text(self) -> str:
        """One control character: 11 or 12 hexadecimal."""
        return "\x11" if self.start else "\x12"


@dataclass(frozen=True, slots=True)
class Empty:
    """A line with nothing on it but, perhaps, spaces: it does nothing and is acknowledged."""

    def text(self) -> str:
        """Nothing."""
        return ""


@dataclass(frozen=True, slots=True)
class Message:
    """Text for the receiver's terminal, never executed.

    body: the line as it stood, its leading space or dot included; one character a byte (Latin-1).
    """

    body: str

    def text(self) -> str:
        """The line as it stood."""
        return self.body


@dataclass(frozen=True, slots=True)
class Forward:
    """A line for another node: ``85m3000`` or ``/m3000``.

    destination: 0 to 255; None for ``/``, the source of the last packet. rest: everything after
    the address, one character a byte (Latin-1), not looked at; it does not begin with a digit
    unless destination is None.
    """

    destination: int | None
    rest: str

    def text(self) -> str:
        """The line as it stood, the address without leading zeros."""
        return f"{'/' if self.destination is None else self.destination}{self.rest}"


TrafficCommand = SoftOp | Empty | Message | Forward
