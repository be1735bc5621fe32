"""What a configuration may say about an SS-MST67: its jumpers, its EEPROM, its crystal, its motor.

Owns the settings model. Values of the EEPROM that are given win over one that is there already; the
address does not.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final

from nodes.superstepper.memory import FACTORY_BAUD, Eeprom, code_of
from sacbus.node import NodeSettings

__all__ = ["SuperStepperSettings"]

#: The settings that are values of the EEPROM, by the names under which they are stored.
_STORED: Final = ("baud_code", "rate", "time_base", "starting_speed")


# Any: what dataclasses.field gives stands for a value of the field's type.
def _number(default: int, low: int, high: int, words: str) -> Any:  # noqa: ANN401
    return field(default=default, metadata={"low": low, "high": high, "help": words})


def _jumper(default: str, words: str) -> Any:  # noqa: ANN401
    return field(default=default, metadata={"choices": ("open", "closed"), "help": words})


@dataclass(frozen=True)
class SuperStepperSettings(NodeSettings):
    """Settings of the kind ``ss-mst67``."""

    jmp1: str = _jumper("closed", "open: 2400 baud, address 0; closed: those of the EEPROM")
    jmp2: str = _jumper("open", "open: 8-bit, closed: 9-bit communication")
    baud_code: int = _number(
        FACTORY_BAUD, 0, 255, "EEPROM 0; left out: that of the line's rate, if Table 6 has one"
    )
    rate: int = _number(0x0100, 0, 0xFFFF, "EEPROM 2 and 3: the speed value's change at a beat")
    time_base: int = _number(10, 0, 255, "EEPROM 4: ms from beat to beat, less one")
    starting_speed: int = _number(32_000, 0, 0xFFFF, "EEPROM 5 and 6: where ramps begin")
    own_baud: bool = field(
        default=False,
        metadata={"help": "its UART runs as its crystal lets it, -7 to +8.5 % off the line's rate"},
    )
    turnaround_us: int = _number(100, 0, 100_000, "from a message to its answer, us")
    ppm: int = _number(0, -100_000, 100_000, "its crystal is too fast by so many in a million")
    steps_per_revolution: int = _number(200, 1, 100_000, "full steps of its motor in a turn")

    @property
    def nine(self) -> bool:
        """Whether it speaks with ninth bits."""
        return self.jmp2 == "closed"

    @property
    def stored(self) -> frozenset[str]:
        """The values of the EEPROM that somebody set."""
        return frozenset(_STORED) & self.given

    def factory_eeprom(self, address: int, line: int) -> Eeprom:
        """As it is at the first power-on of a module at ``address``, on a line of ``line`` baud."""
        baud = self.baud_code
        if "baud_code" not in self.given:
            baud = code_of(line) or baud
        return Eeprom(
            address,
            baud=baud,
            rate=self.rate,
            time_base=self.time_base,
            start=self.starting_speed,
        )
