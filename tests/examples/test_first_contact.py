"""The first code a newcomer reads works, says so, and notices what is not as it says."""

from __future__ import annotations

import ast
import asyncio
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from examples import first_contact
from sacbus.daemon import Configuration, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.links import MemoryLink
from sacbus.wire import crc8, encode
from tests.serving import served

pytestmark = pytest.mark.slow

EXPECTED = """\
node 10, make 400 steps: it acknowledges
  sent   02 0a 01 6d 34 30 30 03 de 00
  heard  02 01 0a 06
the same with a wrong CRC: it refuses
  sent   02 0a 01 6d 34 30 30 03 ce 00
  heard  02 01 0a 15
everybody, release sync: nobody answers a broadcast
  sent   02 00 01 79 03 64 00
  heard  nothing
node 99, which is not there: silence
  sent   02 63 01 6d 34 30 30 03 de 00
  heard  nothing
node 10, nothing to do: it is still there
  sent   02 0a 01 03 00 00
  heard  02 01 0a 06
all as expected
"""


def test_a_bus_behind_a_path_answers_as_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    port = tmp_path / "port"
    with served("--ephemeral", "--pty", str(port)) as sacbus:
        assert first_contact.main([str(port)]) == 0
        assert capsys.readouterr().out == EXPECTED
        # Nothing else was on the line: 5 packets, 3 answers, and no collision.
        assert sacbus.send_signal(signal.SIGTERM) == 0
        stopped = sacbus.read_event("stopped")
        (bus,) = stopped["buses"]
        assert (bus["transmissions"], bus["collided"]) == (8, 0)
        assert bus["reports"] == {"lost": 1}  # the packet with a wrong CRC


@pytest.mark.parametrize("way", ["tcp", "rfc2217"])
def test_a_bus_behind_a_url_answers_a_program_of_its_own_as_told(way: str) -> None:
    with served("--ephemeral", f"--{way}", "0") as sacbus:
        (link,) = sacbus.ready["links"]
        assert (link["kind"], link["host"]) == (way, "127.0.0.1")
        program = [sys.executable, first_contact.__file__, link["url"]]
        done = subprocess.run(program, capture_output=True, text=True, timeout=60, check=False)
        assert (done.returncode, done.stdout) == (0, EXPECTED)


def test_what_it_sends_moves_the_motor_400_steps_and_no_other() -> None:
    async def scene() -> list[float]:
        async with open_bus(Configuration()) as bus:
            link = MemoryLink()
            bus.attach(link)
            client = link.client()
            sent = [line.split("sent ")[1] for line in EXPECTED.splitlines() if "sent" in line]
            for packet in sent:
                client.write(bytes.fromhex(packet))
                await asyncio.sleep(10)
            return [node.position_steps for node in bus.snapshots()]

    assert run_virtual(Kernel(), scene()) == [400, 0, 0]


def test_an_answer_that_differs_is_shown_and_told_by_the_status(
    capsys: pytest.CaptureFixture[str],
) -> None:
    # A bus with a node at 99, which the example expects to be silent.
    with served("--ephemeral", "--nodes", "10,99") as sacbus:
        assert first_contact.main([sacbus.link]) == 1
    written = capsys.readouterr().out
    assert "heard  02   <-- not as expected\n  wanted nothing\n" in written
    assert written.splitlines()[-1].endswith("not as expected")


def test_without_a_bus_it_says_so_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert first_contact.main(["/nonexistent"]) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err == (
        "error: cannot open the port (No such file or directory), /nonexistent, "
        "is the bus running?\n"
    )


def test_its_own_packets_are_those_of_the_specification() -> None:
    for body in (b"", b"m400", b"123456789", b"m3000a2d1", bytes(range(256))):
        assert first_contact.crc8(body) == crc8(body)
        assert first_contact.packet(85, body) == encode(85, 1, body)


def test_it_uses_nothing_but_pyserial_and_the_standard_library() -> None:
    source = Path(first_contact.__file__).read_text()
    imported: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None
            imported.add(node.module.split(".")[0])
    assert imported - sys.stdlib_module_names == {"serial"}
