"""The vocabulary of scenarios: as the page says, and complete."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from sacbus.config.keys import shown
from sacbus.scenario import read, run
from sacbus.scenario.expectations import COUNTS
from sacbus.scenario.keys import EXPECT, EXPECTED
from tests.config.reference import rows
from tests.scenario.reference import TABLES

PAGE = Path(__file__).parents[2] / "docs" / "scenarios.md"
EXAMPLES = [
    text
    for page in (PAGE, PAGE.with_name("first-scenario.md"))
    for text in re.findall(r"```toml\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
]


@pytest.mark.parametrize("heading", TABLES)
def test_the_page_has_the_table_that_the_code_has(heading: str) -> None:
    text = PAGE.read_text(encoding="utf-8")
    section = re.split(rf"\n##+ {re.escape(heading)}\n", text)[1].split("\n## ")[0]
    section = section.split("\n### ")[0]
    assert [line for line in section.splitlines() if line.startswith("|")] == rows(TABLES[heading])


def test_the_page_has_no_other_table() -> None:
    found = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    assert len(found) == sum(len(rows(keys)) for keys in TABLES.values())


def test_every_default_fits_and_reads_back_from_toml() -> None:
    for key in (key for keys in TABLES.values() for key in keys if key.default is not None):
        assert key.fits(key.default)
        assert tomllib.loads(f"x = {shown(key.default)}") == {"x": key.default}


def test_everything_that_can_be_expected_has_a_key_and_every_count_is_one() -> None:
    assert {*EXPECTED} <= {key.name for key in EXPECT}
    assert {name for name, sort in EXPECTED.items() if sort == "count"} == {*COUNTS}


@pytest.mark.parametrize("text", EXAMPLES, ids=range(len(EXAMPLES)))
def test_every_example_of_the_pages_passes(file: Path, text: str) -> None:
    """Whole scenarios as they are; steps alone on a bus with nodes 10 and 11."""
    if "[[bus]]" not in text:
        text = f'[[bus]]\n[[bus.nodes]]\naddresses = "10,11"\n{text}'
    file.write_text(text, encoding="utf-8")
    for scenario in read(file):
        assert run(scenario).failures == []
