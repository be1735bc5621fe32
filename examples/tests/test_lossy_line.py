"""A line that loses bytes: what mother's transactions see to, and what a program must see to."""

from __future__ import annotations

import pytest

from sacbus.mother import MotherError, NoAnswer, UnknownOutcome
from sacbus.testing import VirtualBus


@pytest.mark.sacbus(nodes="10-12", seed=3)
def test_a_queue_gets_through_a_line_that_loses_one_byte_in_a_hundred(bus: VirtualBus) -> None:
    with bus.fault(drop=0.01) as loss:
        for node in bus.nodes.values():
            for position in range(1, 6):
                line = f"q{position}m{position}00v120a2d2"
                # An edit may be said again: mother does that three times, we for as long as needed.
                while True:
                    try:
                        node.send(line)
                    except MotherError:
                        continue
                    break
        assert loss.count > 0
    assert bus.counts["retries"] > 0

    for node in bus.nodes.values():
        for line in "ls1", "ln1", "lf5":
            node.send(line)
    bus.expect(node="all", position=1500, state="STANDBY", within="10 s")


@pytest.mark.sacbus(nodes=10)
def test_a_motion_is_never_sent_twice_unless_the_program_says_so(bus: VirtualBus) -> None:
    # The node's answers get lost: it moves, and nobody can know.
    with bus.fault(cut={"beyond": [10]}), pytest.raises((NoAnswer, UnknownOutcome)):
        bus.send(10, "m100")
    assert bus.counts["retries"] == 0
