"""One table of a configuration held against the keys it may have.

Owns the mistakes that a table can have by itself: keys that are not known, values that do not fit,
keys that are missing. What is right is handed on; what is not, and what may be a misspelling of
something else, is remembered, so that nobody complains of it a second time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from sacbus.config.keys import Key, shown
from sacbus.config.lines import Path
from sacbus.config.mistake import Findings

__all__ = ["Table", "instead", "nearest", "remedy", "tables"]


@dataclass(frozen=True, slots=True)
class Table:
    """What is right in a table. ``Any``: each value is of the type that its key takes."""

    path: Path
    values: Mapping[str, Any]
    #: Keys that are there with a value that does not fit, or perhaps under another name.
    unsure: frozenset[str]
    #: Misspelled keys by what they probably mean.
    spelled: Mapping[str, str]

    def get(self, name: str, default: object = None) -> Any:  # noqa: ANN401 (see above)
        """The value of a key; ``default`` where it is left out, or wrong."""
        return self.values.get(name, default)

    def lacks(self, name: str) -> bool:
        """Whether it is certain that nobody gave this key."""
        return name not in self.values and name not in self.unsure

    def at(self, name: str) -> Path:
        """Where a key stands in the text."""
        return (*self.path, self.spelled.get(name, name))

    @classmethod
    def read(
        cls,
        findings: Findings,
        path: Path,
        content: Mapping[str, object],
        keys: Sequence[Key],
        *,
        whole: bool = True,
    ) -> Table:
        """Check ``content``. Unless ``whole``, there may be more keys than are known here."""
        known = {key.name: key for key in keys}
        values: dict[str, object] = {}
        unsure: set[str] = set()
        spelled: dict[str, str] = {}
        for name, value in content.items():
            key = known.get(name)
            if key is None:
                # A key that is there already is not what was meant.
                meant = nearest(name, [one for one in known if one not in content])
                if meant is not None:
                    unsure.add(meant)
                    spelled[meant] = name
                    if isinstance(value, list | dict) and meant in _SECTIONS:
                        values[meant] = value  # so that its own mistakes are told as well
                if whole or meant is not None:
                    findings.add((*path, name), "unknown key", _in_place_of(meant, known))
            elif key.fits(value):
                values[name] = value
            else:
                unsure.add(name)
                expected = f"expected {key.allowed}, got {shown(value)}"
                findings.add((*path, name), expected, remedy(key, value))
        for key in keys:
            if key.required and key.name not in values and key.name not in unsure:
                findings.add(path, f"expected {key.name} ({key.allowed}), got none", "give one")
        return cls(path, values, frozenset(unsure), spelled)


#: Keys that hold further tables.
_SECTIONS = frozenset({"bus", "nodes", "links"})


def tables(
    findings: Findings, path: Path, value: object, header: str
) -> list[tuple[Path, Mapping[str, object]]]:
    """The tables of an array of tables, each with its path; what is no table is told.

    A single table in its place is told too, and then read as if it were the array's only one.
    """
    if isinstance(value, dict):
        findings.add(
            path, f"expected tables under [[{header}]], got one table", f"write [[{header}]]"
        )
        return [(path, value)]
    found: list[tuple[Path, Mapping[str, object]]] = []
    for number, one in enumerate(value if isinstance(value, list) else ()):
        if isinstance(one, dict):
            found.append(((*path, number), one))
        else:
            what = f"expected a table, got {shown(one)}"
            findings.add((*path, number), what, f"write it under [[{header}]]")
    return found


def remedy(key: Key, value: object = None) -> str:
    """What to do where the value of a key does not fit."""
    if isinstance(value, str) and (meant := nearest(value, key.choices)) is not None:
        return f"did you mean {meant!r}?"
    if key.required or (key.default is None and not key.otherwise):
        return "correct it"
    if key.default is None:
        return f"correct it, or leave it out: {key.otherwise}"
    return f"correct it, or leave it out for {shown(key.default)}"


def nearest(word: str, known: Collection[str]) -> str | None:
    """The known word that was probably meant."""
    return next(iter(get_close_matches(word, known, n=1)), None)


def instead(word: str, known: Collection[str]) -> str:
    """What to do about a word that is none of the known ones."""
    return _in_place_of(nearest(word, known), known)


def _in_place_of(meant: str | None, known: Collection[str]) -> str:
    if meant is not None:
        return f"did you mean {meant!r}?"
    return f"remove it; known here: {', '.join(known)}"
