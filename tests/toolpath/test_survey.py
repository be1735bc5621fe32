"""The survey of a path."""

from __future__ import annotations

import pytest

from sacbus.toolpath import Block, Deviation, Dwell, PathItem, Straight, Survey
from tests.toolpath.paths import COMMAND_SECONDS, circle, moved, planned, straights


def test_a_survey_adds_up_what_blocks_say() -> None:
    items: list[PathItem] = [
        *straights([(5, 0, 0), (5, 5, 0)]),
        Dwell(1.5, 3),
        Straight((0.0, 0.0, 0.0), 60, 4),
    ]
    survey = Survey()
    blocks = planned(items)
    for block in blocks:
        survey.add(block)
    assert survey.blocks == len(blocks)
    assert survey.commands == sum(len(run.motions) for block in blocks for run in block.runs)
    assert survey.length == pytest.approx(10 + 50**0.5)
    assert survey.asked == pytest.approx(20 + 50**0.5)
    assert survey.planned == pytest.approx(sum(block.duration for block in blocks) / 2e6)
    assert survey.dwell == 1.5
    assert survey.line == 4
    assert tuple(survey.steps.get(axis, 0) for axis in range(3)) == moved(blocks)


def test_a_survey_tells_by_how_much_feeds_were_lowered_and_how_often_for_what() -> None:
    survey = Survey()
    arc = list(circle(3, 400))[:60]
    blocks = planned(straights(arc, 60), join_steps=-1, command_seconds=4 * COMMAND_SECONDS)
    for block in blocks:
        survey.add(block)
    told = [block for block in blocks if block.lowered_by]
    assert survey.lowered == max(block.lowered for block in told)
    assert sum(survey.reasons.values()) == len(told)


def test_a_survey_keeps_the_worst_deviation() -> None:
    survey = Survey()
    for mm in (0.001, 0.003, 0.002):
        survey.add(Block((), 0, Deviation(mm, mm * 400, f"{mm}"), length=1.0, asked=1.0))
    assert survey.deviation == Deviation(0.003, 1.2, "0.003")
