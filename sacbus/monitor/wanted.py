"""What a user asks the monitor for: one value."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Wanted"]


@dataclass(frozen=True, slots=True)
class Wanted:
    """What to look at, and how to show it.

    ``link``: a path or URL; None for the one bus that runs here. ``baud`` and ``kind`` are for a
    link that no bus of ours serves; None: the kind's own rate, and ``sac``. ``nodes`` and
    ``errors`` leave out entries that are not about these nodes, or no fault. ``clock``: time of
    day. ``wait``: for what is not there yet, or has gone. ``pcap``: a descriptor to which a capture
    is written, by its number; standard output's puts it in place of the text.
    """

    link: str | None = None
    baud: int | None = None
    kind: str | None = None
    as_json: bool = False
    verbose: bool = False
    clock: bool = False
    wait: bool = False
    nodes: frozenset[int] = frozenset()
    errors: bool = False
    pcap: int | None = None
