"""docs/testing.md: what it shows is run, and what it says that is printed is printed."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

# Loaded here, for pytester forgets what is first loaded within it, and numpy loads only once.
import nodes.sac  # noqa: F401
import sacbus.testing.files
import sacbus.testing.made  # noqa: F401

pytest_plugins = ["pytester"]
pytestmark = pytest.mark.slow

PAGE = (Path(__file__).parents[2] / "docs" / "testing.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"(<!-- fails -->\n)?```(\w+)\n(.*?)```", PAGE, re.DOTALL)
PASSING = [text for fails, language, text in BLOCKS if language == "python" and not fails]
FAILING = [text for fails, _, text in BLOCKS if fails]
SHOWN = [text for _, language, text in BLOCKS if language == "text"]


def _run(pytester: pytest.Pytester, text: str, *options: str) -> pytest.RunResult:
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    pytester.makepyfile(test_page=text)
    return pytester.runpytest("-p", "no:randomly", *options)


@pytest.mark.parametrize("text", PASSING, ids=[re.findall(r"test_\w+", one)[0] for one in PASSING])
def test_an_example_of_the_page_passes(pytester: pytest.Pytester, text: str) -> None:
    result = _run(pytester, text, "-W", "error")
    result.assert_outcomes(passed=text.count("def test_"))


def test_a_failure_looks_as_the_page_shows_it(pytester: pytest.Pytester) -> None:
    (failing,), (shown,) = FAILING, SHOWN
    result = _run(pytester, failing)
    result.assert_outcomes(failed=1)
    for part in shown.split("…\n"):
        assert part in result.stdout.str()


@pytest.mark.parametrize("strict", [True, False])
def test_the_warning_of_pytest_asyncio_is_met_and_goes_as_the_page_says(
    pytester: pytest.Pytester, *, strict: bool
) -> None:
    (settings,) = (text for _, language, text in BLOCKS if language == "toml" and "pytest" in text)
    path = pytester.path / "pyproject.toml"
    plain = "[tool.pytest.ini_options]\n" + 'filterwarnings = ["error"]\n' * strict
    (pytester.path / "test_it.py").write_text("def test_it(): pass\n")
    path.write_text(plain)
    met = pytester.runpytest_subprocess("-p", "no:randomly")
    assert "asyncio_default_fixture_loop_scope" in met.stdout.str() + met.stderr.str()
    assert ("1 passed" in met.stdout.str()) is not strict
    path.write_text(settings + plain.partition("\n")[2])
    gone = pytester.runpytest_subprocess("-p", "no:randomly")
    gone.assert_outcomes(passed=1)
    assert "is unset" not in gone.stdout.str() + gone.stderr.str()


def test_the_options_in_its_snippet_are_pytest_s(pytester: pytest.Pytester) -> None:
    (command,) = re.findall(r"run: pytest (.+)", PAGE)
    _run(pytester, PASSING[0], *command.split()).assert_outcomes(passed=1)
    assert (pytester.path / "results.xml").is_file()
    assert list((pytester.path / "recordings").glob("*.jsonl"))
