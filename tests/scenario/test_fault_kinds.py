"""Of each kind of fault, a scenario whose expectation is met with the fault and not without it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent
from typing import Final

import pytest

from sacbus.bus import FAULTS
from sacbus.scenario import run
from sacbus.wire import MOTHER, ack, encode
from tests.scenario.stage import scenario

#: Mother speaks to both nodes many times, whatever becomes of it.
TALK: Final = """
    [[step]]
    repeat = 30
    each = "10,11"
    send = "{node}v100"
    outcome = "any"
    """


@dataclass(frozen=True)
class Kind:
    """``fault``: as it stands in its step; ``rest``: the steps behind it, with the expectation."""

    fault: str
    rest: str


KINDS: Final = {
    # A damaged line is refused.
    "bit_errors": Kind("5e-3", TALK + "[[step]]\nexpect = { naks = '>= 1' }"),
    # A packet or an answer that lacks a byte is none.
    "drop": Kind("0.02", TALK + "[[step]]\nexpect = { timeouts = '>= 1' }"),
    # Between the ends of the line every byte comes twice.
    "duplicate": Kind(
        "1",
        """
        [[step]]
        send = "10v100"
        outcome = "any"
        [[step]]
        at = "0 s"
        expect = { pattern = '.*vv110000.*', within = "100 ms" }
        """,
    ),
    # Nothing is damaged, and answers come when mother waits no longer.
    "delay": Kind(
        '{ rate = 0.02, up_to = "50 ms" }', TALK + "[[step]]\nexpect = { timeouts = '>= 1' }"
    ),
    # The second node is answered for by the first.
    "swapped_reply": Kind(
        "1",
        """
        [[step]]
        each = "10,11"
        send = "{node}v100"
        outcome = "any"
        [[step]]
        at = "0 s"
        expect = { answer = "ack", from = 10, count = 2, within = "100 ms" }
        """,
    ),
    "noise_bursts": Kind(
        "{ per_second = 40, bytes = 5 }", TALK + "[[step]]\nexpect = { collisions = '>= 1' }"
    ),
    # What the stranger says is a command.
    "babble": Kind(
        f'{{ pattern = "{encode(10, MOTHER, b"m4v600").hex()}", every = "1 s" }}',
        '[[step]]\nexpect = { node = 10, position = 4, within = "100 ms" }',
    ),
    "dead": Kind(
        "10",
        """
        [[step]]
        each = "10,11"
        send = "{node}v100"
        outcome = "any"
        [[step]]
        at = "0 s"
        expect = { silence = "100 ms", from = 10 }
        """,
    ),
    "cut": Kind("[11]", TALK + "[[step]]\nexpect = { node = 11, acks = 0 }"),
    "wrong_baud": Kind(
        "{ node = 10, baud = 9600 }", TALK + "[[step]]\nexpect = { node = 10, acks = 0 }"
    ),
    # Mother, who is told of no adapter, waits for no answer that long.
    "latency": Kind('"16 ms"', TALK + "[[step]]\nexpect = { timeouts = '>= 1' }"),
    # Mother's own driver spoils the beginning of each answer.
    "late_direction": Kind('"1 ms"', TALK + "[[step]]\nexpect = { acks = 0 }"),
    # A node that is off acknowledges nothing; an ACK that mother puts on the line comes back.
    "echo": Kind(
        "true",
        f"""
        [[step]]
        power = {{ node = 10, on = false }}
        [[step]]
        send = "10v100"
        outcome = "any"
        [[step]]
        at = "4 ms"
        raw = "{ack(MOTHER, 10).hex(" ")}"
        [[step]]
        at = "100 ms"
        expect = {{ node = 10, acks = 1 }}
        """,
    ),
}


def test_there_is_a_scenario_here_for_every_fault_that_there_is() -> None:
    assert set(KINDS) == set(FAULTS)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_expected_comes_with_the_fault_and_not_without_it(kind: str, file: Path) -> None:
    wanted = KINDS[kind]
    rest = dedent(wanted.rest)
    step = f"[[step]]\nfault = {{ {kind} = {wanted.fault} }}\n"
    with_it, without = (run(scenario(file, text + rest)) for text in (step, ""))
    (met,), (failed,) = with_it.looked, without.looked
    assert (with_it.failures, without.failures) == ([], [failed])
    assert failed.expected == met.expected
