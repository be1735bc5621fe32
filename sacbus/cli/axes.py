"""Where ``sacbus simad encode`` has its steps from: a scenario, a recording, or a file of steps.

Owns how axes are named, and what each of these gives under such a name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Final, NamedTuple

import click

from sacbus.cli.options import WrongInput
from sacbus.cli.recordings import opened

if TYPE_CHECKING:
    from sacbus.scenario import Result, Scenario
    from sacbus.simad import Steps
    from sacbus.trace import Recording, Track

__all__ = ["AxisName", "Source", "read_axes", "source_of"]

#: ``10``, ``10-12``, ``left:10``.
_PART: Final = re.compile(r"(?:([^:,]+):)?(\d{1,9})(?:-(\d{1,9}))?")


class AxisName(NamedTuple):
    """An axis as it was given: its number, and the bus where that was said."""

    bus: str
    number: int

    def __str__(self) -> str:
        return f"{self.bus}:{self.number}" if self.bus else str(self.number)


@dataclass(slots=True)
class Source:
    """The steps of some axes. What was recorded, and the scenario's result, where there are any."""

    names: tuple[str, ...]
    parts: Iterator[Steps]
    recording: Recording | None = None
    result: Result | None = None
    #: Of the axes of a recording, in their order.
    tracks: list[Track] = field(default_factory=list)

    def positions(self) -> list[int | None]:
        """Where the nodes themselves say that they are at the end, from where they began.

        None for what is no node, and for one that has counted from anew meanwhile.
        """
        if self.recording is None:
            return [None] * len(self.names)
        end = self.recording.end
        return [
            None
            if any(one.anew for one in track.segments[1:])
            else track.position(end) - track.position(track.segments[0].since)
            if track.segments
            else 0
            for track in self.tracks
        ]


def read_axes(
    _ctx: click.Context, _param: click.Parameter, given: str | None
) -> tuple[AxisName, ...]:
    """``10-12,left:14``: axes in the order given, each once; none where nothing is given."""
    found: list[AxisName] = []
    for part in [] if given is None else given.split(","):
        axis = _PART.fullmatch(part.strip())
        if axis is None:
            raise click.BadParameter(f"expected axes such as 10,11 or 10-12, got {part.strip()!r}")
        first, last = int(axis[2]), int(axis[3] or axis[2])
        if not first <= last < first + 255:
            raise click.BadParameter(f"expected axes low to high, got {part.strip()!r}")
        found += [AxisName(axis[1] or "", number) for number in range(first, last + 1)]
    twice = next((one for one in found if found.count(one) > 1), None)
    if twice is not None:
        raise click.BadParameter(f"expected each axis once, got {twice} twice")
    return tuple(found)


@contextmanager
def source_of(
    place: str, axes: Sequence[AxisName], parameters: dict[str, object], seed: int | None
) -> Iterator[Source]:
    """What a file gives; a scenario is played in virtual time. WrongInput where that cannot be."""
    suffix = Path(place).suffix.lower()
    if suffix == ".toml":
        with TemporaryFile("w+b") as record:
            from sacbus.scenario import run

            result = run(_scenario(place, parameters, seed), record=record)
            assert result.recording is not None
            source = _of_recording(result.recording, axes)
            source.result = result
            yield source
        return
    if parameters or seed is not None:
        raise click.UsageError(f"{'--set' if parameters else '--seed'}: expected a scenario")
    yield (
        _of_steps(Path(place), axes)
        if suffix in {".csv", ".npy"}
        else _of_recording(opened(place), axes)
    )


def _scenario(place: str, parameters: dict[str, object], seed: int | None) -> Scenario:
    from sacbus.scenario import read
    from sacbus.scenario.rules import refuse

    found = read(place, parameters, seed=seed)
    if len(found) != 1:
        raise click.UsageError(f"{place}: expected one case, got {len(found)}, use --set")
    refuse(found[0])
    return found[0]


def _of_recording(recording: Recording, axes: Sequence[AxisName]) -> Source:
    from sacbus.simad.moves import steps_of

    if not axes:
        known = ", ".join(str(node.address) for node in recording.nodes[:20]) or "none"
        raise click.UsageError(f"--axes: expected nodes of {recording.name}, which has {known}")
    tracks = [_track(recording, axis) for axis in axes]
    names = tuple(map(str, axes))
    parts = steps_of(tracks, 0, recording.end + 1)
    return Source(names, parts, recording, tracks=tracks)


def _track(recording: Recording, axis: AxisName) -> Track:
    """The track of a node of one bus."""
    found = [
        track
        for (bus, address), track in recording.tracks.items()
        if address == axis.number and axis.bus in {"", recording.buses[bus].name}
    ]
    if len(found) != 1:
        what = "no such node" if not found else f"{len(found)} buses with it, name one as BUS:NODE"
        known = ", ".join(
            f"{bus.name}:{node.address}" for bus in recording.buses for node in bus.nodes[:12]
        )
        raise click.UsageError(f"--axes: {axis}: {what}, {recording.name} has {known or 'none'}")
    return found[0]


def _of_steps(path: Path, axes: Sequence[AxisName]) -> Source:
    from sacbus.simad.step_files import axes_in, read_steps

    of_bus = next((one for one in axes if one.bus), None)
    if of_bus is not None:
        raise click.UsageError(f"--axes: {of_bus}: expected numbers as in {path}, which has no bus")
    try:
        with path.open("rb"):  # that it can be read is found out here, not in mid stream
            numbers = tuple(axis.number for axis in axes) or axes_in(path)
    except OSError as fault:
        raise WrongInput(f"{path}: {fault.strerror}, name a file of steps") from fault
    if not numbers:
        raise WrongInput(f"{path}: expected steps, got none")
    return Source(tuple(map(str, numbers)), read_steps(path, numbers))
