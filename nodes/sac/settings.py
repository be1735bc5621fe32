"""What a configuration may say about a SAC.

Owns the settings model: how its receiver and its times behave, and factory values of persistent
parameters (an EEPROM that is already there wins over these).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from nodes.sac.memory import Memory
from sacbus.node import NodeSettings

__all__ = ["SacSettings"]


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
        return Memory(
            ramp=int(self.linear),
            ustep=self.ustep,
            slow=self.slow,
            d_id=address,
            sprf=self.sprf,
            cycle=self.cycle,
            soft_ops=int(self.soft_ops),
            ack=int(self.ack),
            crc=int(self.crc),
        )
