"""The stable path: who may have it, and what is left of it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from sacbus.links import LinkError, PathTaken
from sacbus.links.symlink import Symlink

ROOT = Path(__file__).parents[2]
NOBODY = 65_534

CLAIM_AND_WAIT = """
import sys
from sacbus.links.symlink import Symlink
Symlink(sys.argv[1]).claim("/dev/pts/99999")
print("claimed", flush=True)
sys.stdin.read()
"""

CLAIM_AGAIN_AND_AGAIN = """
import os, sys
from sacbus.links import PathTaken
from sacbus.links.symlink import Symlink
link, mine = Symlink(sys.argv[1]), f"/dev/pts/{os.getpid()}"
print("ready", flush=True)
sys.stdin.readline()
for _ in range(100):
    while True:
        try:
            link.claim(mine)
            break
        except PathTaken as taken:
            assert "served by" in str(taken), taken
    assert os.readlink(link.path) == mine
    link.point(mine + "0")
    assert os.readlink(link.path) == mine + "0"
    link.release()
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "port"


@contextmanager
def another_run(path: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that has claimed the path; killed, not ended, so that it leaves all behind."""
    with subprocess.Popen(
        [sys.executable, "-c", CLAIM_AND_WAIT, path],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as run:
        assert run.stdout is not None
        assert run.stdout.readline() == "claimed\n"
        yield run
        run.kill()


def names(directory: Path) -> list[str]:
    return sorted(entry.name for entry in directory.iterdir())


def refusal(path: Path) -> LinkError:
    with pytest.raises(LinkError) as refused:
        Symlink(path).claim("/dev/pts/7")
    assert "\n" not in str(refused.value)
    return refused.value


def test_a_claimed_path_points_at_the_device_and_its_lock_holds_our_number(path: Path) -> None:
    link = Symlink(path)
    link.claim("/dev/pts/7")
    assert str(path.readlink()) == "/dev/pts/7"
    assert path.with_name("port.lock").read_text() == f"{os.getpid()}\n"
    assert names(path.parent) == ["port", "port.lock"]
    link.release()


def test_release_leaves_nothing_and_may_be_repeated(path: Path) -> None:
    link = Symlink(path)
    link.claim("/dev/pts/7")
    link.release()
    link.release()
    assert names(path.parent) == []


def test_a_released_path_may_be_claimed_again(path: Path) -> None:
    link = Symlink(path)
    for target in ("/dev/pts/7", "/dev/pts/8"):
        link.claim(target)
        assert str(path.readlink()) == target
        link.release()


def test_the_path_of_a_live_run_is_refused_with_its_number(path: Path) -> None:
    with another_run(path) as run:
        error = refusal(path)
        assert isinstance(error, PathTaken)
        assert error.what == f"the path is served by process {run.pid}"
        assert str(path.readlink()) == "/dev/pts/99999"
        assert names(path.parent) == ["port", "port.lock"]


def test_a_path_is_refused_within_one_process_too(path: Path) -> None:
    link = Symlink(path)
    link.claim("/dev/pts/7")
    assert refusal(path).what == f"the path is served by process {os.getpid()}"
    with pytest.raises(LinkError, match="claimed already"):
        link.claim("/dev/pts/8")
    link.release()


def test_what_a_killed_run_left_is_taken_over(path: Path) -> None:
    with another_run(path):
        pass
    assert names(path.parent) == ["port", "port.lock"]
    link = Symlink(path)
    link.claim("/dev/pts/7")
    assert str(path.readlink()) == "/dev/pts/7"
    assert path.with_name("port.lock").read_text() == f"{os.getpid()}\n"
    link.release()
    assert names(path.parent) == []


def test_a_dead_lock_alone_is_taken_over(path: Path) -> None:
    path.with_name("port.lock").write_text("1234567890\n")
    link = Symlink(path)
    link.claim("/dev/pts/7")
    assert path.with_name("port.lock").read_text() == f"{os.getpid()}\n"
    link.release()
    assert names(path.parent) == []


THINGS: dict[str, Callable[[Path], object]] = {
    "a file": lambda path: path.write_text("precious"),
    "a directory": lambda path: path.mkdir(),
    "a dangling symlink": lambda path: path.symlink_to("/dev/pts/99999"),
    "a symlink to a device": lambda path: path.symlink_to("/dev/null"),
    "a symlink to a directory": lambda path: path.symlink_to("/"),
}


@pytest.mark.parametrize("thing", THINGS)
def test_what_is_not_ours_is_refused_and_left_alone(path: Path, thing: str) -> None:
    THINGS[thing](path)
    before = path.lstat()
    error = refusal(path)
    assert isinstance(error, PathTaken)
    assert (error.where, error.remedy) == (str(path), "remove it or choose another path")
    assert "is in the way" in error.what
    assert os.path.samestat(path.lstat(), before)
    assert names(path.parent) == ["port"]


@pytest.mark.parametrize("thing", ["a file", "a directory"])
def test_a_dead_lock_does_not_make_a_file_ours(path: Path, thing: str) -> None:
    path.with_name("port.lock").write_text("1234567890\n")
    THINGS[thing](path)
    before = path.lstat()
    assert isinstance(refusal(path), PathTaken)
    assert os.path.samestat(path.lstat(), before)
    assert path.with_name("port.lock").read_text() == "1234567890\n"


def test_a_lock_that_no_run_has_put_its_number_in_makes_no_symlink_ours(path: Path) -> None:
    path.with_name("port.lock").touch()
    path.symlink_to("/dev/null")
    assert "not ours" in refusal(path).what
    assert str(path.readlink()) == "/dev/null"


def test_a_missing_directory_is_named(path: Path) -> None:
    error = refusal(path / "deeper" / "port")
    assert str(error) == (f"no such directory, {path / 'deeper'}, create it or choose another path")


def test_a_file_for_a_directory_is_refused(path: Path) -> None:
    path.touch()
    assert "Not a directory" in refusal(path / "port").what


def test_a_path_without_a_name_is_refused() -> None:
    assert refusal(Path("/")).where == "/"


def test_a_lock_that_is_no_file_is_refused(path: Path) -> None:
    path.with_name("port.lock").mkdir()
    assert "Is a directory" in refusal(path).what
    assert names(path.parent) == ["port.lock"]


@pytest.fixture
def unprivileged() -> Iterator[None]:
    """An ordinary user's rights, which root lays down for the while."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    yield
    os.seteuid(0)


def test_a_directory_without_permission_is_refused(
    path: Path, request: pytest.FixtureRequest
) -> None:
    path.parent.chmod(0o555)
    path.parent.parent.chmod(0o755)
    path.parent.parent.parent.chmod(0o755)
    request.getfixturevalue("unprivileged")
    error = refusal(path)
    assert "Permission denied" in error.what
    assert error.where == str(path)


def test_a_symlink_that_cannot_be_removed_is_told_and_the_lock_let_go(
    path: Path, request: pytest.FixtureRequest
) -> None:
    link = Symlink(path)
    link.claim("/dev/pts/7")
    path.parent.chmod(0o555)
    path.parent.parent.chmod(0o755)
    path.parent.parent.parent.chmod(0o755)
    request.getfixturevalue("unprivileged")
    with pytest.raises(LinkError, match="cannot remove the symlink"):
        link.release()
    link.release()


def test_release_leaves_alone_what_others_have_put_there(path: Path) -> None:
    link = Symlink(path)
    link.claim("/dev/pts/7")
    path.unlink()
    path.write_text("precious")
    lock = path.with_name("port.lock")
    lock.unlink()
    lock.write_text("another's")
    link.release()
    assert (path.read_text(), lock.read_text()) == ("precious", "another's")


@pytest.mark.slow
def test_of_many_runs_that_want_one_path_one_has_it_at_a_time(path: Path) -> None:
    # Each checks that the path is its own while it has it; the lock comes and goes all the time.
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", CLAIM_AGAIN_AND_AGAIN, path],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(3)
    ]
    for run in runs:
        assert run.stdout is not None
        assert run.stdout.readline() == "ready\n"
    for run in runs:
        assert run.stdin is not None
        run.stdin.write("go\n")
        run.stdin.flush()
    ended = [run.communicate(timeout=60) for run in runs]
    assert [error for _, error in ended] == ["", "", ""]
    assert names(path.parent) == []
