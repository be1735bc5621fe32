"""Rows of the command queue: what fills one at the start, and what an edit makes of one.

Owns these rules. Values in, values out: where the rows are kept, and when an edit takes effect, is
the node's business.

Decisions where the manual is silent: an edit leaves what it does not name, so L alone changes the
ramp and not its acceleration or deceleration; a bare A or D is the system default of the ramp that
the row has after the edit, wherever L stood; M without a minus is the default direction, M without
steps leaves those.
Source: manual, "Queue", "V"; spec, "Queue".
"""

from __future__ import annotations

from .commands import Acceleration, Deceleration, Edit, Velocity
from .session import Defaults, Motion, Session

__all__ = ["cleared_row", "edited", "seeded_row"]


def edited(motion: Motion, edit: Edit, defaults: Defaults) -> Motion:
    """The motion of a queue position after an edit.

    RPM and cycle follow each other as for V. Steps are full steps unless the edit itself says
    ``p``, whatever the row was in (manual, "Queue": "these are full steps"); ``p`` or ``f`` alone
    leaves the number. 0 steps are continuous.
    """
    # The row's own values stand in for the session's, so that the rules of V, A and D are one.
    row = Session(
        motion.rpm,
        motion.cycle_us,
        motion.acc100,
        motion.dec100,
        motion.linear if edit.linear is None else edit.linear,
        defaults=defaults,
    )
    if edit.rpm is not None or edit.cycle_us is not None:
        row = row.with_velocity(Velocity(edit.rpm, edit.cycle_us))
    if edit.acc100 is not None:
        row = row.with_acceleration(Acceleration(edit.acc100))
    if edit.dec100 is not None:
        row = row.with_deceleration(Deceleration(edit.dec100))
    steps, pulses = motion.steps, motion.pulses
    if edit.steps is not None:
        steps, pulses = edit.steps or None, False
    return Motion(
        steps,
        motion.cw if edit.opposite is None else defaults.cw is not edit.opposite,
        row.rpm,
        row.cycle_us,
        row.acc100,
        row.dec100,
        row.linear,
        motion.extra_pulses if edit.extra_pulses is None else edit.extra_pulses,
        motion.wait_us if edit.wait_us is None else edit.wait_us,
        motion.sync if edit.sync is None else edit.sync,
        pulses if edit.pulses is None else edit.pulses,
    )


def cleared_row(session: Session) -> Motion:
    """What ``QC`` puts into every position: one revolution clockwise by the session defaults."""
    return Motion(
        session.defaults.sprf,
        cw=True,
        rpm=session.rpm,
        cycle_us=session.cycle_us,
        acc100=session.acc100,
        dec100=session.dec100,
        linear=session.linear,
        pulses=not session.full_step,
    )


def seeded_row(defaults: Defaults) -> Motion:
    """What a cold start, or ``QR``, puts into every position when no queue was ever saved."""
    return cleared_row(Session.start(defaults))
