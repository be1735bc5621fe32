"""From one command to the next: what the motor meets there, as warnings.

Owns their wording, for the plan of a sequence and for a node that runs one. What a command asks by
itself is in limits.py. The next command is obeyed all the same.
Source: manual, "Slow speed" (it is the speed of a change of direction), the xRef array (with 999 a
change of direction is simply executed); spec, "Truncation" (what a truncated command hands on).
"""

from sacbus.motion.profile import Profile


def transition_warnings(before: Profile, after: Profile) -> tuple[str, ...]:
    """What happens where ``after`` begins at the velocity that ``before`` has kept.

    Nothing if it is lost, or nothing was kept. Words say what the motor does at that instant.
    """
    if not after.start_rpm or before.duration is None:
        return ()
    turns = before.motion.cw is not after.motion.cw
    jumps = before.shares.truncated and _goes_on(after)
    if not (turns or jumps):
        return ()
    kept = float(before.kept_rpm)
    # A command that is cut short by its steps keeps the velocity that it was to reach.
    real = kept
    if before.shares.truncated:
        real = round(before.velocity_at(before.duration - 1), 2)
    found: list[str] = []
    if turns and real > before.drive.slow_rpm:
        found.append(f"turns at once from {real:g} RPM: nothing slows it down")
    if jumps and kept != real:
        at = "only" if real < kept else "still"
        found.append(f"goes on from {kept:g} RPM, though the motor was {at} at {real:g}")
    return tuple(found)


def _goes_on(after: Profile) -> bool:
    """Whether it begins at what was kept: not at a velocity of its own, or with deceleration."""
    return after.shares.acc > 0 or (
        after.shares.cruise != 0 and after.motion.rpm == after.start_rpm
    )
