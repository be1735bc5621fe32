"""Parameters of a scenario: their values, the cases that lists of them make, and where they stand.

Owns ``{name}`` in texts. A text that is nothing but ``{name}`` becomes the value itself, a number
if it is one; anywhere else its text takes the place. ``{{name}}`` stays ``{name}``.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from itertools import product
from typing import Final

from sacbus.config.keys import shown
from sacbus.config.lines import Path
from sacbus.config.mistake import Findings

__all__ = ["RESERVED", "Value", "cases", "given", "is_value", "put_in"]

Value = bool | int | float | str

#: Names that steps give a meaning to, and by which key.
RESERVED: Final = {"node": "each", "round": "repeat"}

_NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_PLACE: Final = re.compile(r"\{(\{?)([A-Za-z_][A-Za-z0-9_]*)\}(\}?)")

#: Cases of one scenario at most: matrices grow quickly.
MOST_CASES: Final = 10_000


def is_value(value: object) -> bool:
    """Whether a parameter can have this value, or each of these."""
    if isinstance(value, list):
        return bool(value) and all(isinstance(one, bool | int | float | str) for one in value)
    return isinstance(value, bool | int | float | str)


def given(text: str) -> tuple[str, object]:
    """``NAME=VALUE`` of a command line: a value as in TOML, or else a text; ValueError."""
    name, equals, value = text.partition("=")
    if not equals or not _NAME.fullmatch(name):
        raise ValueError(f"expected NAME=VALUE, got {text!r}")
    try:
        read: object = tomllib.loads(f"x = {value}")["x"]
    except (tomllib.TOMLDecodeError, RecursionError):
        read = value
    if not is_value(read):
        raise ValueError(f"expected a number, a text, true or false, or a list, got {value!r}")
    return name, read


def cases(values: Mapping[str, object]) -> Iterator[tuple[dict[str, Value], dict[str, Value]]]:
    """Each combination of the values in lists: all parameters, and those that vary, by name.

    The last list varies fastest.
    """
    varying = [name for name, value in values.items() if isinstance(value, list)]
    lists = [value if isinstance(value, list) else [value] for value in values.values()]
    for combination in product(*lists):
        case = dict(zip(values, combination, strict=True))
        yield case, {name: case[name] for name in varying}


def put_in(
    value: object, scope: Mapping[str, Value], path: Path, findings: Findings, found: set[str]
) -> object:
    """``value`` with its places filled; names that are not known go to ``findings``.

    ``found`` gathers the names that were used.
    """
    match value:
        case str():
            return _text(value, scope, path, findings, found)
        case dict():
            return {
                key: put_in(one, scope, (*path, key), findings, found) for key, one in value.items()
            }
        case list():
            return [
                put_in(one, scope, (*path, index), findings, found)
                for index, one in enumerate(value)
            ]
        case _:
            return value


def _text(
    text: str, scope: Mapping[str, Value], path: Path, findings: Findings, found: set[str]
) -> object:
    whole = _PLACE.fullmatch(text)
    if whole is not None and not whole[1] and whole[2] in scope:
        found.add(whole[2])
        return scope[whole[2]]

    def value_of(place: re.Match[str]) -> str:
        opened, name, closed = place[1], place[2], place[3]
        if opened and closed:
            return f"{{{name}}}"
        if name not in scope:
            findings.add(path, f"unknown parameter {name!r}", _instead(name, scope))
            return place[0]
        found.add(name)
        one = scope[name]
        return f"{opened}{one if isinstance(one, str) else shown(one)}{closed}"

    return _PLACE.sub(value_of, text)


def _instead(name: str, scope: Mapping[str, Value]) -> str:
    if name in RESERVED:
        return f"{{{name}}} stands only where a step has {RESERVED[name]}"
    near = get_close_matches(name, list(scope), n=1)
    if near:
        return f"did you mean {near[0]!r}?"
    known = ", ".join(scope) or "none"
    return f"correct it; known here: {known}"
