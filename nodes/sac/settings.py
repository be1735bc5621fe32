"""What a configuration may say about a SAC.

Owns the settings model: how its receiver and its times behave, and values of persistent parameters.
Those that are given win over an EEPROM that is already there, as if they had been configured; only
the address does not (``SacNode.restore``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from nodes.sac.memory import Memory
from sacbus.node import NodeSettings

__all__ = ["SacSettings"]

#: Settings that are persistent parameters as well; those that have another name there.
_PERSISTENT: Final = ("linear", "ustep", "slow", "sprf", "cycle", "soft_ops", "ack", "crc")
_PARAMETER: Final = {"linear": "ramp"}


@dataclass(frozen=True)
class SacSettings(NodeSettings):
    """Settings of the kind ``sac``."""

    receiver: str = field(
        default="device",
        metadata={
            "choices": ("device", "robust"),
            "help": "device: byte for byte as the firmware; robust: frames as specified",
        },
    )
    turnaround: bool = field(
        default=True,
        metadata={"help": "wait before an answer as the device does (385 us and more); off: none"},
    )
    deaf_time: bool = field(
        default=True,
        metadata={"help": "lose what arrives while a packet is handled, as the device does"},
    )
    ack: bool = field(default=True, metadata={"help": "answer packets with ACK or NAK"})
    crc: bool = field(default=True, metadata={"help": "send a CRC with the node's own packets"})
    soft_ops: bool = field(
        default=False,
        metadata={"help": "broadcast DC1 when a command starts and DC2 when it ends"},
    )
    linear: bool = field(default=False, metadata={"help": "linear ramps by default"})
    ustep: int = field(
        default=0, metadata={"low": 0, "high": 7, "help": "microsteps, as a power of two"}
    )
    sprf: int = field(
        default=200, metadata={"low": 1, "high": 65_535, "help": "full steps per revolution"}
    )
    slow: int = field(
        default=10,
        metadata={"low": 1, "high": 255, "help": "RPM up to which there are no ramps"},
    )
    cycle: int = field(
        default=3000,
        metadata={"low": 1, "high": 2**32 - 1, "help": "default velocity, us per full step"},
    )

    def factory_memory(self, address: int) -> Memory:
        """The EEPROM at the first boot of a node that is configured at ``address``."""
        return replace(
            Memory(d_id=address),
            **{_PARAMETER.get(name, name): int(getattr(self, name)) for name in _PERSISTENT},
        )

    def asked_for(self) -> dict[str, int]:
        """The persistent parameters that somebody set, by their names in memory."""
        return {
            _PARAMETER.get(name, name): int(getattr(self, name))
            for name in _PERSISTENT
            if name in self.given
        }
