"""Pictures of plans: what they say, and that they are the same file every time."""

from __future__ import annotations

import io
import re
from pathlib import Path

import matplotlib as mpl
import pytest

from sacbus.language import Defaults
from sacbus.motion import Drive
from sacbus.plan import Commands, Plan, PlanError, QueueFile, Spool
from sacbus.plan.picture import MOST_COMMANDS, SHADES, draw_plan

pytestmark = pytest.mark.slow

DATA = Path(__file__).parents[1] / "data"


def drawn(*lines: str, form: str = "svg", loops: int = 1, drive: Drive | None = None) -> bytes:
    plan = Plan(Commands(lines), drive or Drive(), loops=loops)
    file = io.BytesIO()
    draw_plan(plan, plan.survey(), file, form)
    return file.getvalue()


def words(picture: bytes) -> list[str]:
    """All that is written in an SVG."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", picture.decode())


def test_one_command_is_named_with_its_shares_and_all_three_axes() -> None:
    picture = drawn("m200v100a1d1")
    said = words(picture)
    assert "m200v100a1d1   90 + 20 + 90 steps, harmonic, 1.469006 s" in said
    assert {"velocity, RPM", "position, full steps", "pulses per second", "time, s"} <= set(said)
    assert {"ACCEL", "CRUISE", "DECEL", "turns"} <= set(said)
    for shade in SHADES.values():
        assert shade in picture.decode()


def test_commands_are_named_where_they_run_and_directions_told() -> None:
    said = words(drawn("m200v100", "m-200", "m1"))
    assert "1: m200v100" in said
    assert "2: m-200" in said
    assert "3" in said  # too short for its text
    assert "CW up, CCW down" in said
    assert any(one.startswith("3 commands, ") for one in said)


def test_the_companions_queue_of_30_has_all_30_numbers() -> None:
    queue = DATA / "companion-queue.txt"
    with queue.open("rb") as given, Spool(given, queue.name) as kept:
        plan = Plan(QueueFile(kept, Defaults()), Drive())
        file = io.BytesIO()
        draw_plan(plan, plan.survey(), file, "svg")
    said = words(file.getvalue())
    numbers = [int(word) for word in said if word in map(str, range(1, 31))]
    assert set(range(1, 31)) <= set(numbers)
    assert "30 commands, 112.774451 s" in said


def test_of_very_many_commands_those_are_numbered_that_have_room() -> None:
    numbers = [int(word) for word in words(drawn("m20", loops=400)) if word.isdecimal()]
    assert 20 < sum(number > 100 for number in numbers) < 200


def test_an_endless_command_and_loops_are_told() -> None:
    assert "m-v50p   40 + endless + 0 pulses, harmonic" in words(drawn("m-v50p"))
    assert any(
        one.startswith("4 commands in 2 loops, ") for one in words(drawn("m9", "m8", loops=2))
    )


@pytest.mark.parametrize(
    ("line", "unit"), [("m3v600a999d999", "ms"), ("m9", "s"), ("m40000v10", "min"), ("m9v1", "s"),
                       ("m999999v60", "min"), ("m99999999v60", "h")]
)  # fmt: skip
def test_time_is_told_in_a_unit_that_suits_it(line: str, unit: str) -> None:
    assert f"time, {unit}" in words(drawn(line))


@pytest.mark.parametrize("form", ["png", "svg"])
def test_the_same_plan_is_the_same_file_whatever_the_users_settings(form: str) -> None:
    before = drawn("m200v100", "m-200l1", form=form)
    assert before.startswith(b"\x89PNG" if form == "png" else b"<?xml")
    with mpl.rc_context({"lines.linestyle": "--", "xtick.direction": "in", "font.size": 30}):
        mine = dict(mpl.rcParams)
        assert drawn("m200v100", "m-200l1", form=form) == before
        assert dict(mpl.rcParams) == mine
    assert not re.search(rb"20\d\d-\d\d|[Mm]atplotlib v", before)


def test_a_command_of_one_pulse_can_be_drawn_and_a_very_long_one() -> None:
    assert drawn("m1")
    assert drawn("m4294967295v600a.01d.01", drive=Drive(ustep=7), form="png")


def test_more_commands_than_can_be_seen_are_refused() -> None:
    with pytest.raises(PlanError, match="5001 commands are too many for a picture"):
        drawn("m1", loops=MOST_COMMANDS + 1)
