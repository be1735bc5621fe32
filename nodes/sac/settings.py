"""What a configuration may say about a SAC.

Owns the settings model: how its receiver and its times behave, its oscillator and its motor, how it
starts, and values of persistent parameters, whose limits stand in ``sacbus.language.Parameter``.
Those of the last that are given win over an EEPROM that is already there, as if they had been
configured; only the address does not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from nodes.sac.memory import BAUD, Memory, name_of
from sacbus.language import Parameter
from sacbus.motion import Drive, PullOut, Timebase
from sacbus.node import NodeSettings, SettingError

__all__ = ["FASTEST_XCLK", "SacSettings"]

#: Hz of a clock at xclk, at most; the device's own oscillator is that fast (manual, "clock").
FASTEST_XCLK: Final = 20_000_000

#: The settings that are persistent parameters: all of these but the address, by their names but
#: one, whose values are words for a flag.
_PARAMETERS: Final[Mapping[str, Parameter]] = {
    "linear" if parameter is Parameter.RAMP else name_of(parameter): parameter
    for parameter in Parameter
    if parameter is not Parameter.D_ID
}


# Any: what dataclasses.field gives stands for a value of the field's type.
def _flag(parameter: Parameter, words: str) -> Any:  # noqa: ANN401
    """A setting that is a parameter of 0 or 1."""
    return field(default=bool(parameter.factory), metadata={"help": words})


def _number(parameter: Parameter, words: str) -> Any:  # noqa: ANN401
    """A setting that is a parameter with a number."""
    low = 0 if parameter.zero is None else 1
    limits = {"low": low, "high": parameter.largest, "help": words}
    return field(default=parameter.factory, metadata=limits)


def _rate(parameter: Parameter, words: str) -> Any:  # noqa: ANN401
    """A port's rate; 0 leaves it to where the port is."""
    return field(default=0, metadata={"low": 0, "high": parameter.largest, "help": words})


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
    boot: str = field(
        default="booted",
        metadata={
            "choices": ("booted", "cold"),
            "help": "booted: obeys from the start; cold: first the second in which it is deaf",
        },
    )
    ack: bool = _flag(Parameter.ACK, "answer packets with ACK or NAK")
    crc: bool = _flag(Parameter.CRC, "send a CRC with the node's own packets")
    soft_ops: bool = _flag(
        Parameter.SOFT_OPS, "broadcast DC1 when a command starts and DC2 when it ends"
    )
    ops: int = _number(Parameter.OPS, "op_sa and op_sb tell of commands; 0: both stay low")
    linear: bool = _flag(Parameter.RAMP, "linear ramps by default")
    ustep: int = _number(Parameter.USTEP, "microsteps, as a power of two")
    r_id: int = _number(Parameter.R_ID, "driver: 0 A4988, 1 DRV8825, 2 by its own pin map")
    override: bool = _flag(Parameter.OVERRIDE, "commands count pulses instead of full steps")
    sprf: int = _number(Parameter.SPRF, "full steps per revolution")
    slow: int = _number(Parameter.SLOW, "RPM up to which there are no ramps")
    cycle: int = _number(Parameter.CYCLE, "default velocity, us per full step")
    acc: int = _number(Parameter.ACC, "default acceleration, harmonic, in hundredths")
    dec: int = _number(Parameter.DEC, "default deceleration, harmonic, in hundredths")
    l_acc: int = _number(Parameter.L_ACC, "default acceleration, linear, in hundredths")
    l_dec: int = _number(Parameter.L_DEC, "default deceleration, linear, in hundredths")
    cw: bool = _flag(Parameter.CW, "level of the dir pin that is clockwise")
    dir: bool = _flag(Parameter.DIR, "level of the dir pin in the default direction")
    pulse: int = _number(Parameter.PULSE, "width of a pulse at clk, us")
    ihd: int = _number(Parameter.IHD, "half microseconds taken from every period; 8 is exact")
    xclk: int = _number(Parameter.XCLK, "half microseconds added to every period")
    autorun: int = _number(
        Parameter.AUTORUN, "loop from queue position 1 to this one after a boot; 0: none"
    )
    network: bool = _flag(
        Parameter.NETWORK, "network at the hardware port, terminal at the software port"
    )
    hw: int = _rate(Parameter.HW, f"baud of the hardware port; 0: {BAUD}")
    sw: int = _rate(Parameter.SW, "baud of the software port, which is on the line; 0: as the line")

    ppm: int = field(
        default=0,
        metadata={
            "low": -100_000,
            "high": 100_000,
            "help": "its oscillator runs too fast by this many parts in a million",
        },
    )
    clock: bool = _flag(
        Parameter.CLOCK, "pulses are timed by its own oscillator; off: by the clock at xclk"
    )
    xfreq: int = _number(
        Parameter.XFREQ, "what it takes the frequency of the clock at xclk to be, Hz"
    )
    xclk_hz: int = field(
        default=0,
        metadata={
            "low": 0,
            "high": FASTEST_XCLK,
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

    def drive(self, memory: Memory) -> Drive:
        """What the motion engine must know of a node's hardware, of which memory tells a part."""
        return memory.drive(
            auto_micro=self.auto_micro,
            pull_in_rpm=self.pull_in_rpm,
            pull_out=self.pull_out_curve,
        )

    def factory_memory(self, address: int, line: int = BAUD) -> Memory:
        """The EEPROM at the first boot of a node at ``address``, on a line of ``line`` baud."""
        values = {one: int(getattr(self, name)) for name, one in _PARAMETERS.items()}
        born = Memory(d_id=address, line=line)
        for port in (Parameter.HW, Parameter.SW):
            values[port] = values[port] or born.factory(port)
        return born.with_values(values)

    def asked_for(self) -> frozenset[str]:
        """The persistent parameters that somebody set, by their names in memory."""
        return frozenset(
            name_of(parameter) for name, parameter in _PARAMETERS.items() if name in self.given
        )
