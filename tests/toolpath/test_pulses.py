"""The exact pulses of a run: times and places, for any span."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from sacbus.motion import Drive
from sacbus.toolpath import Axis, AxisRun, Law, Phase, Pulses, follow

LAW: Law = (Phase(0, 0.0, 1.0, 1.0, 1.0, 1.0), Phase(1, 0.0, 1.0, 1.0, 1.0, 1.0))


def run_of(axis: Axis, steps: list[int]) -> AxisRun:
    run = follow(axis, 0, steps, LAW)
    assert run is not None
    return run


@pytest.mark.parametrize("inverted", [False, True])
def test_times_and_places_of_a_way_there_and_back(inverted: bool) -> None:
    axis = Axis("X", 10, 100.0, inverted=inverted, drive=Drive(ustep=1))
    run = run_of(axis, [10, -5])
    pulses = Pulses(axis, run)
    assert pulses.count == 30
    times, places = pulses.times(0, run.end), pulses.places(0, run.end)
    assert times[0] == run.starts[0] == pytest.approx(0.025 * 2e6, abs=2)
    assert (np.diff(times) > 0).all()
    assert places.tolist() == [*np.arange(0.5, 10.5, 0.5), *np.arange(9.5, 4.5, -0.5)]
    assert [pulses.place_at(int(tick)) for tick in times] == places.tolist()
    assert pulses.place_at(int(times[0]) - 1) == 0


def test_spans_together_are_the_whole() -> None:
    axis = Axis("X", 10, 100.0)
    run = run_of(axis, [10, 20])
    pulses = Pulses(axis, run)
    cuts = [0, 1, run.starts[0], run.starts[0] + 1, run.starts[1], 3_000_000, run.end]
    spans = list(pairwise(cuts))
    for ask in (pulses.times, pulses.places):
        parts = np.concatenate([ask(*span) for span in spans])
        assert parts.tolist() == ask(0, run.end).tolist()
    assert pulses.times(0, 1).size == pulses.places(0, 1).size == 0


def test_with_auto_micro_a_pulse_is_as_many_microsteps_as_it_is() -> None:
    axis = Axis("X", 10, 100.0, max_rpm=600, drive=Drive(ustep=4, auto_micro=True))
    law: Law = (Phase(0, 0.0, 1.0, 0.5, 1.0, 1.0), Phase(1, 0.0, 1.0, 0.1, 1.0, 1.0))
    run = follow(axis, 0, [10, 100], law)
    assert run is not None
    pulses = Pulses(axis, run)
    assert pulses.count < 110 * 16
    assert pulses.places(0, run.end)[-1] == pulses.place_at(run.end) == 110
