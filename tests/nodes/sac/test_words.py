"""A memory in words: every value has its meaning, and what differs from the factory is marked."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND, SacSettings
from nodes.sac.memory import Memory
from sacbus.language import QUEUE_LENGTH, Parameter, seeded_row
from sacbus.node import MemoryWords


def words(memory: Memory, address: int | None = 85) -> MemoryWords:
    return KIND.memory_words(memory.stored(), address)


def said(memory: Memory, parameter: Parameter) -> tuple[str, str, str | None]:
    (found,) = [one for one in words(memory).values if one.key == parameter.letter]
    assert found.name == parameter.title
    return found.value, found.meaning, found.factory


def test_nothing_of_a_new_memory_differs_from_the_factory_s() -> None:
    told = words(SacSettings().factory_memory(10), 10)
    assert [one.factory for one in told.values] == [None] * len(Parameter)
    assert told.remarks == ()


def test_without_an_address_the_factory_s_is_the_manual_s() -> None:
    told = KIND.memory_words(SacSettings().factory_memory(10).stored(), None)
    assert [(one.name, one.factory) for one in told.values if one.factory] == [("d_id", "85")]


@given(st.sampled_from(list(Parameter)), st.data())
def test_every_value_has_words(parameter: Parameter, data: st.DataObject) -> None:
    value = data.draw(st.integers(0 if parameter.zero is None else 1, parameter.largest))
    memory = Memory().with_values({parameter: value})
    shown, meaning, factory = said(memory, parameter)
    assert meaning
    assert (factory is not None) is (value != Memory().factory(parameter))
    assert shown


@pytest.mark.parametrize(
    ("values", "parameter", "expected"),
    [
        ({"autorun": 4}, Parameter.AUTORUN, "loops from position 1 to 4 after a boot"),
        ({"dir": 1}, Parameter.DIR, "counter-clockwise by default"),
        ({"dir": 1, "cw": 1}, Parameter.DIR, "clockwise by default"),
        ({"ustep": 0}, Parameter.USTEP, "1 microstep a full step"),
        ({"ustep": 6}, Parameter.USTEP, "64 microsteps a full step, which its driver has not"),
        ({"ustep": 6, "r_id": 2}, Parameter.USTEP, "64 microsteps a full step"),
        ({"cycle": 5000}, Parameter.CYCLE, "us a full step, 60 RPM"),
        ({"ops": 0}, Parameter.OPS, "0 in binary: op_sa and op_sb stay low"),
        ({"network": 1}, Parameter.HW, "baud"),
        ({"network": 1}, Parameter.SW, "as the line"),
        ({"sw": 9_600}, Parameter.SW, "baud"),
        ({"override": 1}, Parameter.OVERRIDE, "commands count pulses"),
    ],
)
def test_meanings(values: dict[str, int], parameter: Parameter, expected: str) -> None:
    assert said(replace(Memory(), **values), parameter)[1] == expected  # type: ignore[arg-type]


def test_a_queue_is_a_table_with_its_commands() -> None:
    memory = Memory()
    rows = [seeded_row(memory.defaults())] * QUEUE_LENGTH
    rows[4] = replace(rows[4], steps=None, cw=False, sync=True, pulses=True, wait_us=7)
    told = words(memory.with_queue(rows))
    assert [table.title for table in told.tables][1:] == ["saved queue (QS)"]
    table = told.tables[1]
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert table.rows[4] == (
        *("5", "endless p", "CCW", "100", "3000", "harmonic", "1.00", "1.00", "0", "yes", "7"),
        "m-v100a1d1l0t7sp",
    )
