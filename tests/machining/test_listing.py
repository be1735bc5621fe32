"""A block as a text: its head, its commands by node, and what follows it."""

from __future__ import annotations

from sacbus.language import Move, parse
from sacbus.machining import listing_of
from sacbus.machining.account import clock
from sacbus.toolpath import Block
from tests.mother.blocks import block, machine


def test_a_block_is_told_with_all_that_anyone_needs() -> None:
    made = block(
        {0: [(40, 3000), (-3, 7001)], 1: [(1, 3000)]},
        lines=(7, 9),
        dwell=0.5,
        halts=(("M0", True), ("M8", False)),
    )
    assert list(listing_of(made, 3, machine(10, 11))) == [
        "# block 3, lines 7 to 9: 1.000 mm in 0.141003 s",
        "10 m40v100a999d999l1s",
        "10 m-3vc7001a999d999l1",
        "11 m1v100a999d999l1s",
        "# M0, waits",
        "# M8",
        "# dwell 0.5 s",
    ]


def test_every_command_is_one_of_the_languages() -> None:
    made: Block = block({0: [(5, 3000), (6, 4000)]}, lines=(2, 2))
    head, *commands = listing_of(made, 1, machine(10))
    assert head.startswith("# block 1, line 2: ")
    for line in commands:
        parsed = parse(line.partition(" ")[2].encode())
        assert isinstance(parsed.command, Move)
        assert not parsed.remarks


def test_times_are_told_as_people_say_them() -> None:
    told = [clock(seconds) for seconds in (0.0123456, 59.9994, 61, 3599.4, 3600, 11_525)]
    assert told == ["0.012 s", "59.999 s", "1 min 1 s", "59 min 59 s", "1 h 0 min", "3 h 12 min"]
