"""The companion's queue, loaded into a node and looped: to the tick what ``sacbus plan`` says."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from sacbus.cli import run
from sacbus.kernel import SECOND, US, Ns
from sacbus.language import Edit, EditQueue
from sacbus.language.queue_file import QueueRow, read_rows
from sacbus.mother import safe_body
from tests.nodes.sac.bench import Bench, packet

FILE = Path(__file__).parents[2] / "data" / "companion-queue.txt"


def rows() -> list[QueueRow]:
    lines = FILE.read_text(encoding="utf-8").splitlines()
    return [read.row for read in read_rows(lines, FILE.name)]


def edit(row: QueueRow) -> str:
    """The line that puts a row into its position, every attribute of it."""
    motion = row.motion
    return EditQueue(
        row.position,
        Edit(
            opposite=not motion.cw,
            steps=motion.steps,
            cycle_us=motion.cycle_us,
            acc100=motion.acc100,
            dec100=motion.dec100,
            linear=motion.linear,
            extra_pulses=motion.extra_pulses,
            wait_us=motion.wait_us,
            sync=motion.sync,
            pulses=motion.pulses,
        ),
    ).text()


def planned(capsys: pytest.CaptureFixture[str], loops: int) -> dict[str, Any]:
    arguments = ["plan", "--queue", str(FILE), "--loop", str(loops), "--json"]
    assert run(arguments) == 0
    report: dict[str, Any] = json.loads(capsys.readouterr().out)
    return report


def begun(bench: Bench) -> Iterator[tuple[Ns, Ns]]:
    """When each command of the node begins and ends."""
    engine, last = bench.node.board.engine, None
    while bench.kernel.run_next():
        if engine.profile is not None and engine.started != last:
            last = engine.started
            assert last is not None
            assert engine.end is not None
            yield last, engine.end


@pytest.mark.slow
def test_looped_by_la_its_commands_begin_and_end_as_planned(
    capsys: pytest.CaptureFixture[str],
) -> None:
    loops = 2
    plan = planned(capsys, loops)
    bench = Bench()
    for row in rows():
        bench.kernel.run_until(bench.kernel.now + 50 * 1_000_000)
        bench.sends(packet(safe_body(edit(row).encode())), at=bench.kernel.now)
    bench.kernel.run_until(bench.kernel.now + SECOND)
    assert list(bench.node.board.commands.queue.rows()) == [row.motion for row in rows()]
    bench.hears(f"ln{loops}", at=bench.kernel.now + SECOND)
    bench.hears("la", at=bench.kernel.now + SECOND)
    times = list(begun(bench))
    assert len(times) == len(plan["commands"]) == 30 * loops
    first = times[0][0] - int(plan["commands"][0]["start_us"] * US)
    for (start, end), command in zip(times, plan["commands"], strict=True):
        assert start - first == command["start_us"] * US
        assert end - start == command["duration_us"] * US
    assert times[-1][1] - first == plan["duration_us"] * US
    assert bench.snapshot(bench.kernel.now).state == "STANDBY"
    assert bench.position(bench.kernel.now) == loops * sum(
        (row.motion.steps or 0) * (1 if row.motion.cw else -1) for row in rows()
    )
