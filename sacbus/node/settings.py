"""What a configuration may say about a node: a kind's settings, their limits, and what fits.

Owns the rules by which values are held against a model; knows no kind.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = [
    "NodeSettings",
    "Setting",
    "SettingError",
    "misfits",
    "setting_list",
    "settings_from",
]


@dataclass(frozen=True)
class NodeSettings:
    """Base of a kind's settings: a frozen dataclass, each field with ``help`` in its metadata.

    Whole numbers carry ``low`` and ``high`` there, words their ``choices``, text its ``form`` in
    words and the ``pattern`` that it matches; flags need no more.
    ``given`` names those that somebody asked for, as opposed to defaults: they win over memory.
    """

    given: frozenset[str] = field(default=frozenset(), init=False, repr=False, compare=False)


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of a kind, for help texts: its name, default, what is allowed, what it means."""

    name: str
    default: object
    allowed: str
    help: str


class SettingError(ValueError):
    """A setting that a kind does not take: which, what was expected, what came."""


def setting_list(model: type[NodeSettings]) -> list[Setting]:
    """The settings of a kind in the order of their declaration."""
    return [
        Setting(one.name, one.default, _allowed(one.metadata, one.default), one.metadata["help"])
        for one in _fields(model)
    ]


def settings_from(model: type[NodeSettings], given: Mapping[str, object]) -> NodeSettings:
    """Settings checked against their model; SettingError for the first that does not fit."""
    for name, expected in misfits(model, given).items():
        known = any(name == one.name for one in _fields(model))
        got = f", got {given[name]!r}" if known else ""
        raise SettingError(f"setting {name!r}: expected {expected}{got}")
    settings = model(**given)
    object.__setattr__(settings, "given", frozenset(given))
    return settings


def misfits(model: type[NodeSettings], given: Mapping[str, object]) -> dict[str, str]:
    """Every given setting that its model does not take, in order, with what was expected."""
    fields = {one.name: one for one in _fields(model)}
    found: dict[str, str] = {}
    for name, value in given.items():
        known = fields.get(name)
        if known is None:
            found[name] = f"one of {', '.join(fields)}"
        elif not _fits(known.metadata, known.default, value):
            found[name] = _allowed(known.metadata, known.default)
    return found


def _fields(model: type[NodeSettings]) -> list[dataclasses.Field[Any]]:
    """The fields that are settings; ``Any``: of whatever type each is."""
    return [one for one in dataclasses.fields(model) if one.name != "given"]


def _fits(metadata: Mapping[str, Any], default: object, value: object) -> bool:
    if "choices" in metadata:
        return value in metadata["choices"]
    if "pattern" in metadata:
        return isinstance(value, str) and re.fullmatch(metadata["pattern"], value) is not None
    if isinstance(default, bool) or isinstance(value, bool):
        return isinstance(default, bool) and isinstance(value, bool)
    return isinstance(value, int) and metadata["low"] <= value <= metadata["high"]


def _allowed(metadata: Mapping[str, Any], default: object) -> str:
    if "choices" in metadata:
        return " or ".join(metadata["choices"])
    if "form" in metadata:
        return str(metadata["form"])
    if isinstance(default, bool):
        return "true or false"
    return f"a whole number from {metadata['low']} to {metadata['high']}"
