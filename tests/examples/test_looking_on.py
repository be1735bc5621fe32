"""A program of one's own that reads the feed, as the example does."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from examples import looking_on
from sacbus.wire import ack, encode
from tests.runtime import runtime_directory
from tests.serving import PATIENCE, client, served

pytestmark = pytest.mark.slow


@pytest.fixture
def runtime(monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    with runtime_directory() as directory:
        monkeypatch.setenv("XDG_RUNTIME_DIR", str(directory))
        # Else it looks among the user's own buses as well, and there may be some.
        monkeypatch.setenv("TMPDIR", str(directory))
        monkeypatch.setattr(tempfile, "tempdir", str(directory))
        yield directory


def test_it_prints_who_said_what(runtime: Path) -> None:
    port = str(runtime / "port")
    with served("--ephemeral", "--pty", port):
        looking = subprocess.Popen(
            [sys.executable, looking_on.__file__, "2"], stdout=subprocess.PIPE, text=True
        )
        with looking:
            assert looking.stdout is not None
            assert looking.stdout.readline() == "bus bus, sac at 38400 baud\n"
            with client(port) as line:
                line.write(encode(10, 1, b"m400"))
                assert line.read(4) == ack(1, 10)
            asked, answered = looking.stdout.readlines()
            assert looking.wait(PATIENCE) == 0
    assert re.fullmatch(rf"\d+\.\d{{6}}   {port}: 020a016d34303003de00\n", asked)
    assert re.fullmatch(r"\d+\.\d{6}   node 10: 02010a06\n", answered)


def test_without_a_bus_it_says_so(runtime: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert looking_on.main([]) == 1
    assert capsys.readouterr().err == "no bus runs here\n"
