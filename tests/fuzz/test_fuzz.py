"""The fuzz itself: a short run of it, and that it would tell of what it looks for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from nodes.sac.board import SacBoard
from tests.fuzz.__main__ import main
from tests.fuzz.lines import Lines
from tests.fuzz.world import World

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_some_ten_thousand_lines_raise_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--lines", "10000", "--seed", "1", "--jobs", "1"]) == 0
    begin, end = capsys.readouterr().out.splitlines()
    assert begin == "seed 1: 10,000 lines"
    assert end.startswith("seed 1: ")


@pytest.mark.slow
def test_lines_come_through_both_ports_and_most_are_obeyed() -> None:
    world = World(2)
    packets = [0] * len(world.nodes)
    for _ in range(200):
        before = [node.board.network for node in world.nodes]
        counted = [network.packets for network in before]
        world.go_on(20)
        for place, network in enumerate(before):
            packets[place] += network.packets - counted[place]
    assert world.typed > 1_500
    assert world.sent > 1_000
    assert sum(packets) > world.sent / 2
    assert min(packets) > 0
    assert sum(bus.report_counts["refused"] for bus in world.buses) < world.lines / 2
    assert world.shown > 10 * world.typed


@pytest.mark.slow
def test_a_seed_gives_the_same_run_again_in_whatever_portions() -> None:
    one, other = World(3), World(3)
    one.go_on(2_000)
    while other.lines < one.lines:
        other.go_on(1)
    assert list(one.deeds) == list(other.deeds)
    assert one.shown == other.shown
    now = one.kernel.now
    assert now == other.kernel.now
    assert [node.snapshot(now) for node in one.nodes] == [
        node.snapshot(now) for node in other.nodes
    ]


def test_lines_are_of_every_kind() -> None:
    lines = Lines(Random(4))
    drawn = [lines.next() for _ in range(3_000)]
    assert len(set(drawn)) > 2_000
    assert max(map(len, drawn)) > 46
    assert {line[:1] for line in drawn} > {bytes((byte,)) for byte in b"mMxvadSsNnyqlLgbz$+-/ ."}


def test_what_raises_is_told_with_what_came_before_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(self: SacBoard, line: bytes, now: int) -> None:
        raise ZeroDivisionError("on purpose")

    monkeypatch.setattr(SacBoard, "line_typed", breaks)
    assert main(["--lines", "20000", "--seed", "5", "--jobs", "1"]) == 1
    told = capsys.readouterr().out.splitlines()
    assert "ZeroDivisionError: on purpose" in told
    assert any("--seed 5 --jobs 1; what was done last" in line for line in told)
    assert told[-1].startswith("    ('type', ")


@pytest.mark.slow
def test_growing_memory_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[list[bytes]] = []
    shown = World._shown

    def keeps(self: World, text: bytes) -> None:
        shown(self, text)
        kept.extend([text] for _ in range(100))

    monkeypatch.setattr(World, "_shown", keeps)
    assert main(["--lines", "4000", "--seed", "6", "--jobs", "1"]) == 1
    assert capsys.readouterr().out.splitlines()[-1].startswith("memory has grown: expected ")


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_ends_it_with_the_seed(jobs: int) -> None:
    command = [sys.executable, "-m", "tests.fuzz", "--seed", "7", "--jobs", str(jobs)]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as fuzz:
        assert fuzz.stdout is not None
        for _ in range(jobs):
            assert "lines" in fuzz.stdout.readline()
        os.killpg(fuzz.pid, signal.SIGINT)
        told = fuzz.stdout.read()
    assert fuzz.returncode == 130
    assert "--seed 7 --jobs 1" in told
