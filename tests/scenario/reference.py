"""The tables of docs/scenarios.md as the code has them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from sacbus.config.keys import Key
from sacbus.scenario.keys import DEEDS, EXPECT, PIN, POWER, QUEUE, SEND, STEP, TOP, TURN, TYPE

__all__ = ["TABLES"]

#: The heading above each table, and its keys.
TABLES: Final[Mapping[str, Iterable[Key]]] = {
    "The whole": TOP,
    "A step: `[[step]]`": STEP,
    "What a step does": DEEDS,
    "With `send`": SEND,
    "`type`": TYPE,
    "`pin`": PIN,
    "`turn`": TURN,
    "`power`": POWER,
    "`queue`": QUEUE,
    "`expect`, and `after` with a table": EXPECT,
}
