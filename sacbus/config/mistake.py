"""What is wrong with a configuration, one line each, and the gathering of all of it.

Owns how a mistake reads: which key, what was expected and what came, where, and what to do.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from sacbus.config.lines import Path, line_of

__all__ = ["ConfigError", "Findings", "Mistake"]

_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")


@dataclass(frozen=True, slots=True)
class Mistake:
    """One thing that is wrong, or odd: ``KEY: WHAT, FILE:LINE, WHAT TO DO``.

    ``line`` and ``column`` count from 1; None where it is about the file as a whole. ``key`` is the
    full one, ``bus 'left': links[1].listen``, or empty.
    """

    file: str
    line: int | None
    column: int | None
    key: str
    what: str
    remedy: str

    def __str__(self) -> str:
        place = [self.file, *(str(one) for one in (self.line, self.column) if one is not None)]
        key = f"{self.key}: " if self.key else ""
        return f"{key}{self.what}, {':'.join(place)}, {self.remedy}"


class ConfigError(ValueError):
    """A configuration that cannot be used: all its ``mistakes``; the text has one a line."""

    mistakes: tuple[Mistake, ...]

    def __init__(self, mistakes: Sequence[Mistake]) -> None:
        super().__init__("\n".join(map(str, mistakes)))
        self.mistakes = tuple(mistakes)


class Findings:
    """Mistakes as they are found, told in the order of the text."""

    def __init__(self, file: str, lines: Mapping[Path, int]) -> None:
        self._file = file
        self._lines = lines
        self._found: list[tuple[Path, str, str]] = []
        #: What a part of the text is called where its path would say less.
        self.names: dict[Path, str] = {}

    def __bool__(self) -> bool:
        return bool(self._found)

    def add(self, path: Path, what: str, remedy: str) -> None:
        """Something is wrong at ``path``."""
        self._found.append((path, what, remedy))

    def line(self, path: Path) -> int | None:
        """The line of a key, or of what is around it."""
        return line_of(self._lines, path)

    def place(self, path: Path) -> str:
        """A key elsewhere in the text, for those who have to look there: its line, if known."""
        line = self.line(path)
        return self.key(path) if line is None else f"line {line}"

    def key(self, path: Path) -> str:
        """A path as people read it."""
        for length in range(len(path), 0, -1):
            if (name := self.names.get(path[:length])) is not None:
                rest = _spelled(path[length:])
                return f"{name}: {rest}" if rest else name
        return _spelled(path)

    def mistakes(self) -> tuple[Mistake, ...]:
        """All of them, by their lines; what is about the whole text comes first."""
        found = [
            Mistake(self._file, self.line(path), None, self.key(path), what, remedy)
            for path, what, remedy in self._found
        ]
        return tuple(sorted(found, key=lambda one: one.line or 0))


def _spelled(path: Path) -> str:
    """``nodes[1].address``; names that need it are quoted, so that all stays on one line."""
    text = ""
    for part in path:
        if isinstance(part, int):
            text += f"[{part}]"
        else:
            name = part if _BARE.fullmatch(part) else repr(part)
            text += f".{name}" if text else name
    return text
