from __future__ import annotations

import pytest

from sacbus.mother import (
    BadRequest,
    LineLost,
    MotherError,
    NoAnswer,
    Refused,
    Stopped,
    UnknownOutcome,
)


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (BadRequest, ValueError),
        (Refused, Exception),
        (NoAnswer, TimeoutError),
        (UnknownOutcome, TimeoutError),
        (Stopped, Exception),
        (LineLost, ConnectionError),
    ],
)
def test_every_error_is_mothers_and_what_a_caller_would_expect(
    error: type[Exception], builtin: type[Exception]
) -> None:
    assert issubclass(error, MotherError)
    assert issubclass(error, builtin)


@pytest.mark.parametrize(
    ("error", "verdict"),
    [
        (Refused, "not executed"),
        (NoAnswer, "nobody at that address"),
        (UnknownOutcome, "may have been executed"),
    ],
)
def test_the_text_names_node_line_attempts_and_last_answer(
    error: type[Refused | NoAnswer | UnknownOutcome], verdict: str
) -> None:
    fault = error(85, "m3000a2d1", 3, "silence")
    text = str(fault)
    assert text.startswith("node 85: 'm3000a2d1' sent 3 times, last answer silence: ")
    assert verdict in text
    assert "\n" not in text
    assert (fault.node, fault.line, fault.attempts, fault.last) == (85, "m3000a2d1", 3, "silence")


def test_one_attempt_is_told_as_once() -> None:
    assert "sent once, " in str(Refused(85, "S", 1, "NAK"))


def test_what_was_stopped_says_whom_it_was_for_and_that_it_was_not_sent() -> None:
    fault = Stopped(85, "m400")
    assert (fault.node, fault.line) == (85, "m400")
    assert str(fault).startswith("node 85: 'm400' was not sent: an emergency stop came first")
    assert str(Stopped(0, "y")).startswith("all nodes: 'y' was not sent")
