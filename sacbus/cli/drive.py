"""Options that say how a node is set: what its motion is planned by.

The same words, defaults and limits wherever something is planned.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

from sacbus.cli.options import WholeNumber

if TYPE_CHECKING:
    from sacbus.motion import Drive

__all__ = ["drive_options", "tuned_drive", "tuning_options"]

_F = TypeVar("_F", bound=Callable[..., Any])  # whatever parameters a command has

_BYTE: Final = 255


def _all_of(*options: Callable[[_F], _F]) -> Callable[[_F], _F]:
    """These options, in this order in a command's help."""

    def given_to(command: _F) -> _F:
        for option in reversed(options):
            command = option(command)
        return command

    return given_to


#: ``--ustep``, ``--sprf``, ``--slow``: the parameters of that name.
drive_options: Final = _all_of(
    click.option(
        "--ustep",
        type=WholeNumber(0, 7),
        default=0,
        show_default=True,
        help="Microsteps, as a power of two.",
    ),
    click.option(
        "--sprf",
        type=WholeNumber(1, 65_535),
        default=200,
        show_default=True,
        help="Full steps per revolution.",
    ),
    click.option(
        "--slow",
        type=WholeNumber(1, _BYTE),
        default=10,
        show_default=True,
        help="RPM up to which there are no ramps.",
    ),
)

#: ``--ihd``, ``--xclk``: what a node's time is tuned by.
tuning_options: Final = _all_of(
    click.option(
        "--ihd",
        type=WholeNumber(0, _BYTE),
        default=8,
        show_default=True,
        help="Half microseconds taken from every period; 8 is exact.",
    ),
    click.option(
        "--xclk",
        type=WholeNumber(0, _BYTE),
        default=0,
        show_default=True,
        help="Half microseconds added to every period.",
    ),
)


def tuned_drive(given: Mapping[str, Any]) -> Drive:
    """The drive that both kinds of options describe, by their parameters' names."""
    from sacbus.motion import Drive

    return Drive(
        sprf=given["sprf"],
        slow_rpm=given["slow"],
        ustep=given["ustep"],
        ihd=given["ihd"],
        xclk=given["xclk"],
    )
