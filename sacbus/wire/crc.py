"""The CRC of the network: CRC-8 Dallas/Maxim, computed by crcmod.

Owns the one typed door to crcmod, which has no stubs. The receivers are the hot loops of the
project, so they call crcmod's table function themselves, as `table_crc(body, 0, CRC_TABLE)`: every
Python frame between costs as much as the CRC of a short body. Source: manual, "CRC" ("Dallas/Maxim
inverse polynomial").
"""

from types import BuiltinFunctionType
from typing import TYPE_CHECKING, Final, cast

# Not `import crcmod.crcmod`: the package binds that name to itself.
from crcmod.crcmod import mkCrcFun  # type: ignore[import-untyped]  # 1.7 ships no types

if TYPE_CHECKING:
    from collections.abc import Callable

_POLYNOMIAL: Final = 0x131
"""x^8 + x^5 + x^4 + 1 with its top bit; bit-reversed it is the 0x8C of the Dallas/Maxim notes."""

# mkCrcFun gives a closure whose defaults are (initial value, table, function): the C function and a
# packed table, or the pure-Python function and a list. Taking them from there suits both forms, and
# builds no second table. crcmod 1.7 has been its last release since 2010, and a test holds this.
_, _table, _function = mkCrcFun(_POLYNOMIAL, initCrc=0, rev=True, xorOut=0).__defaults__

CRC_IS_FAST: Final = isinstance(_function, BuiltinFunctionType)
"""False when crcmod was installed without a C compiler: as right, but many times slower."""

CRC_TABLE: Final[object] = _table
"""crcmod's own table, opaque: the third argument of `table_crc`, nothing else."""

table_crc: Final = cast("Callable[[bytes, int, object], int]", _function)
"""`table_crc(data, 0, CRC_TABLE)` is `crc8(data)`, for loops in which a call more counts."""


def crc8(data: bytes) -> int:
    """The check byte of a packet with this body, 0 to 255; 0 for none, 0xA1 for "123456789"."""
    return table_crc(data, 0, CRC_TABLE)
