"""Transactions on a Super Stepper Bus, on a line that is not always good."""

from __future__ import annotations

import pytest

from sacbus.kernel import MS, US
from sacbus.mother import BadRequest, LineLost, MotherError
from sacbus.mother.exchanges import Answered, Exchanges
from sacbus.mother.superstepper import BadChecksum, Nak, NoReply, SuperStepperError
from sacbus.wire.superstepper import (
    Answer,
    Message,
    Microsteps,
    MoveSteps,
    Read,
    Stop,
    encode_answer,
    patience,
)
from tests.nodes.superstepper.bench import Bench

Outcome = Answered | MotherError

MOVE = MoveSteps(True, 10_000, 10)

COUNTED = ("sent", "acks", "naks", "timeouts", "retries")


class Rig:
    """A bench, and the master's transactions on its line."""

    def __init__(self, *, nine: bool = False) -> None:
        self.bench = Bench(3, 4, nine=nine)
        self.sent: list[tuple[bytes, bytes]] = []
        #: What happens to the next messages instead of their being sent.
        self.weather: list[str] = []
        self.exchanges = Exchanges(self.bench.kernel, self.talk, self.bench.bus.rate)
        self.bench.port.hear = lambda heard, _now: self.exchanges.hear(heard.data)

    def talk(self, data: bytes, ninth: bytes) -> None:
        self.sent.append((data, ninth))
        match self.weather.pop(0) if self.weather else "fine":
            case "lost":
                pass
            case "cut":
                self.bench.port.talk(data[:-1], ninth[:-1])
            case "spoilt":
                self.bench.port.talk(data, ninth)
                at = self.bench.now + self.bench.span(len(data) + 2)
                self.bench.kernel.at(at, self.bench.bus.medium.transmit, "noise", b"\x55", 1)
            case "short":
                answer = encode_answer(Answer(3))[:3]
                self.bench.kernel.at(self.bench.now, self.exchanges.hear, answer)
            case _:
                self.bench.port.talk(data, ninth)

    def ask(self, address: int, message: Message, **how: bool) -> Answer | MotherError:
        outcomes: list[Outcome] = []
        self.exchanges.call(address, message, outcomes.append, **how)
        while not outcomes:
            assert self.bench.kernel.run_next()
        (outcome,) = outcomes
        return outcome.answer if isinstance(outcome, Answered) else outcome


@pytest.mark.parametrize("nine", [False, True], ids=["8-bit", "9-bit"])
def test_a_message_is_answered_and_its_header_is_marked(*, nine: bool) -> None:
    rig = Rig(nine=nine)
    assert rig.ask(3, Read(3, word=True)) == Answer(3, value=32_000)
    assert rig.ask(4, MOVE) == Answer(4)
    assert [ninth for _, ninth in rig.sent] == [b"\x01\0\0", b"\x01\0\0\0\0\0"]


def test_messages_go_out_one_after_the_other() -> None:
    rig = Rig()
    outcomes: list[Outcome] = []
    for address in (3, 4, 3):
        rig.exchanges.call(address, Read(2), outcomes.append)
    assert len(rig.sent) == 1
    rig.bench.run(100 * MS)
    # Three bytes, 100 us, and five bytes, at 9600 baud.
    trip = rig.bench.span(3) + 100 * US + rig.bench.span(5)
    wanted = [Answered(Answer(who, value=10), 1, trip) for who in (3, 4, 3)]
    assert outcomes == wanted


def test_who_asks_again_upon_a_failure_has_the_line_after_the_pause() -> None:
    rig = Rig()
    rig.weather = ["lost"]
    outcomes: list[Outcome] = []
    went: list[int] = []

    def ask_again(outcome: Outcome) -> None:
        outcomes.append(outcome)
        failed = rig.bench.now
        rig.exchanges.call(3, Read(2), outcomes.append)
        assert len(rig.sent) == 1
        while len(rig.sent) == 1:
            assert rig.bench.kernel.run_next()
        went.append(rig.bench.now - failed)

    rig.exchanges.call(4, MOVE, ask_again)
    rig.bench.run(100 * MS)
    assert went == [patience(rig.bench.span(1))]
    assert isinstance(outcomes[0], NoReply)
    assert isinstance(outcomes[1], Answered)


def test_what_comes_of_messages_is_counted_by_module() -> None:
    rig = Rig()
    rig.weather = ["lost", "cut", "fine", "spoilt", "fine"]
    rig.ask(3, Read(2))
    rig.ask(4, Read(2))
    counts = rig.exchanges.statistics
    assert [counts[3].as_dict()[name] for name in COUNTED] == [3, 1, 1, 1, 2]
    assert [counts[4].as_dict()[name] for name in COUNTED] == [2, 1, 0, 1, 1]
    rig.weather = ["cut"] * 3
    rig.ask(3, MOVE)
    assert [counts[3].as_dict()[name] for name in COUNTED] == [6, 1, 4, 1, 4]
    assert len(counts[4].round_trips) == 1


@pytest.mark.parametrize(
    ("weather", "error"),
    [("lost", NoReply), ("cut", Nak), ("spoilt", BadChecksum), ("short", BadChecksum)],
)
def test_what_may_run_twice_is_sent_three_times(
    weather: str, error: type[SuperStepperError]
) -> None:
    rig = Rig()
    rig.weather = [weather] * 2
    assert rig.ask(3, Read(2)) == Answer(3, value=10)
    assert len(rig.sent) == 3
    rig.weather = [weather] * 3
    failure = rig.ask(3, Read(2))
    assert type(failure) is error
    assert failure.attempts == 3
    assert str(failure).startswith("module 3: 'read the byte at RAM 0x02' sent 3 times: ")
    # And the line is good again for the next.
    assert rig.ask(4, Read(2)) == Answer(4, value=10)


@pytest.mark.parametrize(("weather", "error"), [("lost", NoReply), ("spoilt", BadChecksum)])
def test_a_number_of_steps_is_not_sent_again_unless_the_module_has_said_nak(
    weather: str, error: type[SuperStepperError]
) -> None:
    rig = Rig()
    rig.weather = [weather]
    failure = rig.ask(3, MOVE)
    assert type(failure) is error
    assert "sent once" in str(failure)
    rig.weather = ["cut", "cut"]
    assert rig.ask(3, MOVE) == Answer(3)
    rig.weather = [weather]
    assert rig.ask(3, MOVE, accept_duplicates=True) == Answer(3)


def test_anothers_answer_is_none() -> None:
    rig = Rig()
    rig.exchanges.hear(b"\x01\x02")
    assert rig.exchanges.strays == 2
    rig.weather = ["lost"]
    outcomes: list[Outcome] = []
    rig.exchanges.call(3, MOVE, outcomes.append)
    rig.exchanges.hear(encode_answer(Answer(4)))
    assert type(outcomes[0]) is BadChecksum


def test_a_line_that_is_lost_fails_what_waits_and_what_comes() -> None:
    rig = Rig()
    outcomes: list[Outcome] = []
    rig.exchanges.call(3, Read(2), outcomes.append)
    rig.exchanges.call(4, Read(2), outcomes.append)
    rig.exchanges.lose("the line is gone")
    rig.exchanges.call(4, Read(2), outcomes.append)
    assert [type(one) for one in outcomes] == [LineLost] * 3
    rig.bench.run(100 * MS)
    assert len(outcomes) == 3


def test_what_nobody_waits_for_any_more_is_not_sent() -> None:
    rig = Rig()
    rig.weather = ["lost"]
    outcomes: list[list[Outcome]] = [[], []]
    done = [one.append for one in outcomes]
    for one in done:
        rig.exchanges.call(3, Read(2), one)
    for one in done:
        rig.exchanges.withdraw(one)
    rig.bench.run(200 * MS)
    assert len(rig.sent) == 1
    assert rig.ask(3, Read(2)) == Answer(3, value=10)


def test_what_nobody_waits_for_any_more_is_not_sent_again_after_a_nak_either() -> None:
    rig = Rig()
    rig.weather = ["cut"]
    outcomes: list[Outcome] = []
    done = outcomes.append
    rig.exchanges.call(3, MOVE, done)
    rig.exchanges.withdraw(done)
    rig.bench.run(200 * MS)
    assert len(rig.sent) == 1
    assert [type(one) for one in outcomes] == [Nak]


def test_while_bytes_wait_for_the_line_no_answer_is_late() -> None:
    bench = Bench(3)
    waiting = [1] * 3
    exchanges = Exchanges(
        bench.kernel,
        lambda *_: None,
        bench.bus.rate,
        unsent=lambda: waiting.pop() if waiting else 0,
    )
    outcomes: list[Outcome] = []
    exchanges.call(3, MOVE, outcomes.append)
    begin = bench.now
    while not outcomes:
        bench.kernel.run_next()
    once = bench.span(11) + patience(bench.span(1)) + 10 * MS
    assert bench.now - begin == 4 * once


@pytest.mark.parametrize(
    ("address", "message"), [(32, Stop()), (3, MoveSteps(True, 1, 70_000)), (3, Microsteps(9))]
)
def test_what_cannot_be_sent_is_refused_at_once(address: int, message: Message) -> None:
    rig = Rig()
    with pytest.raises(BadRequest, match=f"module {address}: "):
        rig.exchanges.call(address, message, lambda _: None)
    assert not rig.sent
