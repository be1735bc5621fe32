"""The CRC: worked values, the definition bit by bit, and crcmod without its C extension."""

import importlib
import importlib.util
import sys
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.wire import crc as room
from sacbus.wire import crc8


def dallas_maxim_bit_by_bit(data: bytes) -> int:
    """The definition: shift register 0, reflected polynomial 0x8C, lowest bit first."""
    register = 0
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = (register >> 1) ^ 0x8C if register & 1 else register >> 1
    return register


@pytest.fixture
def crc_without_extension(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A second copy of the module on a crcmod that was installed without a compiler."""
    for name in ("crcmod._crcfunext", "crcmod._crcfunpy", "crcmod.crcmod"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setitem(sys.modules, "crcmod._crcfunext", None)
    spec = importlib.util.spec_from_file_location("crc_without_extension", room.__file__)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("body", "crc"),
    [
        (b"123456789", 0xA1),  # the check value of CRC-8/MAXIM
        (b"", 0x00),
        (b"m3000a2d1", 0xA7),  # the firmware's: 85m3000a2d1 typed at node 82
        (b"s", 0x1A),  # and 0s
        (b" hello", 0xA5),  # and 85 hello
        (b"m132", 0x02),
        (b"m132 ", 0x9F),
        (b"m349", 0x03),
        (b"+", 0x03),
        (b"m13", 0x00),
        (b"\x06", 0xDD),
        (b"\x15", 0xA2),
    ],
)
def test_worked_values_come_out(body: bytes, crc: int) -> None:
    assert crc8(body) == crc


@given(st.binary(max_size=300))
def test_crc_is_the_definition_bit_by_bit(data: bytes) -> None:
    assert crc8(data) == dallas_maxim_bit_by_bit(data)


@given(st.binary(max_size=300))
def test_the_loops_own_door_gives_the_same(data: bytes) -> None:
    assert room.table_crc(data, 0, room.CRC_TABLE) == crc8(data)


def test_crc_is_fast_exactly_when_crcmod_has_its_extension() -> None:
    assert (importlib.util.find_spec("crcmod._crcfunext") is not None) is room.CRC_IS_FAST


def test_without_the_extension_the_crc_is_slow_but_the_same(
    crc_without_extension: ModuleType,
) -> None:
    assert crc_without_extension.CRC_IS_FAST is False
    for body in (b"", b"123456789", bytes(range(256))):
        assert crc_without_extension.crc8(body) == dallas_maxim_bit_by_bit(body)
