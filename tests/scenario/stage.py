"""Scenarios in a line or two for the tests: written to a file, read, played."""

from __future__ import annotations

from pathlib import Path
from textwrap import dedent

import pytest

from sacbus.config import ConfigError
from sacbus.scenario import Result, Scenario, read, run

__all__ = ["HEAD", "failures", "mistakes", "played", "scenario"]

#: Nodes 10 and 11, on lines 1 to 3.
HEAD = '[[bus]]\n[[bus.nodes]]\naddresses = "10,11"\n'


def scenario(file: Path, text: str, head: str = HEAD) -> Scenario:
    """The one case of a scenario."""
    file.write_text(head + dedent(text))
    (one,) = read(file)
    return one


def played(file: Path, text: str, head: str = HEAD) -> Result:
    """What comes of it in virtual time."""
    return run(scenario(file, text, head))


def failures(file: Path, text: str, head: str = HEAD) -> list[str]:
    """What is said of what failed, with the line in place of the file."""
    return [str(one).replace(f"{file}:", "line ") for one in played(file, text, head).failures]


def mistakes(file: Path, text: str, **given: object) -> list[str]:
    """What is said of a scenario that is wrong, with the line in place of the file."""
    file.write_text(text)
    with pytest.raises(ConfigError) as wrong:
        read(file, given)
    told = [str(one).replace(f"{file}:", "line ") for one in wrong.value.mistakes]
    return [one.replace(str(file), "-") for one in told]
