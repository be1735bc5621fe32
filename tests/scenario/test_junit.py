"""Results as JUnit's XML."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from sacbus.kernel import SECOND
from sacbus.scenario import Failure, Result, Scenario
from sacbus.scenario.junit import junit


def result(
    file: str, title: str, *failures: Failure, ended: int = SECOND, **case: object
) -> Result:
    return Result(Scenario(title, (), (), case=case, file=file), list(failures), ended)


FAILURE = Failure(SECOND, "packet '\x12'", "none & <nothing>", "go", "a.toml:7", ("0 s  10: x",))


def test_a_suite_for_each_file_and_a_case_for_each_scenario() -> None:
    text = junit(
        [
            result("a.toml", "one", FAILURE, speed=60),
            result("a.toml", "one", ended=SECOND // 2, speed=120),
            result("b.toml", "two"),
        ]
    )
    root = ET.fromstring(text)  # noqa: S314 (our own)
    assert root.attrib == {"tests": "3", "failures": "1", "errors": "0", "time": "2.500000"}
    assert [(one.get("name"), one.get("tests")) for one in root] == [
        ("a.toml", "2"),
        ("b.toml", "1"),
    ]
    cases = root.findall("testsuite/testcase")
    assert [(one.get("name"), one.get("time")) for one in cases] == [
        ("one [speed=60]", "1.000000"),
        ("one [speed=120]", "0.500000"),
        ("two", "1.000000"),
    ]


def test_a_failure_has_all_that_is_told_and_no_character_that_xml_has_not() -> None:
    root = ET.fromstring(junit([result("a.toml", "one", FAILURE)]))  # noqa: S314 (our own)
    (failure,) = root.iter("failure")
    told = "a.toml:7: go: expected packet '\\x12', got none & <nothing>, at 1.000000 s"
    assert failure.get("message") == told
    assert failure.text == f"{told}\n    0 s  10: x"


def test_without_results_it_is_a_document_all_the_same() -> None:
    root = ET.fromstring(junit([]))  # noqa: S314 (our own)
    assert root.attrib["tests"] == "0"
