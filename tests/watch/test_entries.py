"""Which entries tell of a fault, and whom they concern."""

from __future__ import annotations

import pytest

from sacbus.node import Report, ReportKind, Said
from sacbus.watch.entries import (
    Collision,
    Entry,
    Lost,
    Part,
    Reported,
    Spoken,
    Unanswered,
    concerns,
    is_fault,
)


def packet(source: int, destination: int, verdict: str = "right") -> Spoken:
    said = Said(
        "packet", source, destination, b"m400", "move", verdict, 10, 385_000, destination == 0
    )
    return Spoken(0, 1, None, 0, None, said, b"")


def answer(kind: str, *, late: bool = False) -> Spoken:
    said = Said(kind, 10, 1, b"", kind.upper(), "", 4)
    return Spoken(0, 1, None, 0, None, said, b"", packet(1, 10), 385_000, late)


GARBAGE = Spoken(0, 1, None, 0, None, Said("garbage", None, None, b"\x55", "noise", "", 1), b"\x55")


def collision(*nodes: int | None) -> Collision:
    return Collision(0, 1, None, 0, tuple(Part(0, "somebody", node, b"") for node in nodes))


def report(kind: ReportKind, address: int | None = 10) -> Reported:
    return Reported(Report(0, address, kind, "text"))


@pytest.mark.parametrize(
    ("entry", "fault"),
    [
        (packet(1, 10), False),
        (packet(1, 10, "unchecked"), False),
        (packet(1, 10, "wrong"), True),
        (packet(1, 10, "no NUL"), True),
        (answer("ack"), False),
        (answer("ack", late=True), True),
        (answer("nak"), True),
        (GARBAGE, True),
        (Unanswered(5, packet(1, 10)), True),
        (collision(10, None), True),
        (report(ReportKind.MESSAGE), False),
        (report(ReportKind.REFUSED), True),
        (Lost(3), True),
    ],
)
def test_a_fault_is_whatever_went_wrong(entry: Entry, fault: bool) -> None:
    assert is_fault(entry) is fault


@pytest.mark.parametrize(
    ("entry", "concerned"),
    [
        (packet(1, 10), True),
        (packet(10, 11), True),
        (packet(1, 0), True),
        (packet(1, 11), False),
        (answer("ack"), True),
        (GARBAGE, True),
        (Unanswered(5, packet(1, 10)), True),
        (Unanswered(5, packet(1, 11)), False),
        (collision(10, 11), True),
        (collision(None, 11), True),
        (collision(11, 12), False),
        (report(ReportKind.REFUSED), True),
        (report(ReportKind.REFUSED, 11), False),
        (report(ReportKind.REFUSED, None), True),
        (Lost(3), True),
    ],
)
def test_a_node_is_concerned_by_what_it_says_hears_or_may_have_said(
    entry: Entry, concerned: bool
) -> None:
    assert concerns(entry, {10}) is concerned
