"""Parameters: what they become in texts, and the cases that lists of them make."""

from __future__ import annotations

import pytest

from sacbus.config.mistake import Findings
from sacbus.scenario.parameters import Value, cases, given, put_in


def filled(value: object, **scope: Value) -> object:
    findings = Findings("x", {})
    result = put_in(value, scope, ("step",), findings, set())
    assert not findings
    return result


def test_a_text_that_is_nothing_but_a_name_becomes_the_value_itself() -> None:
    assert filled("{speed}", speed=120) == 120
    assert filled("{on}", on=True) is True
    assert filled({"a": ["{x}", 1]}, x=0.5) == {"a": [0.5, 1]}


def test_elsewhere_its_text_takes_the_place() -> None:
    assert filled("{node}m{steps}v{speed}", node=10, steps="400", speed=60) == "10m400v60"
    assert filled("is {on}", on=True) == "is true"


def test_what_is_doubled_or_no_name_stays() -> None:
    assert filled("{{node}}", node=1) == "{node}"
    assert filled("a{2}b{}{ x }", node=1) == "a{2}b{}{ x }"


def test_a_name_that_is_not_known_is_told_with_what_was_probably_meant() -> None:
    findings = Findings("x", {})
    put_in("10m{sped}", {"speed": 1}, ("step", 0, "send"), findings, set())
    put_in("{xyz}", {"speed": 1}, ("step", 1, "send"), findings, set())
    assert [str(one) for one in findings.mistakes()] == [
        "step[0].send: unknown parameter 'sped', x, did you mean 'speed'?",
        "step[1].send: unknown parameter 'xyz', x, correct it; known here: speed",
    ]


def test_lists_make_a_case_of_each_combination_and_the_last_varies_fastest() -> None:
    found = list(cases({"a": [1, 2], "b": "x", "c": [True, False]}))
    assert [case for case, _ in found] == [
        {"a": 1, "b": "x", "c": True},
        {"a": 1, "b": "x", "c": False},
        {"a": 2, "b": "x", "c": True},
        {"a": 2, "b": "x", "c": False},
    ]
    assert [varying for _, varying in found][:2] == [{"a": 1, "c": True}, {"a": 1, "c": False}]
    assert list(cases({})) == [({}, {})]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x=1", 1),
        ("x=0.5", 0.5),
        ("x=true", True),
        ("x='1'", "1"),
        ("x=10-12", "10-12"),
        ("x=[1, 2]", [1, 2]),
        ("x=a=b", "a=b"),
    ],
)
def test_a_value_on_the_command_line_is_as_in_toml_or_else_a_text(text: str, value: object) -> None:
    assert given(text) == ("x", value)


@pytest.mark.parametrize("text", ["x", "=1", "1x=1", "x={a = 1}", "x=[]", "x=1979-05-27"])
def test_what_no_parameter_can_be_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^expected "):
        given(text)
