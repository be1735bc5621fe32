"""The EEPROM: what is stored, and what is made of stored values that do not fit."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import SacSettings
from nodes.sac.memory import Memory
from sacbus.language import Session

NAMES = [field.name for field in fields(Memory)]


def test_the_factory_values_are_those_of_the_manual() -> None:
    assert Memory().stored() == {
        "ramp": 0,
        "cw": 0,
        "dir": 0,
        "clock": 1,
        "xfreq": 1_000_000,
        "ihd": 8,
        "xclk": 0,
        "ustep": 0,
        "pulse": 1,
        "slow": 10,
        "d_id": 85,
        "sprf": 200,
        "cycle": 3000,
        "acc": 100,
        "dec": 100,
        "l_acc": 1047,
        "l_dec": 1047,
        "soft_ops": 0,
        "ack": 1,
        "crc": 1,
        "full_step": 1,
    }


def test_what_was_stored_comes_back() -> None:
    memory = replace(Memory(), d_id=10, ustep=3, cycle=2**32 - 1, acc=99_900)
    assert Memory().restored(memory.stored()) == (memory, [])


def test_a_part_of_it_leaves_the_rest_as_it_was() -> None:
    restored, remarks = replace(Memory(), d_id=10).restored({"ustep": 2})
    assert restored == replace(Memory(), d_id=10, ustep=2)
    assert remarks == []


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("ustep", 8, "ustep expected 0 to 7, got 8; factory value used"),
        ("ustep", -1, "ustep expected 0 to 7, got -1; factory value used"),
        ("d_id", 256, "d_id expected 0 to 255, got 256; factory value used"),
        ("sprf", 65_536, "sprf expected 0 to 65535, got 65536; factory value used"),
        ("cycle", 2**32, "cycle expected 0 to 4294967295, got 4294967296; factory value used"),
        ("acc", 99_901, "acc expected 0 to 99900, got 99901; factory value used"),
        ("ack", 2, "ack expected 0 to 1, got 2; factory value used"),
        ("ack", True, "ack expected 0 to 1, got True; factory value used"),
        ("colour", 1, "parameter 'colour' is not known to this version; ignored"),
    ],
)
def test_a_value_that_does_not_fit_is_left_out_and_named(
    name: str, value: int, expected: str
) -> None:
    assert Memory().restored({name: value}) == (Memory(), [f"EEPROM: {expected}"])


@pytest.mark.parametrize(
    ("name", "instead"),
    [
        ("sprf", 200),
        ("cycle", 3000),
        ("xfreq", 1_000_000),
        ("slow", 1),
        ("acc", 99_900),
        ("dec", 99_900),
        ("l_acc", 99_900),
        ("l_dec", 99_900),
    ],
)
def test_what_nothing_can_be_divided_by_is_replaced_and_named(name: str, instead: int) -> None:
    restored, (remark,) = Memory().restored({name: 0})
    assert restored.stored()[name] == instead
    assert remark == f"EEPROM: {name} is 0, which divides nothing; {instead} used"


@given(st.dictionaries(st.sampled_from([*NAMES, "other"]), st.integers(-5, 2**33)))
def test_whatever_was_stored_a_node_can_start_from_it(stored: dict[str, int]) -> None:
    restored, remarks = Memory().restored(stored)
    assert len(remarks) <= len(stored)
    assert Memory().restored(restored.stored()) == (restored, [])
    Session.start(restored.defaults())
    assert restored.drive().sprf == restored.sprf


@pytest.mark.parametrize(
    ("cw", "dir_level", "clockwise"), [(0, 0, True), (1, 1, True), (0, 1, False), (1, 0, False)]
)
def test_the_default_direction_is_clockwise_when_its_level_is_that_of_clockwise(
    cw: int, dir_level: int, clockwise: bool
) -> None:
    assert replace(Memory(), cw=cw, dir=dir_level).defaults().cw is clockwise


def test_the_defaults_and_the_drive_carry_what_is_stored() -> None:
    memory = replace(
        Memory(),
        ramp=1,
        ihd=9,
        xclk=3,
        ustep=4,
        pulse=5,
        slow=12,
        sprf=400,
        cycle=2500,
        acc=1,
        dec=2,
        l_acc=3,
        l_dec=4,
        full_step=0,
    )
    defaults, drive = memory.defaults(), memory.drive()
    assert (defaults.cycle_us, defaults.acc100, defaults.dec100) == (2500, 1, 2)
    assert (defaults.linear_acc100, defaults.linear_dec100, defaults.linear) == (3, 4, True)
    assert (defaults.sprf, defaults.full_step) == (400, False)
    assert (drive.sprf, drive.slow_rpm, drive.ustep) == (400, 12, 4)
    assert (drive.ihd, drive.xclk, drive.pulse_us) == (9, 3, 5)


def test_settings_give_the_memory_of_the_first_boot() -> None:
    settings = SacSettings(
        ack=False,
        crc=False,
        soft_ops=True,
        linear=True,
        ustep=2,
        sprf=400,
        slow=20,
        cycle=2000,
    )
    assert settings.factory_memory(10) == replace(
        Memory(),
        d_id=10,
        ack=0,
        crc=0,
        soft_ops=1,
        ramp=1,
        ustep=2,
        sprf=400,
        slow=20,
        cycle=2000,
    )
    assert SacSettings().factory_memory(85) == Memory()
