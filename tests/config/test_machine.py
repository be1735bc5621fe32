"""Machine files: what comes out of one, and every mistake by its key and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.config import ConfigError
from sacbus.config.keys import Key
from sacbus.config.machine import AXIS, MACHINE, read_machine
from sacbus.motion import Drive
from sacbus.toolpath import Axis, Machine

EXAMPLE = Path(__file__).parents[2] / "examples" / "router.toml"
PAGE = Path(__file__).parents[2] / "docs" / "gcode.md"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "m.toml"


def mistakes(file: Path, text: str) -> list[str]:
    file.write_text(text)
    with pytest.raises(ConfigError) as wrong:
        read_machine(file)
    return [str(one).replace(str(file), "m.toml") for one in wrong.value.mistakes]


def test_the_least_machine_is_an_axis(file: Path) -> None:
    file.write_text('[[axis]]\nname = "X"\nnode = 10\nsteps_per_mm = 400\n')
    assert read_machine(file) == Machine((Axis("X", 10, 400),))


def test_everything_that_is_given_arrives(file: Path) -> None:
    file.write_text(
        """
        rapid = 1200.5
        feed = 99
        acceleration = 12.5
        tolerance = 0.002
        [[axis]]
        name = "X"
        node = 10
        steps_per_mm = 0.5
        inverted = true
        max_rpm = 900
        max_acceleration = 30
        jump_rpm = 25
        ustep = 4
        sprf = 400
        slow = 12
        [[axis]]
        name = "A"
        node = 4
        steps_per_mm = 3
        """
    )
    drive = Drive(sprf=400, slow_rpm=12, ustep=4)
    first = Axis("X", 10, 0.5, True, 900, 30, 25, drive)
    assert read_machine(file) == Machine((first, Axis("A", 4, 3)), 1200.5, 99, 12.5, 0.002)


def test_the_example_is_a_machine() -> None:
    machine = read_machine(EXAMPLE)
    assert [(axis.name, axis.node) for axis in machine.axes] == [("X", 10), ("Y", 11), ("Z", 12)]


def test_all_mistakes_are_told_with_their_lines(file: Path) -> None:
    assert mistakes(
        file,
        """feed = -1
toleranse = 0.1
[[axis]]
name = "Q"
node = 3
steps_per_mm = "many"
[[axis]]
name = "X"
node = 10
steps_per_mm = 100
max_rpm = 1.5
[[axis]]
name = "X"
node = 10
steps_per_mm = 100
""",
    ) == [
        (
            "feed: expected a number from 0.1 to 100000, got -1, m.toml:1, "
            "correct it, or leave it out for 300.0"
        ),
        "toleranse: unknown key, m.toml:2, did you mean 'tolerance'?",
        "axis[0].name: expected one of X, Y, Z, A, B, C, U, V, W, got 'Q', m.toml:4, correct it",
        "axis[0].node: expected a whole number from 4 to 255, got 3, m.toml:5, correct it",
        (
            "axis[0].steps_per_mm: expected a number from 0.001 to 1e+06, got 'many', m.toml:6, "
            "correct it"
        ),
        (
            "axis[1].max_rpm: expected a whole number from 1 to 10000, got 1.5, m.toml:11, "
            "correct it, or leave it out for 300"
        ),
        (
            "axis[2].name: expected each axis's own name, got X as in line 7, m.toml:13, "
            "give it another"
        ),
        (
            "axis[2].node: expected each axis's own node, got 10 as in line 7, m.toml:14, "
            "give it another"
        ),
    ]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "expected axis (one [[axis]] at least), got none, m.toml, give one"),
        ("axis = []", "axis: expected one [[axis]] at least, got none, m.toml:1, add one"),
        (
            '[axis]\nname = "X"\nnode = 10\nsteps_per_mm = 1',
            "axis: expected tables under [[axis]], got one table, m.toml:1, write [[axis]]",
        ),
    ],
)
def test_a_machine_has_axes(file: Path, text: str, told: str) -> None:
    assert mistakes(file, text) == [told]


def test_the_page_has_every_key_with_what_it_takes_and_its_default() -> None:
    page = PAGE.read_text()
    for key in (*MACHINE, *AXIS):
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{key.name}` |")]
        assert key.help in row
        assert (key.otherwise or _shown(key)) in row


def _shown(key: Key) -> str:
    if key.required:
        return "required"
    return f"{key.default:g}" if isinstance(key.default, float) else str(key.default).lower()
