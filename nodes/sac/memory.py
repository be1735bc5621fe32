"""The EEPROM of a SAC: its persistent parameters.

Owns the parameters' names, factory values and widths. The names are those of the configure screen.
Only the parameters that this version obeys are here; the others follow with the configure commands.
Source: manual, "Configure" and "EEPROM".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache
from typing import Final

from sacbus.language import Defaults
from sacbus.motion import FACTORY_XFREQ, Drive, PullOut

__all__ = ["Memory"]

_ONE_BIT: Final = 1
_BYTE: Final = 255
_WORD: Final = 65_535
_LONG: Final = 2**32 - 1
_NO_RAMP: Final = 99_900

#: The largest value of each parameter; all are whole numbers from 0. Accelerations in hundredths.
_LARGEST: Final[Mapping[str, int]] = {
    "ramp": _ONE_BIT,
    "cw": _ONE_BIT,
    "dir": _ONE_BIT,
    "clock": _ONE_BIT,
    "xfreq": _LONG,
    "ihd": _BYTE,
    "xclk": _BYTE,
    "ustep": 7,
    "pulse": _BYTE,
    "slow": _BYTE,
    "d_id": _BYTE,
    "sprf": _WORD,
    "cycle": _LONG,
    "acc": _NO_RAMP,
    "dec": _NO_RAMP,
    "l_acc": _NO_RAMP,
    "l_dec": _NO_RAMP,
    "soft_ops": _ONE_BIT,
    "ack": _ONE_BIT,
    "crc": _ONE_BIT,
    "full_step": _ONE_BIT,
}

#: Parameters that nothing can be divided by when they are 0: the device would hang, we take the
#: factory's value instead (slow: 1) and say so.
_NOT_ZERO: Final[Mapping[str, int]] = {
    "sprf": 200,
    "cycle": 3000,
    "xfreq": FACTORY_XFREQ,
    "slow": 1,
    "acc": _NO_RAMP,
    "dec": _NO_RAMP,
    "l_acc": _NO_RAMP,
    "l_dec": _NO_RAMP,
}


#: One for all nodes that are alike: what is worked out for one then serves them all.
_drive = lru_cache(maxsize=256)(Drive)
_defaults = lru_cache(maxsize=256)(Defaults)


@dataclass(frozen=True, slots=True)
class Memory:
    """Persistent parameters with the factory's values (``d_id``: 85, as every SAC is born)."""

    ramp: int = 0
    cw: int = 0
    dir: int = 0
    clock: int = 1
    xfreq: int = FACTORY_XFREQ
    ihd: int = 8
    xclk: int = 0
    ustep: int = 0
    pulse: int = 1
    slow: int = 10
    d_id: int = 85
    sprf: int = 200
    cycle: int = 3000
    acc: int = 100
    dec: int = 100
    l_acc: int = 1047
    l_dec: int = 1047
    soft_ops: int = 0
    ack: int = 1
    crc: int = 1
    full_step: int = 1

    def restored(self, stored: Mapping[str, object]) -> tuple[Memory, list[str]]:
        """This memory with what was stored put in; a sentence for each value not taken as is."""
        remarks: list[str] = []
        taken: dict[str, int] = {}
        for name, value in stored.items():
            largest = _LARGEST.get(name)
            if largest is None:
                remarks.append(f"EEPROM: parameter {name!r} is not known to this version; ignored")
            elif isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= largest:
                remarks.append(
                    f"EEPROM: {name} expected 0 to {largest}, got {value!r}; factory value used"
                )
            elif value == 0 and name in _NOT_ZERO:
                taken[name] = _NOT_ZERO[name]
                remarks.append(f"EEPROM: {name} is 0, which divides nothing; {taken[name]} used")
            else:
                taken[name] = value
        return replace(self, **taken), remarks

    def stored(self) -> dict[str, int]:
        """All parameters by name, for the EEPROM's file."""
        return asdict(self)

    def defaults(self) -> Defaults:
        """The system defaults that a session starts from; one object for the same values."""
        return _defaults(
            cycle_us=self.cycle,
            acc100=self.acc,
            dec100=self.dec,
            linear_acc100=self.l_acc,
            linear_dec100=self.l_dec,
            linear=bool(self.ramp),
            sprf=self.sprf,
            # cw is the level of the direction pin for clockwise, dir the default direction's.
            cw=self.dir == self.cw,
            full_step=bool(self.full_step),
        )

    def drive(
        self,
        *,
        auto_micro: bool = False,
        pull_in_rpm: int | None = None,
        pull_out: PullOut = (),
    ) -> Drive:
        """What the motion engine must know of the hardware; the same object for the same values.

        The arguments are what no memory holds: an option of the node, and its motor.
        """
        return _drive(
            sprf=self.sprf,
            slow_rpm=self.slow,
            ustep=self.ustep,
            ihd=self.ihd,
            xclk=self.xclk,
            pulse_us=self.pulse,
            pull_in_rpm=pull_in_rpm,
            auto_micro=auto_micro,
            pull_out=pull_out,
        )


assert {field.name for field in fields(Memory)} == set(_LARGEST)
