"""Planned lines in real nodes on the virtual bus: loaded by edits, held, released by one `y`."""

from __future__ import annotations

import json
from random import Random

import numpy as np
import pytest

from nodes.sac import KIND, SacNode, SacSettings
from sacbus.bus import Bus, Port
from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from sacbus.language import Move
from sacbus.mother import safe_body
from sacbus.movement import Watcher
from sacbus.toolpath import Axis, Block, Law, Machine, Phase, Pulses, deviation, follow, plan_line
from sacbus.trace.records import NodeOf
from sacbus.trace.track import Track
from sacbus.wire import GENERAL_CALL, MOTHER, encode
from tests.toolpath.lines import random_line

TICK: Ns = 500
#: Between two packets: a node answers within that.
PACE: Ns = 30 * MS


class Machined:
    """A bus with a node for each axis of a machine; every pulse of every node is written down."""

    def __init__(self, machine: Machine) -> None:
        self.kernel = Kernel()
        self.machine = machine
        self.bus = Bus(self.kernel, KIND.protocol)
        self.tracks: list[Track] = []
        for axis in machine.axes:
            settings = SacSettings(ustep=axis.drive.ustep)
            node: SacNode = KIND.create(axis.node, settings, self.bus.rate, self.bus.tell)
            self.bus.add(node)
            track = Track(NodeOf(0, axis.node, "sac", {}))
            self.tracks.append(track)
            node.movement.watch(self._watcher(track), 0)
        self.port = Port(self.bus.medium, lambda _heard, _now: None, latency=0)

    def _watcher(self, track: Track) -> Watcher:
        def told(now: Ns, shape: str, values: str) -> None:
            stored = KIND.shape(json.loads("{" + shape + "}"))
            track.segments.append(KIND.segment(now, stored, json.loads("{" + values + "}")))

        return told

    def say(self, node: int, line: str) -> None:
        """A packet, and time for its answer."""
        self.port.talk(encode(node, MOTHER, safe_body(line.encode())))
        self.kernel.run_until(self.kernel.now + PACE)

    def load(self, block: Block) -> None:
        """Every command into its place of the queue; the loop holds at the first."""
        for run in block.runs:
            node = self.machine.axes[run.axis].node
            for place, motion in enumerate(run.motions, start=1):
                move = Move(
                    steps=motion.steps,
                    opposite=not motion.cw,
                    cycle_us=motion.cycle_us,
                    acc100=motion.acc100,
                    dec100=motion.dec100,
                    linear=motion.linear,
                ).text()
                self.say(node, f"q{place}{move}")
                self.say(node, f"q{place}t{motion.wait_us}s{int(motion.sync)}")
            self.say(node, f"q{len(run.motions) + 1}s")
            self.say(node, "ls1")
            self.say(node, "lf30")

    def run(self, block: Block) -> Ns:
        """Release all; when that was said. Then wait until the block is over and held again."""
        data = encode(GENERAL_CALL, MOTHER, b"y")
        self.port.talk(data)
        released = self.kernel.now + self.bus.rate.span(len(data))
        self.kernel.run_until(released + block.duration * TICK + SECOND)
        return released

    def pulses(self, axis: int) -> list[int]:
        """All of one axis so far, in ns."""
        found: list[int] = self.tracks[axis].pulses(0, self.kernel.now).tolist()
        return found


def compare(machine: Machine, block: Block) -> None:
    """Run a block, and find every pulse of every node at the tick that was planned for it."""
    bench = Machined(machine)
    bench.load(block)
    assert not any(bench.pulses(axis) for axis in range(len(machine.axes)))
    said = bench.run(block)
    released: set[Ns] = set()
    for run in block.runs:
        axis = machine.axes[run.axis]
        planned = Pulses(axis, run).times(0, run.end) * TICK
        done = np.array(bench.pulses(run.axis), dtype=np.int64)
        assert done.size == planned.size
        released |= set((done - planned).tolist())
        position = bench.tracks[run.axis].steps(bench.kernel.now)
        assert position == (-run.steps if axis.inverted else run.steps)
    # All nodes heard the `y` at one instant, the end of the byte behind its ETX, and every pulse
    # of each came as long after it as was planned.
    assert len(released) == 1
    assert abs(released.pop() - said) < 600 * US


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_nodes_do_what_was_planned_pulse_for_pulse(seed: int) -> None:
    machine, steps, feed = random_line(Random(seed + 1_000))
    short = tuple(count // 10 or count for count in steps)
    compare(machine, plan_line(machine, short, max(feed, 300)))


def test_a_path_with_corners_reversals_and_rests_of_an_axis_too() -> None:
    machine = Machine((Axis("X", 10, 100.0), Axis("Y", 11, 100.0, inverted=True)))
    way = ((60, 0), (40, 30), (-20, 30), (-20, 0), (0, -25))
    law: Law = tuple(Phase(at, 0.0, 1.0, 3.0, 1.0, 1.0) for at in range(len(way)))
    runs = [
        follow(axis, index, [side[index] for side in way], law)
        for index, axis in enumerate(machine.axes)
    ]
    found = tuple(run for run in runs if run is not None)
    assert [run.steps for run in found] == [60, 35]
    far = deviation(machine, way, law, found)
    assert far.steps <= 1
    compare(machine, Block(found, max(run.end for run in found), far, 1.0, 1.0))
