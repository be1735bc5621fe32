"""A part program over a cable: mother in one process, the nodes in another, in real time."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from sacbus.cli import run
from sacbus.trace import read
from tests.links.socat import Wire, needs_socat
from tests.machining.seen import check_that_it_ran_as_listed, listed
from tests.serving import Sacbus, served

pytestmark = [pytest.mark.slow, needs_socat]

PROGRAM = """
G21 F600
G1 X10 Y5
G2 X10 Y5 I3 J0
G4 P0.2
G0 Z2
G1 X4 Y7.5 Z1.1
"""

#: RPM: these axes follow 10 without a ramp; the steps of a short command are whole ones.
JUMP = 16.0

OPTIONS = ("--axis", "X=10:20", "--axis", "Y=11:20", "--axis", "Z=12:50")


@pytest.fixture
def wire() -> Iterator[Wire]:
    wire = Wire()
    wire.plug()
    yield wire
    wire.close()


@pytest.fixture
def program(tmp_path: Path) -> str:
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM)
    return str(file)


def ended(bus: Sacbus) -> list[float]:
    """End a bus; where its nodes stood."""
    assert bus.send_signal(signal.SIGTERM) == 0
    (last,) = json.loads(bus.text.splitlines()[-1])["buses"]
    return [node["position_steps"] for node in last["nodes"]]


def test_a_program_runs_over_a_line_as_it_does_in_the_simulation(
    wire: Wire, program: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded, listing = tmp_path / "recorded", tmp_path / "listing"
    options = ("--nodes", "10-12", "--port", wire.far, "--record", str(recorded))
    arguments = ["gcode", program, *OPTIONS, "--json"]
    assert run(arguments) == 0
    simulated = json.loads(capsys.readouterr().out)
    with served("--ephemeral", *options) as bus:
        assert run([*arguments, "--link", wire.near, "-o", str(listing)]) == 0
        positions = ended(bus)
    told = json.loads(capsys.readouterr().out)
    assert positions == [one["reached_steps"] for one in simulated["axes"]]
    assert positions == [one["asked_steps"] for one in told["axes"]] == [80, 150, 55]
    assert told["stretches"] == simulated["stretches"]
    check_that_it_ran_as_listed(read(str(recorded)), listed(listing.read_text()), JUMP)


def test_ctrl_c_stops_all_axes(wire: Wire, tmp_path: Path) -> None:
    far = tmp_path / "far.ngc"
    far.write_text("F600\nG1 X1000 Y800\n")
    with served("--ephemeral", "--nodes", "10-12", "--port", wire.far) as bus:
        command = [sys.executable, "-m", "sacbus", "gcode", str(far), *OPTIONS]
        with subprocess.Popen(
            [*command, "--link", wire.near, "-o", "-"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        ) as gcode:
            assert gcode.stdout is not None
            while not gcode.stdout.readline().startswith(b"# block 1"):
                pass
            gcode.send_signal(signal.SIGINT)
            _, errors = gcode.communicate(timeout=30)
            assert gcode.returncode == 130
            assert b"stopped: " in errors
        positions = ended(bus)
    assert max(positions) < 16_000
