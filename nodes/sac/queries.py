"""Queries: the commands that only show something, and what each of them shows.

Owns which values of a node's parts stand on which screen; how a screen looks is ``screens.py``'s
business, and the queue's that of ``sacbus.language``.
Source: manual, Appendix C; spec, "Two ports, two manners", "Others".
"""

from __future__ import annotations

from typing import assert_never

from nodes.sac import screens
from nodes.sac.command import CommandProcessor
from nodes.sac.memory import Memory
from nodes.sac.queue import CONTINUOUS_POSITION, THROW_AWAY_POSITION
from sacbus.language import (
    QUEUE_LENGTH,
    ShowConfiguration,
    ShowMemory,
    ShowQueue,
    ShowReferences,
    ShowSession,
    ShowVelocity,
)
from sacbus.language.queue_file import QueueRow
from sacbus.language.queue_screen import QueueScreen

__all__ = ["Query", "answer"]

Query = ShowQueue | ShowReferences | ShowConfiguration | ShowSession | ShowVelocity | ShowMemory
"""A command that is answered on the terminal only."""


def answer(
    query: Query, commands: CommandProcessor, memory: Memory, flags: screens.Flags
) -> list[str]:
    """The lines that a query shows, without their ends."""
    match query:
        case ShowQueue():
            return _queue(commands)
        case ShowReferences():
            return screens.references(commands.references)
        case ShowConfiguration():
            return screens.configuration(memory.values())
        case ShowSession():
            return screens.session(commands.session, flags)
        case ShowVelocity():
            return screens.velocity(commands.session)
        case ShowMemory():
            return _memory(memory, debug=flags.debug)
        case _:
            assert_never(query)


def _queue(commands: CommandProcessor) -> list[str]:
    """The queue; in debug mode with its hidden positions (manual, "Continuous")."""
    queue = commands.queue
    positions = range(1, QUEUE_LENGTH + 1)
    if commands.debug:
        positions = range(CONTINUOUS_POSITION, THROW_AWAY_POSITION + 1)
    rows = tuple(QueueRow(position, queue.row(position)) for position in positions)
    return QueueScreen(rows, queue.next_free).lines()


def _memory(memory: Memory, *, debug: bool) -> list[str]:
    values = memory.values()
    if debug:
        return screens.dump(screens.image(values, memory.pins, memory.queue or ()))
    return screens.eeprom(values, memory.pins)
