"""The making of buses for tests: from the words of a marker to a bus in virtual time.

Owns those words, and the order of opening and closing.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, ExitStack, contextmanager
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, Final

from sacbus.config.notation import addresses
from sacbus.config.reading import read as read_configuration
from sacbus.configuration import Configuration, NodeAt, check
from sacbus.daemon import open_bus
from sacbus.host import VirtualLoop
from sacbus.hosted import HostedBus
from sacbus.kernel import Kernel
from sacbus.node import SettingError, find_kind, setting_list
from sacbus.testing.bus import VirtualBus
from sacbus.testing.recordings import Recordings

__all__ = ["BusMaker", "configured", "virtual_bus"]

#: What is said of a bus, and of what type; every other word is a setting of its nodes' kind.
_OF_BUS: Final[Mapping[str, type]] = {
    "nodes": object,
    "kind": str,
    "name": str,
    "baud": int,
    "lanes": int,
    "seed": int,
}


class BusMaker:
    """Makes the buses of one test, all on one clock, and closes them with it.

    ::

        def test_two_lines(make_bus):
            left = make_bus(nodes="10-12", name="left")
            right = make_bus("workshop.toml", name="right")

    ``directory`` is where the paths of configurations begin, ``recordings`` where each bus is
    recorded to.
    """

    def __init__(
        self,
        kernel: Kernel,
        *,
        directory: Path | None = None,
        recordings: Recordings | None = None,
    ) -> None:
        self.buses: list[VirtualBus] = []
        self._kernel = kernel
        self._directory = directory or Path.cwd()
        self._recordings = recordings
        self._stack = ExitStack()

    def __call__(self, file: str | Path | None = None, /, **words: object) -> VirtualBus:
        """A bus of :func:`configured`'s words."""
        return self.host(configured(file, words, self._directory))

    def host(self, configuration: Configuration) -> VirtualBus:
        """A bus of a configuration's values; its links are not opened, and no memory is kept."""
        alone = dataclasses.replace(configuration, links=(), terminals=False, state=None, speed=1.0)
        with ExitStack() as stack:
            # A loop for what opening and closing await. The kernel is the bus's only clock, so in
            # an async test another loop moves it, and this one stands still.
            runner = asyncio.Runner(loop_factory=partial(VirtualLoop, self._kernel))
            stack.enter_context(runner)
            opening = open_bus(alone)
            hosted = runner.run(_enter(opening))
            stack.callback(lambda: runner.run(_leave(opening)))
            runner.run(hosted.booted())
            bus = VirtualBus(hosted, runner.run, stack.enter_context(self._tape(alone.name)))
            stack.callback(bus.close)
            self.buses.append(bus)
            self._stack.push(stack.pop_all())
        return bus

    def close(self) -> None:
        """Close all of them; what was seen of them stays. RecordingCutOff as they have it."""
        self._stack.close()

    def _tape(self, bus: str) -> BinaryIO:
        if self._recordings is None:
            return BytesIO()
        return self._recordings.open(bus, *([str(len(self.buses) + 1)] if self.buses else []))


@contextmanager
def virtual_bus(
    what: Configuration | str | Path | None = None, /, **words: object
) -> Iterator[VirtualBus]:
    """A bus in virtual time without any fixture: for ``unittest``, Hypothesis and scripts.

    ``what`` is a configuration or a file with one; words as those of the marker ``sacbus``.
    """
    maker = BusMaker(Kernel())
    try:
        yield maker.host(what) if isinstance(what, Configuration) else maker(what, **words)
    finally:
        maker.close()


def configured(
    file: str | Path | None, words: Mapping[str, object], directory: Path
) -> Configuration:
    """A bus from the words of a marker.

    ``file``: a configuration, of which ``name`` chooses a bus, or else the first one counts.
    ``nodes``: addresses, ``"10-12,85"``, one or several numbers, or settings by addresses. What is
    none of ``kind``, ``name``, ``baud``, ``lanes`` and ``seed`` is a setting of all nodes.
    SettingError, KindError or ConfigError for what cannot be.
    """
    of_bus = {name: _typed(name, words[name]) for name in _OF_BUS if name in words}
    settings = {name: value for name, value in words.items() if name not in _OF_BUS}
    if file is None:
        bus = Configuration()
    else:
        name = of_bus.pop("name", None)
        buses = read_configuration(directory / file).buses
        chosen = [one for one in buses if name in (None, one.name)]
        if not chosen:
            have = ", ".join(one.name for one in buses)
            raise SettingError(f"name: expected one of {have}, got {name!r}")
        bus = chosen[0]
    kind = of_bus.get("kind", bus.kind)
    known = {one.name for one in setting_list(find_kind(str(kind)).settings)}
    for wrong in settings:
        if wrong not in known:
            raise SettingError(
                f"{wrong}: expected {', '.join(_OF_BUS)}, or a setting of kind {kind} "
                f"(sacbus kinds {kind} lists them)"
            )
    if "nodes" in of_bus:
        of_bus["nodes"] = _nodes(of_bus["nodes"], str(kind), settings)
    elif file is not None:
        of_bus["nodes"] = tuple(
            dataclasses.replace(one, settings={**one.settings, **settings})
            for one in bus.every_node
        )
    # Any field may hold anything until it is checked.
    found = dataclasses.replace(bus, settings=settings, **of_bus)  # type: ignore[arg-type]
    check(found)
    return found


def _typed(name: str, value: object) -> object:
    wanted = _OF_BUS[name]
    if isinstance(value, wanted) and (wanted is object or not isinstance(value, bool)):
        return value
    raise SettingError(
        f"{name}: expected {'a text' if wanted is str else 'a whole number'}, got {value!r}"
    )


def _nodes(given: object, kind: str, settings: Mapping[str, object]) -> tuple[NodeAt, ...]:
    own: Mapping[object, object] = given if isinstance(given, Mapping) else {}
    match given:
        case str():
            wanted: Sequence[object] = addresses(given)
        case int():
            wanted = (given,)
        case Mapping() | list() | tuple() | set() | range():
            wanted = tuple(given)
        case _:
            raise SettingError(f'nodes: expected addresses such as "10-12,85", got {given!r}')
    found = []
    for address in wanted:
        if not isinstance(address, int) or isinstance(address, bool):
            raise SettingError(f"nodes: expected addresses from 4 to 255, got {address!r}")
        differs = own.get(address, {})
        if not isinstance(differs, Mapping):
            raise SettingError(f"nodes: expected settings of node {address}, got {differs!r}")
        found.append(NodeAt(address, kind, {**settings, **differs}))
    return tuple(found)


async def _enter(opening: AbstractAsyncContextManager[HostedBus]) -> HostedBus:
    return await opening.__aenter__()


async def _leave(opening: AbstractAsyncContextManager[HostedBus]) -> None:
    await opening.__aexit__(None, None, None)
