"""A queue file as the edits that put it into a node's queue over the network.

Owns the splitting: an edit leaves what it does not name, so one that is too long for a packet is
sent as several of the same position. Source: spec, mother ("Transactions").
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from sacbus.language.queue_file import read_rows
from sacbus.wire import MAX_BODY

__all__ = ["queue_edits"]

#: The longest edit: a body may need a space for its CRC, and one more for safety (spec, mother).
MOST: Final = MAX_BODY - 2

#: The steps with their unit; and each of the other fields.
_FIELDS: Final = re.compile(r"[a-z][^a-z]*")


def queue_edits(file: Path, name: str) -> tuple[str, ...]:
    """The edits of all rows, without an address: ``q1m800v150a1d1``.

    OSError, UnicodeDecodeError or WrongRow for a file that is none.
    """
    with file.open(encoding="utf-8", newline="") as opened:
        rows = [read.row for read in read_rows(opened, name)]
    return tuple(edit for row in rows for edit in _edits(row.position, row.move().text()))


def _edits(position: int, move: str) -> Iterator[str]:
    head = edit = f"q{position}"
    if len(head) + len(move) <= MOST:
        yield head + move
        return
    fields = _FIELDS.findall(move)
    # The unit belongs to the steps: they go together.
    steps = [one for one in fields if one[0] in "mpf"]
    for field in ("".join(steps), *(one for one in fields if one not in steps)):
        if len(edit) + len(field) > MOST:
            yield edit
            edit = head
        edit += field
    yield edit
