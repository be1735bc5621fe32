"""Captures as an independent reader of the format reads them: python-pcapng."""

from __future__ import annotations

import io
import warnings
from typing import Any

from pcapng import FileScanner
from pcapng.blocks import EnhancedPacket, InterfaceDescription, SectionHeader

__all__ = ["blocks_of", "interfaces_of", "packets_of", "remarks_of", "section_of", "time_ns"]

Block = Any
"""Of python-pcapng, which makes its classes' fields at run time."""


def blocks_of(capture: bytes) -> list[Block]:
    """All blocks, in order; it raises for what is no pcapng."""
    with warnings.catch_warnings():
        # Of its own table of options.
        warnings.filterwarnings("ignore", "Field type should not be", DeprecationWarning)
        return list(FileScanner(io.BytesIO(capture)))


def section_of(capture: bytes) -> Block:
    """What the capture begins with; it has no other section."""
    (section,) = [block for block in blocks_of(capture) if isinstance(block, SectionHeader)]
    return section


def interfaces_of(capture: bytes) -> list[Block]:
    return [block for block in blocks_of(capture) if isinstance(block, InterfaceDescription)]


def packets_of(capture: bytes) -> list[Block]:
    return [block for block in blocks_of(capture) if isinstance(block, EnhancedPacket)]


def time_ns(packet: Block) -> int:
    """Exact: the reader's own property is a float."""
    return int(packet.timestamp_high << 32) + int(packet.timestamp_low)


def remarks_of(packet: Block) -> dict[str, str]:
    """The lines of our comment."""
    lines = packet.options["opt_comment"].split("\n")
    return dict(line.split(": ", 1) for line in lines)
