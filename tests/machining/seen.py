"""What a recording shows of a part program that was run: held against its listing."""

from __future__ import annotations

import re
from collections.abc import Sequence

from sacbus.kernel import US
from sacbus.trace import Recording

__all__ = ["Listed", "check_that_it_ran_as_listed", "listed"]

#: The commands of a listing by block and node.
Listed = Sequence[dict[int, list[str]]]

#: A command of fewer steps says when they come, rather than how fast the axis is.
FEW = 4

RESTING = {"STANDBY", "SYNC", "STOP"}


def listed(text: str) -> Listed:
    """What stands in a listing."""
    blocks: list[dict[int, list[str]]] = []
    for line in text.splitlines():
        if line.startswith("# block"):
            blocks.append({})
        elif not line.startswith("#"):
            node, _, command = line.partition(" ")
            blocks[-1].setdefault(int(node), []).append(command)
    return blocks


def check_that_it_ran_as_listed(recording: Recording, blocks: Listed, jump: float) -> None:
    """Every command in its order, all axes of a block from one instant on, and none with a gap.

    So no queue was ever empty before its time, and no position written over before its command was
    loaded. ``jump``: RPM that the velocity changes by from one command to the next, at most.
    """
    nodes = sorted({node for block in blocks for node in block})
    tracks = {node: recording.track(node) for node in nodes}
    ran = {
        node: iter([one for one in track.segments if one.started is not None])
        for node, track in tracks.items()
    }
    for block in blocks:
        released = set()
        for node, commands in block.items():
            track, before = tracks[node], None
            for number, command in enumerate(commands):
                segment = next(ran[node])
                assert segment.started is not None
                assert segment.command.startswith(command.partition("v")[0] + "v")
                wait = re.search("t([0-9]+)", command)
                waited = 0 if wait is None else int(wait[1]) * 1000
                if before is None:
                    released.add(segment.started - waited)
                elif not waited:
                    # It begins in the very instant in which the one before ends, at its velocity.
                    # One of less than 1 RPM is 0 to the device: what follows begins as from rest.
                    assert before.end is not None
                    left, taken_up = track.rpm(before.end - 1), track.rpm(segment.started)
                    assert segment.started == before.end + (16 * US if abs(left) < 1 else 0)
                    if min(_count(commands[number - 1]), _count(command)) >= FEW:
                        assert abs(taken_up - left) <= jump
                if number < len(commands) - 1:
                    assert segment.end is not None
                    assert track.state(segment.end - 1) not in RESTING
                before = segment
        assert len(released) == 1 or not block
    assert not [segment for rest in ran.values() for segment in rest]


def _count(command: str) -> int:
    return int(re.split("[a-z]-?", command)[1])
