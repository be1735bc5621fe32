"""A queue position written by edits: what one is to hold, as lines that a packet carries.

Owns how a motion becomes edits that leave nothing of what stood there before: every field is named.
Edits may be repeated without harm, so this is how mother loads a node.
Source: spec, mother ("Transactions": an edit over 44 bytes is split), commands ("Queue").
"""

from __future__ import annotations

from typing import Final

from sacbus.language import NO_RAMP, QUEUE_LENGTH, Defaults, Edit, Motion
from sacbus.language.queue_file import BITS_32, EXTRA_MAX
from sacbus.mother.errors import BadRequest

__all__ = ["LONGEST_EDIT", "edit_lines", "hold_line"]

#: Bytes of an edit (spec): 46 fit a device, less the space that its CRC may need, and one to spare.
LONGEST_EDIT: Final = 44

_FACTORY: Final = Defaults()


def edit_lines(
    position: int,
    motion: Motion,
    defaults: Defaults = _FACTORY,
    *,
    before: Motion | None = None,
) -> list[str]:
    """The edits, in order, after which ``position`` (1 to 30) holds just this motion.

    ``defaults`` are the node's: its default direction, which a command without a sign has, and its
    sprf, by which RPM and cycle follow each other. Mostly one line; what is longer than
    ``LONGEST_EDIT`` is several. Whether it is held for sync is always said last: a position that is
    held stays so until all else is in it. ``before``: what it holds for certain, since it was
    written by these very edits; then only what differs is named, nothing at all if nothing does.
    Else every field is. :class:`BadRequest` for what no line can say.
    """
    _check(position, motion)
    parts = _parts(motion, defaults) if before is None else _changes(motion, before, defaults)
    if not parts:
        return []
    lines = [f"q{position}"]
    for text in (part.text() for part in parts):
        if len(lines[-1]) + len(text) > LONGEST_EDIT:
            lines.append(f"q{position}")
        lines[-1] += text
    return lines


def _parts(motion: Motion, defaults: Defaults) -> list[Edit]:
    """Every field, one by one."""
    return [
        Edit(opposite=motion.cw is not defaults.cw, steps=motion.steps or 0),
        _velocity(motion, defaults),
        Edit(acc100=motion.acc100),
        Edit(dec100=motion.dec100),
        Edit(linear=motion.linear),
        Edit(extra_pulses=motion.extra_pulses),
        Edit(wait_us=motion.wait_us),
        # Behind the steps, in whichever line: steps alone are full ones.
        Edit(pulses=motion.pulses),
        Edit(sync=motion.sync),
    ]


def _changes(motion: Motion, before: Motion, defaults: Defaults) -> list[Edit]:
    """The fields that differ, in the order of :func:`_parts`."""
    changes: list[Edit] = []
    steps_differ = motion.steps != before.steps or motion.cw is not before.cw
    if steps_differ:
        changes.append(Edit(opposite=motion.cw is not defaults.cw, steps=motion.steps or 0))
    if motion.cycle_us != before.cycle_us or motion.rpm != before.rpm:
        changes.append(_velocity(motion, defaults))
    if motion.acc100 != before.acc100:
        changes.append(Edit(acc100=motion.acc100))
    if motion.dec100 != before.dec100:
        changes.append(Edit(dec100=motion.dec100))
    if motion.linear is not before.linear:
        changes.append(Edit(linear=motion.linear))
    if motion.extra_pulses != before.extra_pulses:
        changes.append(Edit(extra_pulses=motion.extra_pulses))
    if motion.wait_us != before.wait_us:
        changes.append(Edit(wait_us=motion.wait_us))
    if motion.pulses if steps_differ else motion.pulses is not before.pulses:
        changes.append(Edit(pulses=motion.pulses))
    if motion.sync is not before.sync:
        changes.append(Edit(sync=motion.sync))
    return changes


def _velocity(motion: Motion, defaults: Defaults) -> Edit:
    """As RPM where that gives this very cycle, as v100 gives 3000 us."""
    by_rpm = defaults.says(motion.rpm, motion.cycle_us)
    return Edit(rpm=motion.rpm) if by_rpm else Edit(cycle_us=motion.cycle_us)


def _check(position: int, motion: Motion) -> None:
    """Refuse what the language has no words for: the device would hold something else."""
    if not 1 <= position <= QUEUE_LENGTH:
        raise BadRequest(f"queue position {position}: expected 1 to {QUEUE_LENGTH}")
    for name, value, most in (
        ("steps", motion.steps or 0, BITS_32),
        ("a cycle", motion.cycle_us, BITS_32),
        ("a start wait", motion.wait_us, BITS_32),
        ("extra pulses", motion.extra_pulses, EXTRA_MAX),
    ):
        if not 0 <= value <= most:
            raise BadRequest(
                f"queue position {position}: expected {name} of 0 to {most}, got {value}"
            )
    for acc100 in (motion.acc100, motion.dec100):
        # Two decimals below 100, whole numbers above.
        if not 1 <= acc100 <= NO_RAMP or (acc100 >= 100_00 and acc100 % 100):
            raise BadRequest(
                f"queue position {position}: expected an acceleration of 0.01 to 999, without "
                f"decimals from 100 on, got {acc100 / 100}"
            )


def hold_line(position: int) -> str:
    """The edit after which whatever stands in ``position`` is held for sync."""
    return f"q{position}{Edit(sync=True).text()}"
