"""The expectations of a scenario's file: a table under ``expect``, or ``after``, to its value.

Owns the reading of these tables, and of addresses as steps name them. What is wrong goes to the
findings, and then there is no value.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sacbus.config.mistake import Findings
from sacbus.config.notation import addresses
from sacbus.config.table import Table
from sacbus.configuration import Configuration
from sacbus.kernel import Ns
from sacbus.scenario.expectations import (
    Counted,
    Expectation,
    NodeIs,
    PacketSeen,
    Shown,
    Silent,
    Straight,
    Together,
)
from sacbus.scenario.keys import BESIDE, EXPECT, EXPECTED
from sacbus.scenario.quantity import bounds, nanoseconds
from sacbus.wire import DC1, DC2

__all__ = ["ExpectationReader", "time_of"]


class ExpectationReader:
    """Reads expectations; ``buses`` tell what all nodes are."""

    def __init__(self, findings: Findings, buses: Sequence[Configuration]) -> None:
        self._findings = findings
        self._buses = buses

    def read(self, table: Table, bus: str) -> Expectation | None:
        sorts = {EXPECTED[name]: name for name in EXPECTED if name in table.values}
        if not sorts:
            if all(map(table.lacks, EXPECTED)):
                what = f"expected something to look at ({', '.join(EXPECTED)}), got nothing"
                self._findings.add(table.path, what, "give one")
            return None
        if len(sorts) > 1:
            what = f"expected one sort of thing, got {' and '.join(sorts.values())}"
            self._findings.add(table.path, what, "make several steps of it")
            return None
        (sort,) = sorts
        within, lasting = time_of(table, "within") or 0, time_of(table, "for") or 0
        if within and lasting:
            self._findings.add(table.at("for"), "expected within or for, got both", "leave one out")
        self._beside(table, sort, sorts[sort])
        nodes = self.nodes(table.get("node"), bus) if "node" in table.values else None
        if sort in ("node", "shown", "start_skew", "deviation") and nodes is None:
            if table.lacks("node"):
                self._findings.add(
                    table.path, f"expected node ({EXPECT[0].allowed}), got none", "give one"
                )
            return None
        match sort:
            case "node":
                assert nodes is not None
                return NodeIs(
                    nodes,
                    _bounds(table, "position"),
                    _bounds(table, "velocity"),
                    table.get("state"),
                    table.get("pin", {}),
                    within,
                    lasting,
                    bus,
                )
            case "shown":
                assert nodes is not None
                return self._shown(table, nodes, within, bus)
            case "packet":
                return self._packet(table, within, bus)
            case "start_skew":
                return Together(nodes or (), nanoseconds(table.get("start_skew")), bus)
            case "deviation":
                return Straight(nodes or (), table.get("deviation"), bus)
            case "silence":
                return Silent(nanoseconds(table.get("silence")), table.get("from"), bus)
            case _:
                counts = {
                    name: bounds(table.get(name))
                    for name in EXPECTED
                    if EXPECTED[name] == "count" and name in table.values
                }
                return Counted(counts, nodes, within, lasting, bus)

    def _beside(self, table: Table, sort: str, name: str) -> None:
        """What says more of one sort of thing, and nothing of this."""
        for beside, of in BESIDE.items():
            if beside in table.values and sort not in of:
                other = {"node": "from", "from": "node"}.get(beside, "")
                meant = sort in BESIDE.get(other, ()) and other not in table.values
                what = f"expected none with {name}, got one"
                remedy = f"did you mean {other!r}?" if meant else "remove it"
                self._findings.add(table.at(beside), what, remedy)

    def _shown(
        self, table: Table, nodes: tuple[int, ...], within: Ns, bus: str
    ) -> Expectation | None:
        if len(nodes) != 1:
            self._findings.add(table.at("node"), "expected one node", "make a step of each")
            return None
        return Shown(nodes[0], table.get("shown"), within, bus)

    def _packet(self, table: Table, within: Ns, bus: str) -> Expectation:
        body: bytes | None = None
        kind, source, destination = "packet", table.get("from"), table.get("to")
        if "packet" in table.values:
            body = table.get("packet").encode("latin-1", "replace")
        if "soft_op" in table.values:
            body = bytes((DC1 if table.get("soft_op") == "start" else DC2,))
            destination = 0
        kind = table.get("answer", kind)
        return PacketSeen(
            kind,
            body,
            table.get("pattern"),
            source,
            destination,
            table.get("count", 1),
            within,
            bus,
        )

    def nodes(self, given: Any, bus: str) -> tuple[int, ...]:  # noqa: ANN401 (has been looked at)
        """Addresses as ``node`` and ``each`` take them; ``all``: of that bus, or of the first."""
        if given == "all":
            there = [one for one in self._buses if not bus or one.name == bus]
            return tuple(node.address for one in there[:1] for node in one.every_node)
        return addresses(given) if isinstance(given, str) else (given,)


def time_of(table: Table, name: str) -> Ns | None:
    """A time in a table, where there is one."""
    return nanoseconds(table.get(name)) if name in table.values else None


def _bounds(table: Table, name: str) -> Any:  # noqa: ANN401 (what bounds it, or None)
    return bounds(table.get(name)) if name in table.values else None
