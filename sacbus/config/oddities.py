"""What is not wrong with a configuration but will hardly be meant, here and now.

Owns the looks at this machine that reading itself never takes: whether an adapter is there, whether
a path is free. Nothing is opened even here, and what cannot be looked at is left alone.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from sacbus.config.draft import BusDraft, Draft, LinkDraft
from sacbus.config.mistake import Findings
from sacbus.links.places import AdapterAt, PtyAt, Rfc2217At, TcpAt

__all__ = ["oddities"]


def oddities(draft: Draft, findings: Findings) -> None:
    """Look for what is odd; it goes to ``findings``, as if it were a mistake."""
    devices: dict[str, LinkDraft] = {}
    for bus in draft.buses:
        _bus(bus, findings)
        for link in bus.links:
            with suppress(OSError):
                _link(link, findings, devices)


def _bus(bus: BusDraft, findings: Findings) -> None:
    if bus.table.lacks("links"):
        if not (bus.table.get("terminals") and bus.nodes):
            findings.add(bus.table.path, "no program can reach this bus", "add [[bus.links]]")
    elif bus.table.lacks("nodes") and len(bus.links) == 1:
        findings.add(bus.table.path, "there is nobody to talk to", "add [[bus.nodes]]")
    if bus.table.get("lanes") == 2:
        for link in bus.links:
            if link.table.get("echo"):
                what = "there is no echo with lanes = 2"
                findings.add(link.table.at("echo"), what, "leave one of them out")


def _link(link: LinkDraft, findings: Findings, devices: dict[str, LinkDraft]) -> None:
    match link.place:
        case AdapterAt(path):
            _adapter(path, link, findings, devices)
        case PtyAt(Path() as path):
            _symlink(path, link, findings)
        case TcpAt(host, _) | Rfc2217At(host, _) if host in ("0.0.0.0", "::"):  # noqa: S104
            findings.add(
                link.spot,
                "everybody who reaches this machine can drive the bus",
                "name one of its addresses, if that is not meant",
            )


def _adapter(path: str, link: LinkDraft, findings: Findings, devices: dict[str, LinkDraft]) -> None:
    if "/" not in path and os.sep not in path:  # COM5
        return
    if not Path(path).exists():
        findings.add(link.spot, f"{path} is not there now", "plug it in before serving")
        return
    other = devices.setdefault(os.path.realpath(path), link)
    if other is not link:
        what = f"{path} is the same device as that of {findings.place(other.spot)}"
        findings.add(link.spot, what, "an adapter is on one bus only")


def _symlink(path: Path, link: LinkDraft, findings: Findings) -> None:
    if not path.parent.is_dir():
        findings.add(link.spot, f"there is no directory {path.parent} now", "create it")
    elif path.is_symlink():
        # A run that lives, one that was killed, or a stranger: serving finds out which.
        findings.add(link.spot, f"{path} is there already", "stop what serves it, if it runs")
    elif path.exists():
        findings.add(link.spot, f"{path} is there already and no link", "choose another path")
