"""Scenarios as tests: which files are taken, and what is shown of those that fail."""

from __future__ import annotations

import json
import re

import pytest

# Loaded here, for pytester forgets what is first loaded within it, and numpy loads only once.
import nodes.sac  # noqa: F401
import sacbus.testing.files
import sacbus.testing.made  # noqa: F401
from tests.full_disk import needs_full_device

pytest_plugins = ["pytester"]
pytestmark = pytest.mark.slow

MOVE = """
title = "a move"
[parameters]
steps = 40
[[bus]]
nodes = [{ addresses = "10" }]
[[step]]
send = "10m{steps}v120"
[[step]]
name = "there"
expect = { node = 10, position = 40, state = "STANDBY", within = "2 s" }
"""


@pytest.fixture(autouse=True)
def _as_in_a_project(pytester: pytest.Pytester) -> None:
    pytester.makeini(
        "[pytest]\naddopts = -p no:randomly -p no:cacheprovider\n"
        "asyncio_default_fixture_loop_scope = function\nfilterwarnings = error\n"
    )


def _file(pytester: pytest.Pytester, name: str, text: str = MOVE) -> str:
    path = pytester.path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return name


def test_each_case_of_a_scenario_is_a_test(pytester: pytest.Pytester) -> None:
    _file(pytester, "deep/move.scenario.toml", MOVE.replace("steps = 40", "steps = [40, 41, 4]"))
    result = pytester.runpytest("-v")
    result.assert_outcomes(passed=1, failed=2)
    result.stdout.fnmatch_lines(
        [
            "deep/move.scenario.toml::a move[[]steps=40[]] PASSED *",
            "deep/move.scenario.toml::a move[[]steps=41[]] FAILED *",
        ]
    )


def test_a_failure_is_told_as_sacbus_run_tells_it(pytester: pytest.Pytester) -> None:
    _file(pytester, "move.scenario.toml", MOVE.replace("steps = 40", "steps = 41"))
    result = pytester.runpytest()
    result.stdout.fnmatch_lines(
        [
            "* a move *",
            "*move.scenario.toml:9: there: expected node 10: position 40, state STANDBY * 2.0* s",
            "    0.000000 s  mother: to 10 'm41v120', *",
            "    0.00* s  10: ACK to 1",
            "    node 10: STANDBY at 41, 0 RPM",
        ]
    )
    result.stdout.no_fnmatch_line("*.py:*")  # no traceback: there is nothing to see in our code


def test_a_toml_file_is_a_scenario_if_it_is_asked_for(pytester: pytest.Pytester) -> None:
    name = _file(pytester, "move.toml")
    assert pytester.runpytest().ret == pytest.ExitCode.NO_TESTS_COLLECTED
    pytester.runpytest(name).assert_outcomes(passed=1)


def test_a_project_says_which_of_its_files_are_scenarios(pytester: pytest.Pytester) -> None:
    _file(pytester, "lines/move.toml")
    _file(pytester, "other.scenario.toml")
    _file(pytester, "settings.toml", "[tool]\n")
    result = pytester.runpytest("-o", "sacbus_scenarios=lines/*.toml", "-v")
    result.assert_outcomes(passed=1)
    result.stdout.fnmatch_lines(["lines/move.toml::a move PASSED*"])


def test_a_wrong_scenario_is_told_one_line_a_mistake(pytester: pytest.Pytester) -> None:
    _file(pytester, "wrong.scenario.toml", MOVE.replace("node = 10,", "node = 11,"))
    result = pytester.runpytest()
    assert result.ret == pytest.ExitCode.INTERRUPTED
    (line,) = [one for one in result.outlines if "expected nodes of bus" in one]
    assert "wrong.scenario.toml:" in line
    assert "Traceback" not in result.stdout.str()


def test_a_scenario_is_recorded_where_asked(pytester: pytest.Pytester) -> None:
    _file(pytester, "move.scenario.toml")
    pytester.runpytest("--sacbus-record=seen").assert_outcomes(passed=1)
    (file,) = (pytester.path / "seen").iterdir()
    assert re.fullmatch(r"move\.scenario\.toml-a-move-[0-9a-f]{8}\.jsonl", file.name)
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert lines[0]["sacbus"] == "recording"
    assert lines[-1]["is"] == "end"


@needs_full_device
def test_a_scenario_that_could_not_be_recorded_fails_in_one_line(pytester: pytest.Pytester) -> None:
    _file(pytester, "move.scenario.toml")
    pytester.runpytest("--sacbus-record=seen").assert_outcomes(passed=1)
    (file,) = (pytester.path / "seen").iterdir()
    file.unlink()
    file.symlink_to("/dev/full")
    result = pytester.runpytest("--sacbus-record=seen")
    result.assert_outcomes(failed=1)
    assert (
        f"the recording seen/{file.name} could not be begun: No space left on device, "
        "nothing is kept, record elsewhere"
    ) in result.outlines
    assert "Traceback" not in result.stdout.str()
