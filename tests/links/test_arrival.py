"""A path that comes into being is hinted at, and nothing else is."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sacbus.links import arrival
from sacbus.links.arrival import Arrival
from tests.links.rig import until

pytestmark = [
    pytest.mark.asyncio,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="inotify is Linux's alone"),
]


class Hints:
    def __init__(self, path: Path) -> None:
        self.count = 0
        self.arrival = Arrival(str(path), self._hint)

    def _hint(self) -> None:
        self.count += 1


@pytest.fixture
def hints(tmp_path: Path) -> Iterator[Callable[[], Hints]]:
    made: list[Hints] = []

    def make() -> Hints:
        made.append(Hints(tmp_path / "tty"))
        return made[-1]

    yield make
    for one in made:
        one.arrival.close()
        one.arrival.close()


async def test_what_is_made_moved_in_or_given_to_us_is_hinted_at(
    tmp_path: Path, hints: Callable[[], Hints]
) -> None:
    told = hints()
    path = tmp_path / "tty"
    path.write_text("made")
    await until(lambda: told.count == 1)
    path.chmod(0o600)
    await until(lambda: told.count == 2)
    path.unlink()
    elsewhere = tmp_path.parent / f"{tmp_path.name}-moved"
    elsewhere.symlink_to("/dev/null")
    elsewhere.rename(path)
    await until(lambda: told.count == 3)


async def test_what_bears_another_name_is_not(tmp_path: Path, hints: Callable[[], Hints]) -> None:
    told = hints()
    for name in ("tt", "tty0", "a much longer name than the other", "t"):
        (tmp_path / name).write_text("other")
    for _ in range(50):
        await asyncio.sleep(0)
    assert told.count == 0
    (tmp_path / "tty").write_text("made")
    await until(lambda: told.count == 1)


async def test_a_watch_that_is_closed_tells_nothing(
    tmp_path: Path, hints: Callable[[], Hints]
) -> None:
    told = hints()
    (tmp_path / "tty").write_text("made")
    told.arrival.close()
    for _ in range(50):
        await asyncio.sleep(0)
    assert told.count == 0


async def test_without_a_directory_or_without_inotify_nothing_is_watched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Hints(tmp_path / "none" / "tty").arrival._inotify is None
    monkeypatch.setattr(arrival, "inotify_library", lambda: None)
    assert Hints(tmp_path / "tty").arrival._inotify is None
