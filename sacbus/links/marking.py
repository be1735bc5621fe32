"""Ninth bits on a real port: mark parity is a ninth bit of 1, space parity one of 0.

Owns which parity stands for which bit, and the runs of bytes that have one in common: a port has
one parity at a time, so it is switched between them, when all before are out.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Final

__all__ = ["PARITIES", "runs"]

#: pyserial's words for a ninth bit of 0 and of 1: space and mark.
PARITIES: Final = ("S", "M")


def runs(data: bytes, ninth: bytes) -> Iterator[tuple[str, bytes]]:
    """Bytes that have the same ninth bit one after the other, with the parity that makes it."""
    at = 0
    for bit, same in groupby(ninth):
        end = at + len(list(same))
        yield PARITIES[bit], data[at:end]
        at = end
