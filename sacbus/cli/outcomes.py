"""What became of transactions as exit statuses, the same for every command that sends.

Source: spec, cli (``sacbus send``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import click

from sacbus.cli.options import NO_ANSWER_STATUS

if TYPE_CHECKING:
    from sacbus.mother import MotherError

__all__ = ["failures", "told"]

NAK_STATUS: Final = 3
UNKNOWN_STATUS: Final = 5


def failures() -> tuple[type[MotherError], ...]:
    """The errors that have a status of their own, for an ``except``."""
    from sacbus.mother import NoAnswer, NoSoftOp, Refused, UnknownOutcome

    return Refused, NoAnswer, NoSoftOp, UnknownOutcome


def told(failure: MotherError) -> int:
    """The status of one of these; its line is printed."""
    from sacbus.mother import Refused, UnknownOutcome

    click.echo(f"error: {failure}", err=True)
    if isinstance(failure, Refused):
        return NAK_STATUS
    return UNKNOWN_STATUS if isinstance(failure, UnknownOutcome) else NO_ANSWER_STATUS
