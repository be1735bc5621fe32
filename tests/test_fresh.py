"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

import pytest

from sacbus.fresh import fresh_file
from tests.full_disk import needs_full_device


def test_a_file_is_there_when_it_is_whole_and_not_before(tmp_path: Path) -> None:
    place = tmp_path / "result.csv"
    with fresh_file(place) as file:
        file.write(b"half")
        assert not place.exists()
    assert place.read_bytes() == b"half"
    assert list(tmp_path.iterdir()) == [place]


@pytest.mark.parametrize("fault", [ValueError, OSError, KeyboardInterrupt])
def test_a_failure_leaves_what_was_there_and_nothing_else(
    tmp_path: Path, fault: type[BaseException]
) -> None:
    place = tmp_path / "result.csv"
    place.write_bytes(b"old")

    def fail_halfway() -> None:
        with fresh_file(place) as file:
            file.write(b"new")
            raise fault

    with pytest.raises(fault):
        fail_halfway()
    assert place.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [place]


def test_an_old_file_is_replaced_and_its_mode_kept(tmp_path: Path) -> None:
    place = tmp_path / "result.csv"
    place.write_bytes(b"old and longer")
    place.chmod(0o640)
    with fresh_file(place) as file:
        file.write(b"new")
    assert place.read_bytes() == b"new"
    assert place.stat().st_mode & 0o777 == 0o640


@needs_full_device
def test_a_device_without_room_is_named() -> None:
    def fill() -> None:
        with fresh_file(Path("/dev/full")) as file:
            file.write(b"new")

    with pytest.raises(
        OSError, match=r"^/dev/full: No space left on device, what was written is not"
    ):
        fill()


def test_a_disk_without_room_leaves_what_was_there_and_the_file_is_named(tmp_path: Path) -> None:
    place = tmp_path / "result.csv"
    place.write_bytes(b"old")

    def fill() -> None:
        with fresh_file(place) as file:
            file.write(b"new")
            raise OSError(errno.ENOSPC, "No space left on device")

    told = f"^{re.escape(str(place))}: No space left on device, it is left as it was, make room or"
    with pytest.raises(OSError, match=told):
        fill()
    assert place.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [place]


def test_through_a_symlink_its_target_is_replaced(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"old")
    link.symlink_to(target)
    with fresh_file(link) as file:
        file.write(b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_device_is_written_to_and_stays_a_device(tmp_path: Path) -> None:
    reader, writer = os.pipe()
    try:
        with fresh_file(Path(f"/dev/fd/{writer}")) as file:
            file.write(b"pulses")
        assert os.read(reader, 100) == b"pulses"
    finally:
        os.close(reader)
        os.close(writer)


@pytest.mark.parametrize(
    "place",
    ["missing/result.csv", ".", "file/result.csv"],
    ids=["no directory", "directory", "in a file"],
)
def test_a_place_that_cannot_be_written_is_named_as_it_was_given(
    tmp_path: Path, place: str
) -> None:
    (tmp_path / "file").touch()
    asked = tmp_path / place
    with pytest.raises(OSError) as told, fresh_file(asked):  # noqa: PT011 (which one differs)
        pass
    assert told.value.filename == str(asked)


@pytest.mark.parametrize("fault", [ValueError, KeyboardInterrupt])
def test_a_failure_is_told_also_where_nothing_can_be_removed(
    tmp_path: Path, fault: type[BaseException]
) -> None:
    directory = tmp_path / "results"
    directory.mkdir()

    def fail_halfway() -> None:
        with fresh_file(directory / "result.csv"):
            directory.rename(tmp_path / "moved")
            directory.touch()
            raise fault

    with pytest.raises(fault):
        fail_halfway()


def test_a_directory_that_goes_away_meanwhile_is_told_by_the_name_that_was_given(
    tmp_path: Path,
) -> None:
    directory = tmp_path / "results"
    directory.mkdir()
    (tmp_path / "link").symlink_to(directory)
    asked = tmp_path / "link" / "result.csv"

    def lose_the_directory() -> None:
        with fresh_file(asked):
            directory.rename(tmp_path / "moved")
            directory.touch()

    with pytest.raises(NotADirectoryError) as told:
        lose_the_directory()
    assert told.value.filename == str(asked)
