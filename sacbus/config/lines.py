"""Where each key of a TOML text stands: its path to the number of its line.

Owns the one thing that tomllib does not tell. It reads only text that tomllib has taken, so nothing
is validated here: strings, comments and brackets are told apart, and that is all.

A path is the way from the top, names and indexes: ``("bus", 0, "nodes", 1, "address")``. A table
that is opened by a header stands at its header; one that is only implied, at the first key or
header that implies it; an element of an array at its first character. What lies deeper than any
configuration reaches is passed over.
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_right
from collections.abc import Mapping
from typing import Final

__all__ = ["Path", "line_of", "locate"]

Path = tuple[str | int, ...]

#: Paths of this length, or longer, are not kept: bus, nodes and their settings need five.
_DEEP: Final = 8

_BLANK: Final = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_SPACE: Final = re.compile(r"[ \t]*")
_BARE: Final = re.compile(r"[A-Za-z0-9_-]+")
#: All four kinds of strings, the long ones first. A long string may end in quotes of its own.
_STRING: Final = re.compile(
    r'"""(?:[^"\\]|\\.|"{1,2}(?!"))*"{3,5}'
    r"|'''(?:[^']|'{1,2}(?!'))*'{3,5}"
    r'|"(?:[^"\\]|\\.)*"'
    r"|'[^']*'",
    re.DOTALL,
)
#: Numbers, dates and flags: up to what can end a value. A date may hold a space.
_PLAIN: Final = re.compile(r"[^,\]}#\n]+")


def locate(text: str) -> dict[Path, int]:
    """The line, from 1, of every key, table and array element; ``text`` must be right TOML.

    RecursionError where brackets are nested deeper than Python's stack.
    """
    return _Scanner(text.replace("\r\n", "\n")).scan()


def line_of(lines: Mapping[Path, int], path: Path) -> int | None:
    """The line of ``path``, or else of the nearest thing around it; None for the whole text."""
    while path and path not in lines:
        path = path[:-1]
    return lines.get(path)


class _Scanner:
    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._ends = [hit.start() for hit in re.finditer("\n", text)]
        self._lines: dict[Path, int] = {}
        #: Arrays of tables, and the index of the last table of each.
        self._last: dict[Path, int] = {}

    def scan(self) -> dict[Path, int]:
        table: Path = ()
        self._next(_BLANK)
        while self._at < len(self._text):
            if self._text.startswith("[", self._at):
                table = self._header()
            else:
                self._pair(table)
            self._next(_BLANK)
        return self._lines

    def _header(self) -> Path:
        """``[a.b]`` or ``[[a.b]]``; the path of the table that it opens."""
        line = self._line()
        repeated = self._text.startswith("[[", self._at)
        self._at += 2 if repeated else 1
        names = self._key()
        self._at += 2 if repeated else 1
        path: Path = ()
        for name in names[:-1]:
            path = self._note((*path, name), line)
            if path in self._last:
                path = (*path, self._last[path])
        path = self._note((*path, names[-1]), line)
        if repeated:
            self._last[path] = self._last.get(path, -1) + 1
            path = self._note((*path, self._last[path]), line)
        elif len(path) < _DEEP:
            self._lines[path] = line  # also where it had only been implied before
        return path

    def _pair(self, table: Path) -> None:
        """``a.b = value``."""
        line = self._line()
        path = table
        for name in self._key():
            path = self._note((*path, name), line)
        self._at += 1  # the equals sign
        self._next(_SPACE)
        self._value(path)

    def _value(self, path: Path) -> None:
        match self._text[self._at]:
            case '"' | "'":
                self._next(_STRING)
            case "[":
                self._at += 1
                index = 0
                while not self._ended("]"):
                    self._value(self._note((*path, index), self._line()))
                    index += 1
            case "{":
                self._at += 1
                while not self._ended("}"):
                    self._pair(path)
            case _:
                self._next(_PLAIN)

    def _ended(self, bracket: str) -> bool:
        """Pass a comma and blanks, or the closing bracket: True then."""
        self._next(_BLANK)
        if self._text.startswith(",", self._at):
            self._at += 1
            self._next(_BLANK)
        if self._text.startswith(bracket, self._at):
            self._at += 1
            return True
        return False

    def _key(self) -> list[str]:
        """The names of a dotted key, and the blanks around it."""
        names: list[str] = []
        while True:
            self._next(_SPACE)
            if self._text[self._at] in "\"'":
                quoted = self._next(_STRING)
                # tomllib knows the escapes.
                names.append(next(iter(tomllib.loads(f"{quoted} = 0"))))
            else:
                names.append(self._next(_BARE))
            self._next(_SPACE)
            if not self._text.startswith(".", self._at):
                return names
            self._at += 1

    def _next(self, what: re.Pattern[str]) -> str:
        """Pass what the pattern finds here, and give it."""
        hit = what.match(self._text, self._at)
        assert hit is not None, "only right TOML is scanned"
        self._at = hit.end()
        return hit[0]

    def _note(self, path: Path, line: int) -> Path:
        """The path, cut off where it is too deep; the line where it was first seen is kept."""
        if len(path) < _DEEP:
            self._lines.setdefault(path, line)
        return path[:_DEEP]

    def _line(self) -> int:
        """The number of the line that we are on."""
        return bisect_right(self._ends, self._at - 1) + 1
