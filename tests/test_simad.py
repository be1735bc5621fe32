"""``sacbus simad`` at the command line: scenarios, recordings and files to lines, and back."""

from __future__ import annotations

import io
import json
import re
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from sacbus.cli import run
from sacbus.cli.axes import read_axes, source_of
from sacbus.cli.recordings import span
from sacbus.cli.simad_encode import RULES, _verdict
from sacbus.simad import GECKO
from sacbus.trace import read
from tests.drawing import without_matplotlib
from tests.simad.reference import broken_rules, driven
from tests.trace.rig import Dump, recorded, two_axes

Captured = pytest.CaptureFixture[str]

ROOT = Path(__file__).parents[1]

#: Axes of two buses, two each way, that start together and come back one after the other.
SCENARIO = """
title = "two buses"

[parameters]
speed = 300

[[bus]]
name = "left"
nodes = [{ addresses = "10,11" }]

[[bus]]
name = "right"
nodes = [{ addresses = "10" }]

[[step]]
bus = "left"
send = ["10m200v{speed}s", "11m-150v225s"]

[[step]]
bus = "right"
send = "10m-100v150s"

[[step]]
bus = "left"
send = "0y"

[[step]]
bus = "right"
send = "0y"

[[step]]
bus = "left"
expect = { node = 10, position = 200, within = "5 s" }

[[step]]
bus = "right"
expect = { node = 10, position = -100, within = "5 s" }

[[step]]
bus = "left"
send = "10m-50v60"

[[step]]
bus = "left"
expect = { node = 10, position = 150, within = "5 s" }
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "axes.scenario.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    sink = BytesIO()
    recorded(two_axes, sink=sink)
    path = tmp_path / "run.jsonl"
    path.write_bytes(sink.getvalue())
    return path


@pytest.fixture
def steps(tmp_path: Path) -> Path:
    path = tmp_path / "steps.csv"
    path.write_text("time_ns,axis,direction\n0,4,1\n0,5,-1\n1000,4,1\n900000,5,1\n")
    return path


def told(captured: Captured) -> dict[str, object]:
    found: dict[str, object] = json.loads(captured.readouterr().out)
    return found


@pytest.mark.slow
def test_the_lines_of_a_scenario_lead_where_the_nodes_are_on_one_clock_with_their_pins(
    scenario: Path, tmp_path: Path, capsys: Captured
) -> None:
    vcd = tmp_path / "lines.vcd"
    axes = ["--axes", "left:10,left:11,right:10"]
    arguments = ["simad", "encode", str(scenario), *axes, "--vcd", str(vcd), "--pins"]
    assert run([*arguments, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [one["axis"] for one in report["axes"]] == ["left:10", "left:11", "right:10"]
    assert [one["node_position"] for one in report["axes"]] == [150, -150, -100]
    assert [one["decoded_position"] for one in report["axes"]] == [150, -150, -100]
    assert (report["lines"], report["lines_without"]) == (4, 6)
    # An independent reader: the pins of all nodes, and the lines, which keep the rules.
    dump = Dump(vcd.read_text())
    lines = ["dir", "step_left_10", "step_left_11", "step_right_10"]
    edges = sorted(
        (when, line or 999, int(level))
        for line, name in enumerate(lines)
        for when, level in dump.edges[f"simad.{name}"][1:]
    )
    in_order = [(when, line % 999, level) for when, line, level in edges]
    assert broken_rules(in_order, GECKO) == []
    made = driven(in_order, int(dump.edges["simad.dir"][0][1]))
    for axis, pin in enumerate(("left.node_10", "left.node_11", "right.node_10")):
        rises = dump.rises(f"{pin}.clk")
        falls = [when for when, which, _ in made if which == axis]
        late = np.array(falls) - np.array(rises)
        assert late.size == report["axes"][axis]["steps"]
        assert late.min() >= 0
        assert late.max() == report["axes"][axis]["delay_max_ns"]
    # And decoded by ourselves, from the same file.
    assert run(["simad", "decode", str(vcd), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert [one["position"] for one in again["axes"]] == [150, -150, -100]


@pytest.mark.slow
def test_a_recording_gives_the_same_lines_as_the_scenario_that_it_is_of(
    scenario: Path, tmp_path: Path, capsys: Captured
) -> None:
    record = tmp_path / "run.jsonl"
    assert run(["run", str(scenario), "--record", str(record)]) == 0
    axes = ["--axes", "left:10,left:11", "--vcd"]
    first, second = tmp_path / "a.vcd", tmp_path / "b.vcd"
    assert run(["simad", "encode", str(scenario), *axes, str(first)]) == 0
    assert run(["simad", "encode", str(record), *axes, str(second)]) == 0
    assert first.read_bytes() == second.read_bytes()
    whole = read(record)
    assert [*whole][-1].when == Dump(first.read_text()).end
    assert "left:10: 250 steps to 150, the node to 150" in capsys.readouterr().out


def test_single_pulses_of_one_instant_follow_one_another(recording: Path, capsys: Captured) -> None:
    # In it node 11 is told three single pulses, and node 10 is switched off, and counts from anew.
    track = read(recording).track(11)
    assert run(["simad", "encode", str(recording), "--axes", "10,11", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert [one["node_position"] for one in report["axes"]] == [None, track.position(10**12)]
    assert report["axes"][1]["decoded_position"] == track.position(10**12)
    assert report["axes"][1]["moved"] == 2
    assert report["axes"][1]["delay_max_ns"] == 9_000


def test_a_file_of_steps_goes_there_and_back(steps: Path, tmp_path: Path, capsys: Captured) -> None:
    vcd, table, array = (tmp_path / f"out.{form}" for form in ("vcd", "csv", "npy"))
    assert run(["simad", "encode", str(steps), "--vcd", str(vcd)]) == 0
    assert capsys.readouterr().out == (
        "axis 4: 2 steps to 2, 1 moved, late by 8 µs at most, 4.000 µs in the mean, "
        "5.657 µs rms\n"
        "axis 5: 2 steps to 0, 1 moved, late by 4.5 µs at most, 2.250 µs in the mean, "
        "3.182 µs rms\n"
        "4 steps on 3 lines in place of 4, DIR turns 2 times\n"
        "at most 222222 steps/s an axis in one direction, 111111 in both\n"
    )
    assert run(["simad", "decode", str(vcd), "--csv", str(table), "--npy", str(array)]) == 0
    assert capsys.readouterr().out == "axis 4: 2 steps to 2\naxis 5: 2 steps to 0\n"
    assert table.read_text() == ("time_ns,axis,direction\n0,4,1\n4500,5,-1\n9000,4,1\n900000,5,1\n")
    # What fell in time needs no moving again.
    for again in (table, array):
        assert run(["simad", "encode", str(again), "--json"]) == 0
        assert told(capsys)["moved"] == 0
    assert run(["simad", "encode", str(array), "--axes", "5", "--json"]) == 0
    assert told(capsys)["steps"] == 2


def test_steps_to_standard_output_and_lines_from_standard_input(
    steps: Path, tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    vcd = tmp_path / "out.vcd"
    assert run(["simad", "encode", str(steps), "--vcd", str(vcd)]) == 0
    capsys.readouterr()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(BytesIO(vcd.read_bytes())))
    assert run(["simad", "decode", "-", "--csv", "-"]) == 0
    assert capsys.readouterr().out.splitlines()[1:3] == ["0,4,1", "4500,5,-1"]


def test_what_comes_too_fast_is_refused_with_axis_and_time(
    steps: Path, tmp_path: Path, capsys: Captured
) -> None:
    vcd = tmp_path / "out.vcd"
    assert run(["simad", "encode", str(steps), "--vcd", str(vcd), "--max-delay", "7us"]) == 1
    assert capsys.readouterr().err == (
        "error: the step of axis 4 at 1000 ns cannot fall before 9000 ns, expected a delay of "
        "7000 ns at most, got 8000 ns, move slower, turn less often, or allow a longer delay\n"
    )
    assert not vcd.exists()


def test_the_rules_can_be_set_and_are_those_of_gecko_otherwise(
    steps: Path, capsys: Captured
) -> None:
    defaults = {name: span(None, None, default) for name, default, _ in RULES}  # type: ignore[arg-type]
    assert defaults == {one: getattr(GECKO, one) for one in ("low", "high", "setup", "hold")}
    rules = ["--low", "1us", "--high", "2us", "--setup", "200ns", "--hold", "0"]
    assert run(["simad", "encode", str(steps), "--json", *rules]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["timing_ns"] == {"low": 1_000, "high": 2_000, "setup": 200, "hold": 0}
    assert report["axes"][0]["delay_max_ns"] == 2_000


def test_a_scenario_that_does_not_come_out_right_gives_status_1(
    scenario: Path, capsys: Captured
) -> None:
    scenario.write_text(scenario.read_text().replace("position = 150", "position = 149"))
    assert run(["simad", "encode", str(scenario), "--axes", "left:11"]) == 1
    captured = capsys.readouterr()
    assert "axis left:11: 150 steps to -150, the node to -150" in captured.out
    assert captured.err.startswith("note: ")
    assert "149" in captured.err


def test_lines_that_lead_elsewhere_than_the_node_are_an_error(
    recording: Path, capsys: Captured
) -> None:
    axes = read_axes(None, None, "11")  # type: ignore[arg-type]  # click's, which it does not need
    with source_of(str(recording), axes, {}, None) as source:
        (right,) = source.positions()
        assert right is not None
        assert _verdict(source, [right]) == 0
        assert _verdict(source, [right + 1]) == 1
    told = f"error: axis 11: the lines lead to {right + 1}, the node to {right}\n"
    assert told in capsys.readouterr().err


def test_a_recording_that_was_cut_off_is_told(recording: Path, capsys: Captured) -> None:
    recording.write_bytes(b"".join(recording.read_bytes().splitlines(keepends=True)[:-2]))
    assert run(["simad", "encode", str(recording), "--axes", "11"]) == 0
    assert "was cut off at" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["encode", "{run}"], "--axes: expected nodes of {run}, which has 10, 11"),
        (["encode", "{run}", "--axes", "12"], "--axes: 12: no such node, {run} has bus:10, bus:11"),
        (["encode", "{run}", "--axes", "x:10"], "--axes: x:10: no such node"),
        (["encode", "{run}", "--axes", "10,10"], "expected each axis once, got 10 twice"),
        (
            ["encode", "{run}", "--axes", "10,ten"],
            "expected axes such as 10,11 or 10-12, got 'ten'",
        ),
        (["encode", "{run}", "--axes", "12-10"], "expected axes low to high, got '12-10'"),
        (["encode", "{run}", "--axes", "10", "--pins"], "--pins: expected only with --vcd"),
        (["encode", "{run}", "--axes", "10", "--at", "1s"], "--at: expected only with --plot"),
        (["encode", "{run}", "--axes", "10", "--set", "a=1"], "--set: expected a scenario"),
        (["encode", "{run}", "--axes", "10", "--seed", "1"], "--seed: expected a scenario"),
        (["encode", "{run}", "--axes", "10", "--setup", "0"], "setup: expected 1 to"),
        (["encode", "{run}", "--axes", "10", "--vcd", "{run}"], "expected a file of its own"),
        (["encode", "{run}", "--axes", "10", "--plot", "a.gif"], "drawn as PNG or SVG"),
        (["encode", "{steps}", "--axes", "left:4"], "expected numbers as in {steps}, which has no"),
        (["encode", "{steps}", "--vcd", "{out}", "--pins"], "--pins: expected a scenario or a"),
        (["encode", "{none}.csv"], "{none}.csv: No such file or directory, name a file of steps"),
        (["encode", "{none}.csv", "--axes", "4"], "{none}.csv: No such file or directory, name a"),
        (["encode", "{none}.npy", "--axes", "4"], "{none}.npy: No such file or directory, name a"),
        (["encode", "{none}.jsonl"], "{none}.jsonl: No such file or directory, name a recording"),
        (["encode", "{empty}"], "{empty}: expected steps, got none"),
        (["encode", "{toml}"], "{toml}: expected one case, got 2, use --set"),
        (["decode", "{steps}"], "{steps}: expected a value change dump, got no $enddefinitions"),
        (["decode", "{none}"], "{none}: No such file or directory, name a value change dump"),
        (["decode", "{steps}", "--dir", "D0"], "expected --dir and --steps together"),
        (["decode", "{steps}", "--json", "--csv", "-"], "--csv: expected a file together with"),
        (["decode", "{steps}", "--csv", "{steps}"], "expected a file of its own"),
        ([], ""),
    ],
)
def test_mistakes_are_one_line_and_status_2(
    arguments: list[str], told: str, recording: Path, steps: Path, tmp_path: Path, capsys: Captured
) -> None:
    empty, toml = tmp_path / "empty.csv", tmp_path / "cases.toml"
    empty.write_text("")
    toml.write_text(SCENARIO.replace("speed = 300", "speed = [60, 300]"))
    places = {
        "run": recording,
        "steps": steps,
        "out": tmp_path / "out.vcd",
        "none": tmp_path / "none",
        "empty": empty,
        "toml": toml,
    }
    assert run(["simad", *(one.format(**places) for one in arguments)]) == 2
    captured = capsys.readouterr()
    if arguments:
        assert captured.err.startswith("error: ")
        assert captured.err.count("\n") == 1
    assert told.format(**places) in captured.err
    assert captured.out == ""


@pytest.mark.slow
def test_a_few_steps_are_drawn(steps: Path, tmp_path: Path, capsys: Captured) -> None:
    picture = tmp_path / "steps.svg"
    assert run(["simad", "encode", str(steps), "--plot", str(picture)]) == 0
    assert "number 1 on" in picture.read_text()
    assert run(["simad", "encode", str(steps), "--plot", str(picture), "--at", "5us"]) == 0
    assert "number 3 on" in picture.read_text()
    capsys.readouterr()
    assert run(["simad", "encode", str(steps), "--plot", str(picture), "--at", "1s"]) == 2
    assert "expected an instant before the last step falls" in capsys.readouterr().err


def test_drawing_needs_matplotlib(
    steps: Path, tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_matplotlib(monkeypatch)
    assert run(["simad", "encode", str(steps), "--plot", str(tmp_path / "a.svg")]) == 2
    assert "install it: python -m pip install 'sacbus[plot]'" in capsys.readouterr().err


@pytest.mark.slow
def test_the_page_about_it_shows_what_it_prints_and_draws(tmp_path: Path, capsys: Captured) -> None:
    page = (ROOT / "docs" / "simad.md").read_text(encoding="utf-8")
    command, _, printed = (
        page.partition("```console\n$ sacbus ")[2].partition("```")[0].partition("\n")
    )
    scenario, picture = str(ROOT / "examples/scenarios/simad.scenario.toml"), tmp_path / "steps.svg"
    arguments = command.replace("examples/scenarios/simad.scenario.toml", scenario).split()
    assert run([str(picture) if one == "steps.svg" else one for one in arguments]) == 0
    assert capsys.readouterr().out == printed
    drawn = r"<text[^>]*>([^<]*)</text>"
    shown = (ROOT / "docs/simad/steps.svg").read_text(encoding="utf-8")
    assert re.findall(drawn, shown) == re.findall(drawn, picture.read_text(encoding="utf-8"))
