"""Edits leave in a position what they say, whatever stood there, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.language import Defaults, EditQueue, Motion, edited, parse
from sacbus.mother import BadRequest
from sacbus.mother.edits import LONGEST_EDIT, edit_lines, hold_line

BITS_32 = 2**32 - 1

#: Those that do not depend on each other.
FIELDS = ("steps", "cw", "acc100", "dec100", "linear", "extra_pulses", "wait_us", "sync", "pulses")

hundredths = st.integers(1, 9_999) | st.integers(100, 999).map(lambda whole: whole * 100)
defaults = st.builds(Defaults, sprf=st.sampled_from([48, 200, 400]), cw=st.booleans())


@st.composite
def motions(draw: st.DrawFn, of: Defaults) -> Motion:
    """Motions whose RPM and cycle belong together, as every command's do."""
    if draw(st.booleans()):
        rpm = draw(st.integers(1, 5_000))
        cycle_us = of.cycle_of(rpm)
    else:
        cycle_us = draw(st.integers(1, BITS_32))
        rpm = of.rpm_of(cycle_us)
    return Motion(
        draw(st.none() | st.integers(1, BITS_32)),
        cw=draw(st.booleans()),
        rpm=rpm,
        cycle_us=cycle_us,
        acc100=draw(hundredths),
        dec100=draw(hundredths),
        linear=draw(st.booleans()),
        extra_pulses=draw(st.integers(0, 255)),
        wait_us=draw(st.integers(0, BITS_32)),
        sync=draw(st.booleans()),
        pulses=draw(st.booleans()),
    )


@given(st.data())
def test_whatever_stood_there_is_replaced_whole(data: st.DataObject) -> None:
    of = data.draw(defaults)
    before, wanted = data.draw(motions(of)), data.draw(motions(of))
    lines = edit_lines(30, wanted, of)
    row, held = before, []
    for line in lines:
        assert len(line) <= LONGEST_EDIT
        parsed = parse(line.encode())
        assert isinstance(parsed.command, EditQueue)
        assert not parsed.remarks
        assert parsed.command.position == 30
        row = edited(row, parsed.command.edit, of)
        held.append(row.sync)
    assert row == wanted
    # Whoever was held at this position is held until the last line.
    assert held[:-1] == [before.sync] * (len(lines) - 1)


@given(st.data())
def test_of_what_is_known_to_stand_there_only_what_differs_is_named(data: st.DataObject) -> None:
    of = data.draw(defaults)
    before = data.draw(motions(of))
    wanted = data.draw(st.just(before) | st.builds(replace, st.just(before), **{
        name: st.just(getattr(data.draw(motions(of)), name))
        for name in data.draw(st.sets(st.sampled_from(FIELDS)))
    }))  # fmt: skip
    row = before
    lines = edit_lines(7, wanted, of, before=before)
    for line in lines:
        parsed = parse(line.encode())
        assert isinstance(parsed.command, EditQueue)
        row = edited(row, parsed.command.edit, of)
    assert row == wanted
    assert (lines == []) == (wanted == before)
    assert len("".join(lines)) <= len("".join(edit_lines(7, wanted, of)))


def motion(**fields: object) -> Motion:
    of: dict[str, object] = {
        "steps": 400, "cw": True, "rpm": 100, "cycle_us": 3000, "acc100": 100, "dec100": 100,
        "linear": False,
    }  # fmt: skip
    return Motion(**(of | fields))  # type: ignore[arg-type]  # fields by name, of any type


def test_a_usual_command_is_one_line_with_every_field() -> None:
    assert edit_lines(9, motion(sync=True)) == ["q9m400v100a1d1l0u0t0fs"]
    assert edit_lines(9, motion(steps=None, cw=False)) == ["q9m-0v100a1d1l0u0t0fs0"]


def test_a_long_one_is_split_between_fields() -> None:
    long = motion(steps=BITS_32, cycle_us=BITS_32, rpm=0, acc100=1047, wait_us=BITS_32, pulses=True)
    assert edit_lines(30, long) == ["q30m4294967295vc4294967295a10.47d1l0u0", "q30t4294967295ps0"]


def test_to_hold_a_position_takes_one_field() -> None:
    assert hold_line(7) == "q7s"


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"acc100": 0}, "expected an acceleration of 0.01 to 999"),
        ({"dec100": 10_050}, "without decimals from 100 on, got 100.5"),
        ({"wait_us": 2**32}, "expected a start wait of 0 to 4294967295, got 4294967296"),
        ({"steps": 2**32}, "expected steps of 0 to"),
        ({"extra_pulses": 256}, "expected extra pulses of 0 to 255, got 256"),
    ],
)
def test_what_no_line_can_say_is_refused(fields: dict[str, int], told: str) -> None:
    with pytest.raises(BadRequest, match=f"queue position 9: .*{told}"):
        edit_lines(9, motion(**fields))


def test_a_position_that_is_none_is_refused() -> None:
    with pytest.raises(BadRequest, match="queue position 31: expected 1 to 30"):
        edit_lines(31, motion())
