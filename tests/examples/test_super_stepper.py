"""SACs, Super Stepper modules on another bus, and SiMAD lines of the SACs: one clock, one VCD."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sacbus.cli import run

EXAMPLE = Path(__file__).parents[2] / "examples" / "scenarios" / "super-stepper.scenario.toml"


@pytest.mark.slow
def test_two_buses_and_simad_lines_are_in_one_vcd(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "all.vcd"
    chosen = ["--axes", "arm:10,arm:11", "--pins", "--vcd", str(picture)]
    assert run(["simad", "encode", str(EXAMPLE), *chosen]) == 0
    assert "axis arm:10: 400 steps to 400, the node to 400" in capsys.readouterr().out
    text = picture.read_text()
    assert set(re.findall(r"\$scope module (\w+)", text)) == {
        *("simad", "arm", "table", "node_10", "node_11", "node_3", "node_4")
    }
    names = re.findall(r"\$var wire 1 \S+ (\w+)", text)
    assert {"step_arm_10", "home", "sync", "clk", "dm0", "op_sa"} <= {
        re.sub(r"\W", "_", name) for name in names
    }
