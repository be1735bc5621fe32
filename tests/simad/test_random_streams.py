"""Many steps of machines at random: the figures that the announcement promises, on every edge."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest

from sacbus.simad import Timing, decode, encode
from sacbus.simad.dump import write_dump
from tests.simad.random_steps import random_steps
from tests.simad.reference import as_tuples, broken_rules
from tests.trace.rig import Dump

pytestmark = pytest.mark.slow

#: The benchmark does the same with ten million.
STEPS = 100_000


@pytest.mark.parametrize("axes", range(2, 9))
def test_random_axes_are_decoded_to_what_was_encoded_and_keep_the_rules(axes: int) -> None:
    steps = random_steps(100 + axes, axes, STEPS)
    coded = encode(steps, axes)
    assert broken_rules(as_tuples(coded.edges), Timing()) == []
    decoded = decode(coded.edges)
    assert decoded.count == STEPS
    for axis in range(axes):
        due, ways = steps.of_axis(axis)
        fell, again = decoded.of_axis(axis)
        assert np.array_equal(ways, again)
        late = fell - due
        told = coded.report.axes[axis]
        assert 0 <= late.min() <= late.max() == told.delay_max <= 1_000_000
        assert told.moved == np.count_nonzero(late) > 0
        assert told.delay_mean == pytest.approx(late.mean())
        assert told.delay_rms == pytest.approx(np.sqrt((late.astype(float) ** 2).mean()))
    assert (coded.report.lines, coded.report.lines_without) == (axes + 1, 2 * axes)


@pytest.mark.parametrize("axes", [4, 6])
def test_their_dump_keeps_the_rules_for_an_independent_reader(axes: int) -> None:
    steps = random_steps(200 + axes, axes, STEPS // 4)
    coded = encode(steps, axes)
    out = BytesIO()
    names = [str(axis) for axis in range(axes)]
    write_dump([coded.edges], out, names)
    dump = Dump(out.getvalue().decode())
    lines = ["simad.dir", *(f"simad.step_{name}" for name in names)]
    assert set(dump.edges) == set(lines)
    assert {dump.edges[name][0][1] for name in lines[1:]} == {"1"}
    # DIR behind the step lines at one instant, as it may turn once they are high.
    edges = sorted(
        (when, line or 999, int(level))
        for line, name in enumerate(lines)
        for when, level in dump.edges[name][1:]
    )
    level = int(dump.edges["simad.dir"][0][1])
    assert broken_rules([(when, line % 999, to) for when, line, to in edges], Timing()) == []
    ways: list[list[int]] = [[] for _ in names]
    for _, line, to in edges:
        if line == 999:
            level = to
        elif to == 0:
            ways[line - 1].append(1 if level else -1)
    for axis in range(axes):
        assert ways[axis] == steps.of_axis(axis)[1].tolist()
