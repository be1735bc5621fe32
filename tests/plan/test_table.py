"""Appendix D: every entry that the manual prints."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.motion import Drive
from sacbus.plan import plan_sequence
from sacbus.plan.table import (
    ACCELERATIONS,
    VELOCITIES,
    both_ramps,
    table_as_json,
    table_as_text,
)

QUOTED = Path(__file__).parents[1] / "data" / "appendix-d.tsv"
FACTORY = Drive()


def quoted() -> list[tuple[int, int, int]]:
    """(RPM, rad/s², steps) for each entry of the manual's table."""
    lines = [line.split("\t") for line in QUOTED.read_text(encoding="utf-8").splitlines()]
    rpm = [int(word) for word in lines[1][3:15]]
    return [
        (velocity, int(line[1]), int(steps))
        for line in lines[3:]
        for velocity, steps in zip(rpm, line[2:14], strict=True)
    ]


def test_the_manuals_table_is_quoted_whole() -> None:
    entries = quoted()
    assert len(entries) == 360
    assert [entry[0] for entry in entries[:12]] == list(VELOCITIES)
    assert [entry[1] for entry in entries[::12]] == list(ACCELERATIONS)
    assert (entries[0], entries[-1]) == ((50, 1, 872), (600, 30, 4188))


def test_all_360_entries_are_the_manuals() -> None:
    assert [both_ramps(rpm, acc, FACTORY) for rpm, acc, _ in quoted()] == [
        steps for _, _, steps in quoted()
    ]


def test_a_plans_two_ramps_are_the_entry_or_one_less() -> None:
    differences = set()
    for rpm, acc, steps in quoted():
        (planned,) = plan_sequence([f"m300000v{rpm}l1a{acc}d{acc}"], FACTORY)
        differences.add(steps - planned.profile.n_acc - planned.profile.n_dec)
    assert differences == {0, 1}


def test_the_text_has_the_manuals_rows_and_columns() -> None:
    lines = table_as_text(FACTORY)
    assert len(lines) == 33
    assert [int(word) for word in lines[1].split()[1:]] == list(VELOCITIES)
    assert lines[2].split()[1:3] == ["5.236", "10.472"]
    rows = [[int(word) for word in line.replace("rad/s²", "").split()] for line in lines[3:]]
    assert [row[0] for row in rows] == list(ACCELERATIONS)
    assert [steps for row in rows for steps in row[1:]] == [steps for _, _, steps in quoted()]


@pytest.mark.parametrize(
    ("drive", "steps", "title"),
    [
        # Manual, Appendix D: "for microstepping, multiply by the step factor".
        (Drive(ustep=3), 8 * 872, "pulses at 8 microsteps"),
        (Drive(sprf=400), 1_745, "400 steps per revolution"),
    ],
)
def test_microsteps_and_steps_a_revolution_count(drive: Drive, steps: int, title: str) -> None:
    assert both_ramps(50, 1, drive) == steps
    assert title in table_as_text(drive)[0]


def test_json_has_the_axes_with_the_entries() -> None:
    table = table_as_json(FACTORY)
    assert table["rpm"] == list(VELOCITIES)
    assert table["acc"] == list(ACCELERATIONS)
    assert table["steps"][0][0] == 872
    assert table["steps"][29][11] == 4_188
