"""Results as JUnit's XML, as continuous integration reads it.

Owns that form: a suite for each file, a case for each scenario, its time the bus time it took, so
that the same run gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import groupby
from typing import Final
from xml.etree import ElementTree as ET

from sacbus.kernel import SECOND, Ns
from sacbus.scenario.result import Result

__all__ = ["junit", "told"]

#: What XML 1.0 has no way to hold: control characters of a packet's body.
_UNTELLABLE: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(results: Sequence[Result]) -> str:
    """One document with all results, in their order."""
    root = ET.Element("testsuites", _numbers(results))
    for file, group in groupby(results, key=lambda one: one.scenario.file):
        of_file = list(group)
        suite = ET.SubElement(root, "testsuite", {"name": told(file), **_numbers(of_file)})
        for result in of_file:
            case = ET.SubElement(
                suite,
                "testcase",
                {
                    "classname": told(file),
                    "name": told(result.name),
                    "time": _seconds(result.ended),
                },
            )
            for failure in result.failures:
                element = ET.SubElement(
                    case, "failure", {"type": "expectation", "message": told(str(failure))}
                )
                element.text = told("\n".join(failure.lines()))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _numbers(results: Sequence[Result]) -> dict[str, str]:
    return {
        "tests": str(len(results)),
        "failures": str(sum(not one.passed for one in results)),
        "errors": "0",
        "time": _seconds(sum(one.ended for one in results)),
    }


def _seconds(time: Ns) -> str:
    return f"{time / SECOND:.6f}"


def told(text: str) -> str:
    """The text, with what cannot stand in XML or in HTML told by its number."""
    return _UNTELLABLE.sub(lambda found: f"\\x{ord(found[0]):02x}", text)
