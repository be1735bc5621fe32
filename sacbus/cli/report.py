"""``sacbus run --report``: what is gathered for the page while cases are played, and the page."""

from __future__ import annotations

import json
import shlex
from collections.abc import Collection, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Final

from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.scenario import Result
    from sacbus.scenario.page import Case
    from sacbus.trace import Recording

__all__ = ["Report"]

#: Pictures on a page at most, of cases that passed and of those that failed: each has some 100 KB.
OF_PASSED: Final = 20
OF_FAILED: Final = 100


class Report:
    """A page that is written when all is played.

    ``given``: names of the parameters that were given; ``options``: all others that tell how it was
    played. Both belong to the command line that repeats a case.
    """

    def __init__(self, path: str, given: Collection[str], options: Sequence[str]) -> None:
        self._path = Path(path)
        self._given = given
        self._options = options
        self._cases: list[Case] = []
        self._left = {True: OF_PASSED, False: OF_FAILED}

    def add(self, result: Result) -> None:
        """A case that was played, while its recording can still be read."""
        from sacbus.scenario.page import Case

        picture, note = self._picture(result)
        self._cases.append(Case(result, self._repeat(result), picture, note))

    def write(self) -> None:
        """The page with all cases; OSError when the place cannot be written."""
        from sacbus.scenario.page import page

        with fresh_file(self._path) as file:
            file.write(page(self._cases).encode())

    def _picture(self, result: Result) -> tuple[str, str]:
        """An SVG of what happened, or why there is none."""
        if result.recording is None:
            return "", "There is no picture: what happens behind a link is not recorded."
        if not self._left[result.passed]:
            return "", "There is no picture: enough others are here. Play the case alone for it."
        self._left[result.passed] -= 1
        try:
            return _drawn(result, result.recording), ""
        except ImportError:
            why = "There is no picture: it takes matplotlib (python -m pip install 'sacbus[plot]')."
            return "", why

    def _repeat(self, result: Result) -> str:
        """The command line that plays a case again."""
        scenario = result.scenario
        file = "-" if scenario.file == "standard input" else scenario.file
        words = ["sacbus", "run", file]
        for name, value in scenario.parameters.items():
            if name in self._given or name in scenario.case:
                words += ["--set", f"{name}={json.dumps(value)}"]
        return shlex.join([*words, *self._options])


def _drawn(result: Result, recording: Recording) -> str:
    from sacbus.trace.plots import draw_axes

    file = BytesIO()
    flags = [result.origin + failure.when for failure in result.failures]
    draw_axes(recording, file, "svg", since=result.origin, flags=flags)
    return file.getvalue().decode()
