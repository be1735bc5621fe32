"""Lines of a file or a pipe, typed at a terminal one after the other, and what is shown upon each.

Owns what of that is printed: the answers, neither echo nor prompts.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable

import click

from sacbus.terminal.background import Background
from sacbus.terminal.dialog import PROMPT, Untypable

__all__ = ["WrongLine", "type_lines"]


class WrongLine(ValueError):
    """A line that cannot be typed: where, what was expected, what came."""

    def __init__(self, number: int, fault: Untypable) -> None:
        super().__init__(
            f"this cannot be typed, standard input line {number} column {fault.column}, "
            f"expected printable ASCII, got {fault.got!r}"
        )


def type_lines(link: str, baud: int, lines: Iterable[str]) -> None:
    """Type every line that is not blank, each when the one before has been answered.

    LinkError, ConnectionError or NoAnswer in one line; WrongLine at the first that is none.
    """
    with Background(link, baud) as dialog:
        dialog.begin()
        for number, line in enumerate(lines, start=1):
            text = line.rstrip("\r\n")
            if not text.strip():
                continue
            try:
                _print(dialog.ask(text))
            except Untypable as fault:
                raise WrongLine(number, fault) from fault


def _print(shown: str) -> None:
    text = shown.removesuffix(PROMPT).strip("\n")
    if text:
        click.echo(text)
        sys.stdout.flush()
