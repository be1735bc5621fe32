"""When an answer is overdue, and how seldom anybody has to look."""

from __future__ import annotations

from sacbus.kernel import MS, Kernel, LineRate, Ns
from sacbus.mother.overdue import Overdue
from sacbus.mother.pending import Pending
from sacbus.wire import MOTHER, encode
from sacbus.wire.times import turnaround

RATE = LineRate()


class Minded:
    """Requests that go out when they are told to, and when each was found to be overdue."""

    def __init__(self) -> None:
        self.kernel = Kernel()
        self.waits = 0
        self.out: Pending | None = None
        self.silent: list[tuple[Pending, Ns]] = []
        self.overdue = Overdue(
            self.kernel, RATE, lambda: self.out, self.give_up, lambda: self.waits
        )

    def give_up(self, request: Pending) -> None:
        self.silent.append((request, self.kernel.now))
        self.out = None

    def send(self, body: bytes, slack: Ns) -> Pending:
        data = encode(10, MOTHER, body)
        self.out = Pending(10, body, data, lambda _: None, may_repeat=False, tries=1, slack=slack)
        self.overdue.mind(self.out, self.kernel.now)
        return self.out


def due(body: bytes, slack: Ns) -> Ns:
    """How long an answer to ``body`` may take, by the figures."""
    answer = turnaround(len(body), nul_follows=True) + RATE.span(4)
    return RATE.span(len(body) + 6) + answer + slack


def test_an_answer_is_overdue_when_the_lines_figures_and_the_slack_are_over() -> None:
    minded = Minded()
    request = minded.send(b"m3000a2d1", 10 * MS)
    minded.kernel.run()
    assert minded.silent == [(request, due(b"m3000a2d1", 10 * MS))]
    assert minded.overdue.line_time(4) == due(b"12345", 0)


def test_one_look_is_enough_for_all_requests_that_are_answered_before_it() -> None:
    minded = Minded()
    for _ in range(9):
        minded.send(b"v100", 100 * MS)
        minded.kernel.run_until(minded.kernel.now + 10 * MS)
        minded.out = None
    assert minded.kernel.ran == 0
    last = minded.send(b"v100", 100 * MS)
    minded.kernel.run()
    assert minded.silent == [(last, 90 * MS + due(b"v100", 100 * MS))]
    assert minded.kernel.ran == 2


def test_one_with_less_slack_is_not_kept_waiting_by_a_look_that_stands_for_later() -> None:
    minded = Minded()
    minded.send(b"v100", 100 * MS)
    probe = minded.send(b"", 4 * MS)
    minded.kernel.run()
    assert minded.silent == [(probe, due(b"", 4 * MS))]


def test_while_bytes_wait_for_the_line_the_time_begins_anew() -> None:
    minded = Minded()
    minded.waits = 20
    request = minded.send(b"v100", 10 * MS)
    minded.kernel.run_until(due(b"v100", 10 * MS))
    minded.waits = 0
    minded.kernel.run()
    assert minded.silent == [(request, 2 * due(b"v100", 10 * MS))]
