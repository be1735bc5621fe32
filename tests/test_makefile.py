"""What ``make serve`` makes of its variables, and of Ctrl-C."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.serving import Sacbus

ROOT = Path(__file__).parents[1]
#: What a `make test` hands down to us, and what it was given.
MAKES_OWN = {"MAKEFLAGS", "MAKELEVEL", "MFLAGS", "MAKEOVERRIDES", "ARGS", "JOBS", "PTY", "CONFIG"}


@contextmanager
def make_serve(directory: Path, *variables: str) -> Iterator[Sacbus]:
    """``make serve`` with an environment that is ready: the one that runs the tests."""
    venv = directory / "venv"
    python = venv / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    (venv / "run").touch()
    process = subprocess.Popen(
        ["make", "serve", f"VENV={venv}", *variables],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={name: value for name, value in os.environ.items() if name not in MAKES_OWN},
        start_new_session=True,
    )
    assert process.stdout is not None
    with process:
        try:
            yield Sacbus(process, process.stdout.fileno())
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.slow
def test_ctrl_c_is_the_end_of_it_and_no_error(tmp_path: Path) -> None:
    port = tmp_path / "a port"
    with make_serve(tmp_path, f"PTY={port}", "ARGS=--ephemeral") as sacbus:
        sacbus.read_until(lambda text: "Ctrl-C ends it" in text)
        assert f"connect to {port}\n" in sacbus.text
        # A terminal sends it to all that run on it.
        os.killpg(sacbus.process.pid, signal.SIGINT)
        sacbus.wait()
        assert sacbus.errors() == ""
        assert "stopped; port closed" in sacbus.text


@pytest.mark.slow
def test_make_that_is_ended_ends_the_bus(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with make_serve(tmp_path, f"PTY={port}", "ARGS=--ephemeral") as sacbus:
        sacbus.read_until(lambda text: "Ctrl-C ends it" in text)
        sacbus.send_signal(signal.SIGTERM)
        assert "stopped; port closed" in sacbus.text
        assert not port.is_symlink()


@pytest.mark.slow
def test_no_pty_takes_no_option_for_its_path(tmp_path: Path) -> None:
    with make_serve(tmp_path, "PTY=", "ARGS=--bogus") as sacbus:
        assert sacbus.wait() == 2
        assert "No such option" in sacbus.errors()
