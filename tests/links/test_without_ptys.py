"""A system without fcntl, termios, pty and tty, as Windows: what works there, and what is said.

Each test is a process in which those four cannot be imported. That they are missing is all that it
has of Windows. The parts that Python, click and pyserial have for it are not there: the first two
are imported before, and pyserial's is stood in for. Whether COM5 opens was never seen here.
"""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.serving import PATIENCE, Sacbus, served

ROOT = Path(__file__).parents[2]

WITHOUT = """
import sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name in MISSING:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

MISSING = ("fcntl", "termios", "pty", "tty")

def go_without(*imported):
    for name in MISSING:
        sys.modules.pop(name, None)
    sys.meta_path.insert(0, Missing())
"""

UNIX = WITHOUT + "import asyncio, click; go_without()\n"

WINDOWS = (
    WITHOUT
    + """
import asyncio, click, io, multiprocessing, numpy, platformdirs, subprocess, types

class Serial(io.RawIOBase):
    pass

backend = types.ModuleType("serial.serialposix")
backend.Serial = backend.PosixPollSerial = backend.VTIMESerial = Serial
sys.modules["serial.serialposix"] = backend
sys.platform = "win32"
go_without()
"""
)


def run(system: str, code: str) -> str:
    """What the code prints, in a process of such a system."""
    ran = subprocess.run(
        [sys.executable, "-c", system + textwrap.dedent(code)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
    )
    assert (ran.stderr, ran.returncode) == ("", 0)
    return ran.stdout


@pytest.mark.slow
@pytest.mark.parametrize("system", [UNIX, WINDOWS], ids=["unix", "Windows"])
def test_the_package_its_links_and_its_commands_are_imported(system: str) -> None:
    assert run(system, "import sacbus, sacbus.links, sacbus.cli, sacbus.mother") == ""


@pytest.mark.slow
def test_so_is_what_hosts_a_bus() -> None:
    rooms = "sacbus.links.tcp, sacbus.links.rfc2217, sacbus.links.adapter, sacbus.links.remote"
    assert run(WINDOWS, f"import sacbus.daemon, sacbus.serve, {rooms}") == ""


@pytest.mark.slow
def test_a_pty_is_refused_in_one_line_that_says_what_to_use() -> None:
    said = run(
        WINDOWS,
        """
        from sacbus.links import LinkError, PtyLink
        for path in (None, "/tmp/sacbus"):
            try:
                PtyLink(path)
            except LinkError as refusal:
                print(refusal)
        """,
    )
    assert said == (
        "this system has no ptys, pty, use TCP or RFC 2217 in its place\n"
        "this system has no ptys, /tmp/sacbus, use TCP or RFC 2217 in its place\n"
    )


@pytest.mark.slow
def test_where_pyserial_knows_no_ports_a_path_is_refused_in_one_line() -> None:
    said = run(
        UNIX,
        """
        from sacbus.links import LinkError, open_line
        async def main():
            try:
                async with open_line("/dev/ttyUSB0", 38_400):
                    pass
            except LinkError as refusal:
                print(refusal)
        asyncio.run(main())
        """,
    )
    assert said == (
        "this system has no serial ports, /dev/ttyUSB0, "
        "give a path, socket://host:port or rfc2217://host:port\n"
    )


@pytest.fixture(scope="module")
def bus() -> Iterator[Sacbus]:
    with served("--ephemeral", "--nodes", "10", "--tcp", "0", "--rfc2217", "0") as sacbus:
        yield sacbus


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1], ids=["socket", "rfc2217"])
def test_commands_are_sent_over_a_network_all_the_same(bus: Sacbus, number: int) -> None:
    url = bus.ready["links"][number]["url"]
    code = f"from sacbus.cli import run; raise SystemExit(run(['send', {url!r}, '10m400']))"
    assert run(WINDOWS, code).startswith("ACK from node 10, ")
