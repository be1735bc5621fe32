"""What the parts of a configuration have against each other.

Owns the rules that no part can break alone: one address once on a bus, one protocol on a line, one
link at one place, one memory for one bus. What is wrong by itself has been told before and takes no
part here, so that no mistake brings another one with it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from ipaddress import IPv4Address, IPv6Address, ip_address

from sacbus.config import lines
from sacbus.config.draft import BusDraft, Draft
from sacbus.config.mistake import Findings
from sacbus.config.notation import endpoint_text, ranges
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt, terminal_path

__all__ = ["clashes"]


def clashes(draft: Draft, findings: Findings) -> None:
    """Look for what does not go together; it goes to ``findings``."""
    _names(draft.buses, findings)
    for bus in draft.buses:
        _addresses(bus, findings)
        _protocols(bus, findings)
    _memories(draft.buses, findings)
    _places(draft.buses, findings)
    _terminals(draft.buses, findings)
    _real_time(draft, findings)


def _names(buses: list[BusDraft], findings: Findings) -> None:
    """Buses are told by their names, but for those of one name."""
    first: dict[str, BusDraft] = {}
    for bus in buses:
        if bus.name is None:
            continue
        # Also on systems that do not tell Left from left their memories are to be two.
        other = first.setdefault(bus.name.casefold(), bus)
        if other is bus:
            findings.names[bus.table.path] = f"bus {bus.name!r}"
            continue
        findings.add(
            bus.table.at("name"),
            f"expected a name of its own, got {bus.name!r}, which "
            f"{findings.place(other.table.path)} has",
            "give each bus its own",
        )


def _addresses(bus: BusDraft, findings: Findings) -> None:
    taken: dict[int, lines.Path] = {}
    for node in bus.nodes:
        again: dict[lines.Path, list[int]] = {}
        for address in node.addresses:
            holder = taken.setdefault(address, node.addressed)
            if holder != node.addressed:
                again.setdefault(holder, []).append(address)
        for holder, both in again.items():
            findings.add(
                node.addressed,
                f"expected each address once on a bus, got {ranges(sorted(both))}, which "
                f"{findings.place(holder)} has",
                "change one of them",
            )


def _protocols(bus: BusDraft, findings: Findings) -> None:
    """All nodes speak what the bus is said to speak, or else what the first of them does."""
    spoken, says_so = bus.protocol, bus.table.at("protocol")
    for node in bus.nodes:
        if node.kind is None or node.protocol is None:
            continue
        protocol = node.protocol.name
        if spoken is None:
            spoken, says_so = protocol, node.table.at("kind")
        if protocol != spoken:
            findings.add(
                node.table.at("kind"),
                f"expected a kind that speaks {spoken} as {findings.place(says_so)} does, got "
                f"{node.kind.name!r}, which speaks {protocol}",
                "put it on another bus",
            )


def _memories(buses: list[BusDraft], findings: Findings) -> None:
    """No bus keeps its memory inside another's directory, where that one's nodes keep theirs."""
    kept = [
        (os.path.normpath(bus.state / bus.name), bus)
        for bus in buses
        if bus.state is not None and bus.name is not None
    ]
    for directory, bus in kept:
        for around, other in kept:
            if directory.startswith(around + os.sep):
                findings.add(
                    bus.table.at("state"),
                    f"expected a directory of its own, got one inside {around!r}, where the bus of "
                    f"{findings.place(other.table.path)} keeps its nodes' memory",
                    "choose another one",
                )


def _places(buses: list[BusDraft], findings: Findings) -> None:
    taken: list[tuple[Place, lines.Path]] = []
    for bus in buses:
        for link in bus.links:
            if link.place is None:
                continue
            for other, holder in taken:
                what = _same(link.place, other)
                if what is not None:
                    findings.add(
                        link.spot,
                        f"expected {what} of its own, got {_spelled(link.place)!r}, "
                        f"which {findings.place(holder)} has",
                        "change one of them",
                    )
                    break
            taken.append((link.place, link.spot))


def _same(one: Place, other: Place) -> str | None:
    """What two links would both have."""
    match one, other:
        case (PtyAt() | AdapterAt(), PtyAt() | AdapterAt()):
            if one.path is None or other.path is None:
                return None
            if os.path.normpath(one.path) != os.path.normpath(other.path):
                return None
            return "an adapter" if isinstance(one, AdapterAt) else "a path"
        case (TcpAt() | Rfc2217At(), TcpAt() | Rfc2217At()):
            if one.port == 0 or one.port != other.port:
                return None
            return "a port" if _overlap(one.host, other.host) else None
        case _:
            return None


def _terminals(buses: list[BusDraft], findings: Findings) -> None:
    """No link has the path of a node's terminal."""
    taken: dict[str, tuple[int, BusDraft]] = {}
    for bus in buses:
        if bus.table.get("terminals") is True:
            places = [link.place for link in bus.links if link.place is not None]
            for address in (one for node in bus.nodes for one in node.addresses):
                path = terminal_path(places, address)
                if path is not None:
                    taken.setdefault(os.path.normpath(path), (address, bus))
    for link in (link for bus in buses for link in bus.links):
        place = link.place
        if not isinstance(place, PtyAt | AdapterAt) or place.path is None:
            continue
        holder = taken.get(os.path.normpath(place.path))
        if holder is not None:
            address, bus = holder
            findings.add(
                link.spot,
                f"expected a path of its own, got {_spelled(place)!r}, where the terminal of node "
                f"{address} is, {findings.place(bus.table.at('terminals'))}",
                "change one of them",
            )


def _overlap(one: str, other: str) -> bool:
    """Whether servers on these hosts would be in each other's way."""
    return one.casefold() == other.casefold() or any(
        here == there
        or (here.version == there.version and (here.is_unspecified or there.is_unspecified))
        for here in _interfaces(one)
        for there in _interfaces(other)
    )


def _interfaces(host: str) -> Sequence[IPv4Address | IPv6Address]:
    """What a server on ``host`` listens on, as far as that is known without asking anybody."""
    if host.casefold() == "localhost":
        return IPv4Address("127.0.0.1"), IPv6Address("::1")
    try:
        return (ip_address(host),)
    except ValueError:
        return ()


def _spelled(place: Place) -> str:
    match place:
        case TcpAt(host, port) | Rfc2217At(host, port):
            return endpoint_text(host, port)
        case PtyAt(path) | AdapterAt(path):
            return str(path)


def _real_time(draft: Draft, findings: Findings) -> None:
    """A real adapter keeps real time, so all buses must: they share one clock."""
    speed = draft.table.get("speed", 1)
    for bus in draft.buses:
        adapters = [link for link in bus.links if link.table.get("kind") == "adapter"]
        if not adapters:
            continue
        adapter = findings.place(adapters[0].table.path)
        if speed != 1:
            findings.add(
                draft.table.at("speed"),
                f"expected 1 with a real adapter ({adapter}), got {speed}",
                "leave one of them out",
            )
            speed = 1  # told once
        if bus.table.get("pace") is False:
            findings.add(
                bus.table.at("pace"),
                f"expected true with a real adapter ({adapter}), got false",
                "leave one of them out",
            )
