"""The EEPROM: what is stored, and what is made of stored values that do not fit."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import SacSettings
from nodes.sac.memory import PINS, QUEUE, Memory, name_of
from sacbus.language import QUEUE_LENGTH, Motion, Parameter, Session, seeded_row
from sacbus.node import settings_from

NAMES = [name_of(parameter) for parameter in Parameter]


def within(parameter: Parameter) -> st.SearchStrategy[int]:
    return st.integers(0 if parameter.zero is None else 1, parameter.largest)


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    """Commands as a queue holds them, at 200 steps a revolution."""
    defaults = Memory().defaults()
    by_rpm = draw(st.booleans())
    number = draw(st.integers(1, 2**32 - 1))
    acc = st.integers(1, 10_000) | st.integers(101, 999).map(lambda whole: whole * 100)
    return Motion(
        draw(st.none() | st.integers(1, 2**32 - 1)),
        cw=draw(st.booleans()),
        rpm=number if by_rpm else defaults.rpm_of(number),
        cycle_us=defaults.cycle_of(number) if by_rpm else number,
        acc100=draw(acc),
        dec100=draw(acc),
        linear=draw(st.booleans()),
        extra_pulses=draw(st.integers(0, 255)),
        wait_us=draw(st.integers(0, 2**32 - 1)),
        sync=draw(st.booleans()),
        pulses=draw(st.booleans()),
    )


@st.composite
def memories(draw: st.DrawFn) -> Memory:
    """Whatever an EEPROM may hold, on a line of some rate."""
    values = {one: draw(within(one)) for one in draw(st.sets(st.sampled_from(list(Parameter))))}
    values.pop(Parameter.SPRF, None)  # a queue is read by it: below
    line = draw(st.sampled_from([9_600, 38_400]))
    memory = SacSettings().factory_memory(draw(st.integers(4, 255)), line).with_values(values)
    for exponent, pins in draw(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)))):
        memory = memory.with_pins(exponent, pins)
    if draw(st.booleans()):
        few = draw(st.lists(motions(), min_size=1, max_size=3))
        memory = memory.with_queue((few * QUEUE_LENGTH)[:QUEUE_LENGTH])
    return memory


# ---- what is stored -----------------------------------------------------------------------------


def test_the_factory_values_are_the_manuals_and_all_are_stored_but_the_line_s_rate() -> None:
    stored = Memory().stored()
    assert stored.pop(PINS) == [0, 1, 2, 3, 4, 5, 6, 7]
    assert stored == {name_of(one): one.factory for one in Parameter if one is not Parameter.SW}


@given(memories())
def test_what_was_stored_comes_back(memory: Memory) -> None:
    stored = json.loads(json.dumps(memory.stored()))
    factory = SacSettings().factory_memory(85, memory.line)
    assert factory.restored(stored) == (memory, [])


def test_a_saved_queue_is_stored_as_rows_that_people_can_read() -> None:
    rows = [seeded_row(Memory().defaults())] * QUEUE_LENGTH
    rows[1] = replace(rows[1], steps=None, cw=False, sync=True, wait_us=5, acc100=99_900)
    stored: Any = Memory().with_queue(rows).stored()[QUEUE]  # rows of text
    assert stored[0] == "1 , 200 , 0 , 1 , 100 , 3000 , 0 , 1 , 1 , 0 , 0 , 0"
    assert stored[1] == "2 , 0 , 1 , 1 , 100 , 3000 , 0 , 999 , 1 , 0 , 1 , 5"
    assert len(stored) == QUEUE_LENGTH


def test_a_queue_saved_at_another_sprf_keeps_its_cycles_and_says_so_once() -> None:
    memory = Memory().with_queue([seeded_row(Memory().defaults())] * QUEUE_LENGTH)
    stored = {**memory.stored(), "sprf": 400}
    restored, (remark,) = Memory().restored(stored)
    assert restored.queue is not None
    assert {(one.cycle_us, one.rpm) for one in restored.queue} == {(3000, 50)}
    assert remark == (
        "EEPROM: queue position 1 expected 50, the RPM of a cycle of 3000, got 100; the cycle "
        "counts, and 29 more"
    )


def test_a_part_of_it_leaves_the_rest_as_it_was() -> None:
    restored, remarks = replace(Memory(), d_id=10).restored({"ustep": 2})
    assert restored == replace(Memory(), d_id=10, ustep=2)
    assert remarks == []


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("r_id", 3, "r_id expected 0 to 2, got 3; factory value used"),
        ("autorun", 31, "autorun expected 0 to 30, got 31; factory value used"),
        ("pins", [0] * 7, "pins expected 8 levels of 0 to 7; factory values used"),
        ("pins", [0] * 7 + [8], "pins expected 8 levels of 0 to 7; factory values used"),
        ("pins", [True] * 8, "pins expected 8 levels of 0 to 7; factory values used"),
        ("pins", "01234567", "pins expected 8 levels of 0 to 7; factory values used"),
        ("queue", "1", "queue expected rows of text; none used"),
        ("queue", [1], "queue expected rows of text; none used"),
        ("queue", [], "queue expected positions 1 to 30 in order; none used"),
        (
            "queue",
            ["1,2"],
            "this is no row of a queue file, the saved queue line 1 column 3, "  # noqa: ISC004
            "expected 12 or 14 fields, got 2; no queue used",
        ),
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
    name: str, value: object, expected: str
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
        ("hw", 38_400),
        ("sw", 38_400),
    ],
)
def test_what_nothing_can_be_divided_by_is_replaced_and_named(name: str, instead: int) -> None:
    restored, (remark,) = Memory().restored({name: 0})
    assert getattr(restored, name) == instead
    assert remark == f"EEPROM: {name} is 0, which divides nothing; {instead} used"


def test_what_an_earlier_version_called_full_step_is_no_remark() -> None:
    assert Memory().restored({"full_step": 1}) == (Memory(), [])


@given(
    st.dictionaries(
        st.sampled_from([*NAMES, PINS, QUEUE, "other"]),
        st.integers(-5, 2**33) | st.none() | st.text() | st.lists(st.integers() | st.text()),
    )
)
def test_whatever_was_stored_a_node_can_start_from_it(stored: dict[str, object]) -> None:
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
        override=1,
    )
    defaults, drive = memory.defaults(), memory.drive()
    assert (defaults.cycle_us, defaults.acc100, defaults.dec100) == (2500, 1, 2)
    assert (defaults.linear_acc100, defaults.linear_dec100, defaults.linear) == (3, 4, True)
    assert (defaults.sprf, defaults.full_step) == (400, False)
    assert (drive.sprf, drive.slow_rpm, drive.ustep) == (400, 12, 4)
    assert (drive.ihd, drive.xclk, drive.pulse_us) == (9, 3, 5)


# ---- pins ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("r_id", "levels"),
    [
        (0, ["000", "001", "010", "011", "111", None, None, None]),
        (1, ["000", "001", "010", "011", "100", "101", None, None]),
        (2, ["000", "001", "010", "011", "100", "101", "110", "111"]),
    ],
)
def test_the_pins_follow_the_table_of_the_driver(r_id: int, levels: list[str | None]) -> None:
    pins = [replace(Memory(), r_id=r_id, ustep=ustep).microstep_pins for ustep in range(8)]
    assert [None if one is None else f"{one:03b}" for one in pins] == levels


def test_the_pin_map_is_that_of_the_third_driver_alone() -> None:
    memory = replace(Memory(), ustep=2).with_pins(2, 0b101)
    assert [replace(memory, r_id=r_id).microstep_pins for r_id in range(3)] == [2, 2, 5]


# ---- rates --------------------------------------------------------------------------------------


def test_the_port_on_the_line_has_the_line_s_rate_until_somebody_sets_it() -> None:
    memory = SacSettings().factory_memory(10, 9_600)
    assert (memory.sw, memory.hw) == (9_600, 38_400)
    assert memory.factory(Parameter.SW) == 9_600
    assert "sw" not in memory.stored()
    # Stored nowhere, so it may be put on another line.
    elsewhere = SacSettings().factory_memory(10, 19_200)
    assert elsewhere.restored(memory.stored())[0].sw == 19_200


def test_a_rate_that_was_set_is_stored_and_stays() -> None:
    memory = SacSettings().factory_memory(10, 9_600).with_values({Parameter.SW: 38_400})
    assert memory.stored()["sw"] == 38_400
    elsewhere = SacSettings().factory_memory(10, 19_200)
    assert elsewhere.restored(memory.stored())[0].sw == 38_400


# ---- settings -----------------------------------------------------------------------------------


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
        r_id=2,
        autorun=3,
        dir=True,
        ops=0,
        acc=150,
        sw=9600,
        override=True,
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
        r_id=2,
        autorun=3,
        dir=1,
        ops=0,
        acc=150,
        sw=9600,
        override=1,
    )
    assert SacSettings().factory_memory(85) == Memory()


@pytest.mark.parametrize("parameter", [one for one in Parameter if one is not Parameter.D_ID])
def test_every_parameter_but_the_address_can_be_set_within_its_limits(
    parameter: Parameter,
) -> None:
    name = "linear" if parameter is Parameter.RAMP else name_of(parameter)
    value = bool(1 - parameter.factory) if parameter.largest == 1 else parameter.largest
    settings = settings_from(SacSettings, {name: value})
    assert isinstance(settings, SacSettings)
    assert settings.asked_for() == {name_of(parameter)}
    assert settings.factory_memory(10).value(parameter) == int(value)
    if parameter.largest > 1:
        with pytest.raises(ValueError, match=f"to {parameter.largest}, got"):
            settings_from(SacSettings, {name: parameter.largest + 1})
