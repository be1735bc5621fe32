"""The nodes' changes of state, among the records of a recording.

Owns their places in time: a segment says when it will be in which state, as far as it gets.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from heapq import heappop, heappush

from sacbus.kernel import Ns
from sacbus.trace.records import Changed, Moved, Record

__all__ = ["with_states"]


def with_states(records: Iterable[Record]) -> Iterator[Record | Changed]:
    """All records in order, and each change of state at its time.

    What a node would have done after the last record is not told.
    """
    order = 0
    #: What is to come: when, the order of telling, bus, node, state.
    coming: list[tuple[Ns, int, int, int, str]] = []
    #: By bus and node: the number of the first entry that counts, and the last state.
    since: dict[tuple[int, int], int] = {}
    last: dict[tuple[int, int], str] = {}

    def before(moment: Ns) -> Iterator[Changed]:
        while coming and coming[0][0] < moment:
            when, number, bus, node, state = heappop(coming)
            if number >= since[bus, node] and last.get((bus, node)) != state:
                last[bus, node] = state
                yield Changed(when, bus, node, state)

    now = 0
    for record in records:
        now = record.when
        yield from before(now)
        if type(record) is Moved:
            since[record.bus, record.node] = order
            for when, state in record.segment.states():
                heappush(coming, (when, order, record.bus, record.node, state))
                order += 1
        yield record
    yield from before(now + 1)
