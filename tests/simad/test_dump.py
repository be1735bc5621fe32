"""Dumps of the lines: written, and read whoever wrote them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings

from sacbus.simad import Decoder, Edges, SimadError, Steps, decode, encode, merge
from sacbus.simad import dump as dump_file
from sacbus.simad.dump import read_dump, wire_names, write_dump
from sacbus.simad.edges import UNKNOWN
from sacbus.simad.steps import joined
from tests.simad.random_steps import random_steps
from tests.simad.reference import Due
from tests.simad.strategies import streams
from tests.simad.test_encoder import encoded
from tests.trace.rig import Dump

NAMES = ("10", "11", "12", "13", "14")


def written(parts: Sequence[Edges], names: Sequence[str], since: int = 0, end: int = 0) -> bytes:
    out = BytesIO()
    write_dump(parts, out, names, since, end)
    return out.getvalue()


def read(dump: bytes, direction: str = "", steps: Sequence[str] = ()) -> tuple[Steps, list[str]]:
    wires, parts = read_dump(BytesIO(dump), direction, steps)
    decoder = Decoder(UNKNOWN, UNKNOWN)
    return joined([decoder.take(part) for part in parts]), list(wires.axes)


def same(one: Steps, other: Steps) -> bool:
    return (
        np.array_equal(one.times, other.times)
        and np.array_equal(one.axes, other.axes)
        and np.array_equal(one.directions, other.directions)
    )


@pytest.mark.slow
@settings(max_examples=100)
@given(streams())
def test_what_is_written_is_read_again(steps: list[Due]) -> None:
    coded = encoded(steps)
    dump = written([coded.edges], NAMES)
    found, axes = read(dump)
    assert axes == list(NAMES)
    assert same(found, decode(coded.edges))
    # And by an independent reader, edge for edge.
    independent = Dump(dump.decode())
    assert independent.timescale == "1 ns"
    for line, name in enumerate(wire_names(NAMES)):
        times, levels = coded.edges.of_line(line)
        (when, level), *rest = independent.edges[f"simad.{name}"]
        assert (when, int(level)) == (0, coded.edges.direction if line == 0 else 1)
        assert rest == list(zip(times.tolist(), map(str, levels.tolist()), strict=True))


def test_pieces_make_no_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    edges = encode(random_steps(5, 4, 500), 4).edges
    whole = written([edges], NAMES[:4])
    cuts = [0, 1, 2, 300, 300, edges.count]
    parts = []
    for a, b in pairwise(cuts):
        turned = np.flatnonzero(edges.lines[:a] == 0)
        level = int(edges.levels[turned[-1]]) if turned.size else edges.direction
        parts.append(Edges(edges.times[a:b], edges.lines[a:b], edges.levels[a:b], level))
    assert written(parts, NAMES[:4]) == whole
    found = read(whole)[0]
    monkeypatch.setattr(dump_file, "PIECE", 10)
    monkeypatch.setattr(dump_file, "BYTES", 7)
    assert same(read(whole)[0], found)
    _, read_parts = read_dump(BytesIO(whole))
    several = list(read_parts)
    assert len(several) > 50
    assert all(a.times[-1] < b.times[0] for a, b in pairwise(several))


def test_it_begins_and_ends_when_it_is_told() -> None:
    edges = encode(merge([[5_000]], [1]), 1).edges
    dump = Dump(written([edges], ["X"], since=1_000, end=9_000).decode())
    assert dump.edges["simad.step_X"][0] == (1_000, "1")
    assert dump.end == 9_000
    assert Dump(written([edges], ["X"], end=3_000).decode()).end == 5_500
    assert Dump(written([], ["X"], end=3_000).decode()).edges["simad.dir"] == [(0, "1")]


def test_a_hundred_axes_have_wires_of_their_own() -> None:
    steps = merge([[1_000 * axis] for axis in range(255)], [1] * 255)
    dump = written([encode(steps, 255).edges], [f"a b{axis}" for axis in range(255)])
    found, axes = read(dump)
    assert found.axes.tolist() == list(range(255))
    assert axes[7] == "a_b7"


OTHERS = b"""$date now $end
$comment by somebody else $end
$timescale %s $end
$scope module top $end
$scope module cable $end
$var wire 1 ab D0 $end
$var wire 1 b D1 [0] $end
$var reg 8 c bus [7:0] $end
$var wire 1 d D2 $end
$var real 64 e volts $end
$upscope $end
$upscope $end
$enddefinitions $end
$dumpvars xab xb bx c zd r0.0 e $end
#0 1b 1d b0101 c
#10 1ab
$comment 0b 0b $end
#20 0b r1.5 e
#21 1b b1 b
#30 0ab #40 0d #41 1d
"""

#: Its wires of one bit.
THERE = "top.cable.D0, top.cable.D1, top.cable.D2"


@pytest.mark.parametrize(
    ("scale", "times"),
    [
        (b"1 ns", [20, 40]),
        (b"10us", [200_000, 400_000]),
        (b"1\n  ms", [20_000_000, 40_000_000]),
        (b"100 ps", [2, 4]),
    ],
)
def test_what_others_write_is_read_at_any_time_scale(scale: bytes, times: list[int]) -> None:
    found, axes = read(OTHERS % scale, "D0", ("D1", "top.cable.D2"))
    assert axes == ["D1", "D2"]
    assert found.times.tolist() == times
    assert found.axes.tolist() == [0, 1]
    assert found.directions.tolist() == [1, -1]


def test_wires_are_found_in_the_scope_that_has_dir_and_steps() -> None:
    text = OTHERS % b"1 ns"
    ours = text.replace(b"D0", b"DIR").replace(b"D1", b"StepX").replace(b"D2", b"step_2")
    # A node's own dir is none of the lines.
    node = b"$scope module node_10 $end\n$var wire 1 z dir $end\n$upscope $end\n$enddefinitions"
    found, axes = read(ours.replace(b"$enddefinitions", node))
    assert axes == ["StepX", "2"]
    assert found.count == 2


@pytest.mark.parametrize(
    ("dump", "wires", "told"),
    [
        (b"", (), "expected a value change dump, got no $enddefinitions"),
        (b"time,axis\n1,2\n", (), "expected a value change dump, got no $enddefinitions"),
        (b"$date today", (), "expected $end, got the end of the file"),
        (b"$enddefinitions $end", (), "expected a $timescale before $enddefinitions, got none"),
        (
            OTHERS % b"3 ns",
            (),
            "$timescale: expected one such as 1 ns or 100 ps, got '3 ns'",
        ),
        (
            OTHERS % b"1 ns",
            (),
            f"expected one scope with wires dir and step_..., got 0, name the wires, of {THERE}",
        ),
        (
            OTHERS % b"1 ns",
            ("D0", "D7"),
            f"expected one wire 'D7', got 0, of {THERE}",
        ),
        (
            OTHERS % b"1 ns",
            ("D0", "D0"),
            "expected wires of their own, got one twice in top.cable.D0, top.cable.D0",
        ),
        (
            (OTHERS % b"1 ns").replace(b"#30", b"#19"),
            ("D0", "D1"),
            "expected a time no earlier than #21, got #19",
        ),
        (
            (OTHERS % b"1 ns").replace(b"#30", b"#3x"),
            ("D0", "D1"),
            "expected a time such as #100, got '#3x'",
        ),
        (
            (OTHERS % b"100 s").replace(b"#4", b"#45000"),
            ("D0", "D2"),
            "expected times up to 52 days, got #450001",
        ),
    ],
)
def test_what_is_no_dump_of_lines_is_refused(
    dump: bytes, wires: tuple[str, ...], told: str
) -> None:
    with pytest.raises(SimadError) as refused:
        read(dump, wires[0] if wires else "", wires[1:])
    assert str(refused.value) == told


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed")
def test_sigrok_reads_it_and_what_it_writes_is_read(tmp_path: Path) -> None:
    coded = encode(random_steps(9, 3, 40), 3)
    path = tmp_path / "lines.vcd"
    path.write_bytes(written([coded.edges], ["X", "Y", "Z"]))
    # A sample every 100 ns: no level is shorter than five of them.
    seen = tmp_path / "seen.vcd"
    command = ["sigrok-cli", "-I", "vcd:downsample=100", "-i", str(path)]
    command += ["-O", "vcd", "-o", str(seen)]
    subprocess.run(command, check=True)
    again, axes = read(seen.read_bytes())
    assert axes == ["X", "Y", "Z"]
    for axis in range(3):
        times, ways = again.of_axis(axis)
        mine = decode(coded.edges).of_axis(axis)
        assert ways.tolist() == mine[1].tolist()
        assert np.abs(times - mine[0]).max() <= 100
