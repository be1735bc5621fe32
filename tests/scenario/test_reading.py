"""Scenarios read from files: what comes out, and every mistake by its key and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.config import ConfigError
from sacbus.configuration import NodeAt
from sacbus.kernel import MS, SECOND
from sacbus.scenario import Poll, Scenario, Send, read
from tests.scenario.stage import HEAD, mistakes, scenario


def _cases() -> list[tuple[str, list[str]]]:
    found = []
    text = Path(__file__).with_name("mistakes.txt").read_text(encoding="utf-8")
    for case in text.split("----\n")[1:]:
        wrong, *told = ("\n" + case.removesuffix("\n")).split("\n! ")
        found.append((wrong[1:], told))
    return found


CASES = _cases()


@pytest.mark.parametrize(("text", "told"), CASES, ids=[" ".join(told)[:60] for _, told in CASES])
def test_mistakes_are_told_at_once_with_key_line_and_what_to_do(
    file: Path, text: str, told: list[str]
) -> None:
    assert [one.replace(f"{file.parent}/", "") for one in mistakes(file, text)] == told


def test_a_scenario_has_its_files_name_and_its_own_seed(file: Path) -> None:
    found = scenario(file, '[[step]]\nmark = "x"\n', "seed = 7\n" + HEAD)
    assert (found.title, found.file, found.end, dict(found.case)) == ("x", str(file), None, {})
    (bus,) = found.buses
    assert bus.seed == 7
    assert bus.state is None
    assert bus.nodes == (NodeAt(10), NodeAt(11))


def test_a_buss_own_seed_wins_and_the_callers_over_all(file: Path) -> None:
    text = 'seed = 7\n[[bus]]\nname = "a"\nseed = 8\n[[bus]]\nname = "b"\n[[step]]\nmark = "x"\n'
    file.write_text(text)
    (own,) = read(file)
    assert [bus.seed for bus in own.buses] == [8, 7]
    (given,) = read(file, seed=9)
    assert [bus.seed for bus in given.buses] == [9, 9]


def test_lists_make_cases_and_what_is_given_wins(file: Path) -> None:
    text = '[parameters]\nspeed = [60, 120]\nkind = "a"\n' + HEAD
    file.write_text(text + '[[step]]\nsend = "10v{speed}"\n')

    def lines(scenarios: tuple[Scenario, ...]) -> list[object]:
        return [one.steps[0].does for one in scenarios]

    assert lines(read(file)) == [Send(("10v60",)), Send(("10v120",))]
    assert [dict(one.case) for one in read(file)] == [{"speed": 60}, {"speed": 120}]
    assert lines(read(file, {"speed": 30})) == [Send(("10v30",))]
    assert lines(read(file, {"kind": ["a", "b"], "speed": 1})) == [Send(("10v1",))] * 2


def test_a_parameter_that_is_given_and_not_there_is_a_mistake(file: Path) -> None:
    text = "[parameters]\nspeed = 1\n" + HEAD + '[[step]]\nmark = "x"\n'
    assert mistakes(file, text, sped=2) == [
        "parameters: unknown parameter 'sped', line 1, known here: speed"
    ]


def test_parameters_stand_in_buses_and_a_mistake_of_all_cases_is_told_once(file: Path) -> None:
    node = '[[bus]]\n[[bus.nodes]]\naddress = 10\nustep = "{ustep}"\n'
    text = "[parameters]\nustep = [1, 9, 10]\n" + node
    assert mistakes(file, text + '[[step]]\nsend = "11m1"\n') == [
        (
            "bus 'bus': nodes[0].ustep: expected a whole number from 0 to 7, got 9, line 6, "
            "correct it, or leave it out for 0"
        ),
        (
            "bus 'bus': nodes[0].ustep: expected a whole number from 0 to 7, got 10, line 6, "
            "correct it, or leave it out for 0"
        ),
        "step[0].send: expected nodes of bus 'bus' (10), got 11, line 8, correct it",
    ]


def test_polling_each_node_is_one_step_with_a_line_of_each(file: Path) -> None:
    text = """
        [[step]]
        each = "all"
        send = ["{node}", "{node}V10"]
        every = "40 ms"
        [[step]]
        each = "10,11"
        send = "{node}"
        """
    assert [step.does for step in scenario(file, text).steps] == [
        Poll(("10", "10V10", "11", "11V10"), 40 * MS),
        Send(("10",)),
        Send(("11",)),
    ]


def test_buses_may_come_from_a_configuration(file: Path) -> None:
    (file.parent / "c.toml").write_text(HEAD + "[[bus.links]]\nkind = 'pty'\n")
    text = 'buses = "c.toml"\n[[step]]\nsend = ["10m1", "11m1"]\nevery = "40 ms"\nfor = "1 s"\n'
    found = scenario(file, text, "")
    assert [bus.nodes for bus in found.buses] == [(NodeAt(10), NodeAt(11))]
    assert found.buses[0].state is None
    assert found.steps[0].does == Poll(("10m1", "11m1"), 40 * MS, SECOND)


def test_a_configuration_that_is_wrong_is_told_with_both_places(file: Path) -> None:
    (file.parent / "c.toml").write_text("[[bus]]\nbaud = 1\n")
    (told,) = mistakes(file, 'buses = "c.toml"\n[[step]]\nmark = "x"\n')
    assert told.startswith(
        "bus 'bus': baud: expected a whole number from 300 to 4000000, got 1, line 1: "
    )
    assert "c.toml:2" in told


def test_a_file_that_is_missing_is_one_line(file: Path) -> None:
    with pytest.raises(ConfigError) as wrong:
        read(file)
    assert str(wrong.value) == (
        f"cannot read the scenario (No such file or directory), {file}, "
        "check the path and its permissions"
    )
