"""What a configuration may say about a SAC.

Owns the settings model: how its receiver and its times behave, its oscillator and its motor, and
values of persistent parameters. Those of the last that are given win over an EEPROM that is already
there, as if they had been configured; only the address does not (``SacNode.restore``).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final

from nodes.sac.memory import Memory
from sacbus.motion import FACTORY_XFREQ, Drive, PullOut, Timebase
from sacbus.node import NodeSettings, SettingError

__all__ = ["SacSettings"]

#: Settings that are persistent parameters as well; those that have another name there.
_PERSISTENT: Final = (
    *("linear", "ustep", "slow", "sprf", "cycle", "soft_ops", "ack", "crc"),
    *("clock", "xfreq"),
)
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

    ppm: int = field(
        default=0,
        metadata={
            "low": -100_000,
            "high": 100_000,
            "help": "its oscillator runs too fast by this many parts in a million",
        },
    )
    clock: bool = field(
        default=True,
        metadata={"help": "pulses are timed by its own oscillator; off: by the clock at xclk"},
    )
    xfreq: int = field(
        default=FACTORY_XFREQ,
        metadata={
            "low": 1,
            "high": 2**32 - 1,
            "help": "what it takes the frequency of the clock at xclk to be, Hz",
        },
    )
    xclk_hz: int = field(
        default=0,
        metadata={
            "low": 0,
            "high": 20_000_000,
            "help": "the clock at xclk, Hz; 0: none, and nothing moves by it",
        },
    )
    auto_micro: bool = field(
        default=False,
        metadata={"help": "microsteps up to ustep as long as pulses are 200 us apart"},
    )
    pull_in: int = field(
        default=0,
        metadata={
            "low": 0,
            "high": 100_000,
            "help": "RPM that its motor starts at from rest, beyond which it stalls; 0: any",
        },
    )
    pull_out: str = field(
        default="",
        metadata={
            "pattern": r"(\d{1,6}:\d{1,7}(,\d{1,6}:\d{1,7})*)?",
            "form": "points RPM:RAD/S2 such as 0:900,600:400,1200:0",
            "help": "acceleration that its motor follows at a speed; needs pull_in; none: any",
        },
    )

    def __post_init__(self) -> None:
        if self.pull_out and not self.pull_in:
            raise SettingError("setting 'pull_out': expected pull_in with it, got none")
        try:
            Drive(pull_in_rpm=self.pull_in_rpm, pull_out=self.pull_out_curve)
        except ValueError as fault:
            raise SettingError(f"setting 'pull_out': {fault}") from fault

    @property
    def oscillator(self) -> Timebase:
        """The node's own clock."""
        return Timebase.internal(self.ppm)

    @property
    def pull_in_rpm(self) -> int | None:
        """As a drive has it."""
        return self.pull_in or None

    @property
    def pull_out_curve(self) -> PullOut:
        """As a drive has it."""
        points = (point.partition(":") for point in self.pull_out.split(",") if point)
        return tuple((int(rpm), int(acceleration)) for rpm, _, acceleration in points)

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
