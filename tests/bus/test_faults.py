"""Faults by their names; and of each kind, that what is expected of it happens with it alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest

from sacbus.bus import (
    FAULTS,
    Babble,
    BitErrors,
    Cut,
    Dead,
    Delay,
    Drop,
    Duplicate,
    Echo,
    Fault,
    FaultError,
    FaultOn,
    LateDirection,
    Latency,
    NoiseBursts,
    Port,
    SwappedReply,
    Transmission,
    WrongBaud,
    fault_from,
)
from sacbus.bus.duration import TIME
from sacbus.kernel import MS, SECOND, US, Ns
from sacbus.wire import MOTHER, ack, nak
from tests.nodes.sac.bench import Bench, packet

NODES = (10, 11, 82)
PAUSE: Ns = 50 * MS
COUNT = 60


class Day:
    """Mother asks three nodes in turn on a line, with a fault or without."""

    def __init__(self, given: Mapping[str, object] | None = None, seed: int = 0) -> None:
        self.bench = bench = Bench(*NODES, seed=seed)
        bench.outside = True  # with some faults bytes are heard later than they end
        medium = bench.bus.medium
        self.sent: list[Transmission] = []
        medium.watchers.append(self.sent.append)
        self.on: FaultOn | None = medium.add_fault(fault_from(given)) if given else None
        #: How long after they ended bytes came to another program on the line.
        self.late: list[Ns] = []
        Port(medium, lambda heard, now: self.late.append(now - heard.ends(len(heard.data) - 1)))
        for number in range(COUNT):
            bench.kernel.at(PAUSE * number, bench.port.talk, self.asked(number))
        bench.kernel.run_until(PAUSE * COUNT)
        if self.on is not None:
            self.on.off()
        bench.run()

    @staticmethod
    def asked(number: int) -> bytes:
        return packet(f"v{100 + number}", NODES[number % len(NODES)])

    def answered(self, node: int) -> int:
        return self.bench.answers.count(ack(MOTHER, node))

    @property
    def outcomes(self) -> list[bytes]:
        return [sent.outcome(self.bench.bus.medium.seed) for sent in self.sent]

    def touched(self) -> list[Transmission]:
        return [sent for sent in self.sent if sent.faults]


EACH = COUNT // len(NODES)


def all_answered(day: Day) -> bool:
    return [day.answered(node) for node in NODES] == [EACH] * len(NODES)


@dataclass(frozen=True)
class Kind:
    """A fault and what is to be expected with it, and must not be without it."""

    given: Mapping[str, object]
    expected: Callable[[Day], bool]


KINDS = {
    "bit_errors": Kind(
        {"bit_errors": 5e-3},
        lambda day: any(nak(MOTHER, node) in day.bench.answers for node in NODES),
    ),
    "drop": Kind(
        {"drop": 0.02},
        lambda day: any(
            len(got) == len(sent.data) - 1 for got, sent in zip(day.outcomes, day.sent, strict=True)
        ),
    ),
    "duplicate": Kind(
        {"duplicate": 0.02},
        lambda day: any(
            len(got) == len(sent.data) + 1 for got, sent in zip(day.outcomes, day.sent, strict=True)
        ),
    ),
    "delay": Kind(
        {"delay": {"rate": 0.1, "up_to": "5 ms"}},
        # An answer whose bytes do not follow each other is heard in parts.
        lambda day: any(len(part) < 4 for part in day.bench.answers),
    ),
    "swapped_reply": Kind(
        {"swapped_reply": 0.2},
        lambda day: len(day.bench.answers) == COUNT and not all_answered(day),
    ),
    "noise_bursts": Kind(
        {"noise_bursts": {"per_second": 40, "bytes": 5}},
        lambda day: bool(day.bench.bus.medium.counters().collided),
    ),
    "babble": Kind(
        {"babble": {"pattern": "55", "every": "20 ms"}},
        lambda day: day.bench.answers.count(b"\x55") > EACH,
    ),
    "dead": Kind(
        {"dead": 10},
        lambda day: [day.answered(node) for node in NODES] == [0, EACH, EACH],
    ),
    "cut": Kind(
        {"cut": [10, 82]},
        lambda day: [day.answered(node) for node in NODES] == [0, EACH, 0],
    ),
    "wrong_baud": Kind(
        {"wrong_baud": {"node": 11, "baud": 9_600}},
        lambda day: [day.answered(node) for node in NODES] == [EACH, 0, EACH],
    ),
    "latency": Kind({"latency": "16 ms"}, lambda day: set(day.late) == {16 * MS}),
    "late_direction": Kind(
        {"late_direction": "1 ms"},
        lambda day: len(day.bench.answers) == COUNT and not day.answered(10),
    ),
    "echo": Kind({"echo": True}, lambda day: Day.asked(0) in day.bench.answers),
}


def test_there_is_a_kind_here_for_every_fault_that_there_is() -> None:
    assert set(KINDS) == set(FAULTS)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_expected_of_a_fault_happens_with_it_and_not_without(kind: str) -> None:
    wanted = KINDS[kind]
    assert not wanted.expected(Day())
    assert all_answered(Day())
    with_it = Day(wanted.given)
    assert wanted.expected(with_it)
    assert with_it.on is not None
    assert with_it.on.count


@pytest.mark.parametrize("kind", [one for one in KINDS if one not in ("noise_bursts", "babble")])
def test_transmissions_that_a_fault_touched_show_it_by_its_name(kind: str) -> None:
    day = Day(KINDS[kind].given)
    assert {sent.faults for sent in day.touched()} == {(kind,)}
    assert not any(sent.faults for sent in Day().sent)


CHANCE = ("bit_errors", "drop", "duplicate", "delay", "swapped_reply", "noise_bursts")


@pytest.mark.parametrize("kind", CHANCE)
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(kind: str) -> None:
    def run(seed: int) -> list[object]:
        day = Day(KINDS[kind].given, seed)
        assert day.on is not None
        return [day.on.count, day.outcomes, *day.bench.transcript()]

    assert run(1) == run(1)
    assert run(1) != run(2)


# ---- from names and values ----------------------------------------------------------------------

READ: list[tuple[Mapping[str, object], Fault]] = [
    ({"bit_errors": 1e-4}, BitErrors(1e-4)),
    ({"drop": {"rate": 1}}, Drop(1)),
    ({"duplicate": 0.5}, Duplicate(0.5)),
    ({"delay": {"rate": 0.5, "up_to": "2.5 ms"}}, Delay(0.5, 2_500 * US)),
    ({"swapped_reply": 0.1}, SwappedReply(0.1)),
    ({"noise_bursts": 2}, NoiseBursts(2)),
    ({"noise_bursts": {"per_second": 0.5, "bytes": 9}}, NoiseBursts(0.5, 9)),
    ({"babble": {"pattern": "02 0a", "every": "1 s"}}, Babble(b"\x02\x0a", SECOND)),
    (
        {"babble": {"pattern": "020A", "every": "5us", "node": 10}},
        Babble(b"\x02\x0a", 5 * US, 10),
    ),
    (
        {"babble": {"pattern": "00", "every": "1 s", "node": "stranger"}},
        Babble(b"\x00", SECOND),
    ),
    ({"dead": 255}, Dead(255)),
    ({"cut": [10, 11, 10]}, Cut(frozenset({10, 11}))),
    ({"wrong_baud": {"node": 10, "baud": 9_600}}, WrongBaud(10, 9_600)),
    ({"latency": "16 ms"}, Latency(16 * MS)),
    ({"latency": {"by": "7 ns", "link": "mother"}}, Latency(7, "mother")),
    ({"late_direction": {"by": "1 ms", "node": 10}}, LateDirection(MS, 10)),
    ({"late_direction": {"by": "1 ms", "link": "a"}}, LateDirection(MS, None, "a")),
    ({"echo": True}, Echo()),
    ({"echo": {"link": "a"}}, Echo("a")),
    ({"echo": "a"}, Echo("a")),
]


@pytest.mark.parametrize(("given", "fault"), READ)
def test_a_fault_is_read_from_its_name_and_values(
    given: Mapping[str, object], fault: Fault
) -> None:
    assert fault_from(given) == fault
    assert fault.name == next(iter(given))


WRONG: list[tuple[Mapping[str, object], str]] = [
    ({}, "fault 'fault': expected one fault, got []"),
    ({"drop": 1, "echo": True}, "fault 'fault': expected one fault, got ['drop', 'echo']"),
    ({"drop": 0}, "fault 'drop': expected a probability over 0, up to 1, got 0"),
    ({"bit_errors": 1.1}, "fault 'bit_errors': expected a probability over 0, up to 1, got 1.1"),
    ({"duplicate": "1"}, "fault 'duplicate.rate': expected a number, got '1'"),
    ({"drop": True}, "fault 'drop.rate': expected a number, got True"),
    ({"drop": float("nan")}, "fault 'drop': expected a probability over 0, up to 1, got nan"),
    (
        {"delay": 0.5},
        f"fault 'delay.up_to': expected {TIME}, got nothing",
    ),
    (
        {"delay": {"rate": 0.5, "up_to": "0 s"}},
        "fault 'delay': expected a time over 0 to be late by, got 0",
    ),
    (
        {"latency": 16},
        f"fault 'latency.by': expected {TIME}, got 16",
    ),
    (
        {"latency": {"by": "1 ms", "of": "a"}},
        "fault 'latency.of': expected one of by, link, got 'a'",
    ),
    (
        {"latency": {"by": "1 ms", "link": 3}},
        "fault 'latency.link': expected the name of a link, or true for all of them, got 3",
    ),
    ({"noise_bursts": 0}, "fault 'noise_bursts': expected more than 0 bursts per second, got 0"),
    *(
        (
            {"noise_bursts": rate},
            f"fault 'noise_bursts': expected 1e-06 to 1000000 bursts per second, got {rate!r}",
        )
        for rate in (float("inf"), 1e-300)
    ),
    (
        {"noise_bursts": {"per_second": 1, "bytes": 3_000_000_000}},
        "fault 'noise_bursts': expected 65536 bytes a burst at most, got 3000000000",
    ),
    (
        {"latency": {"by": "0.5 ns"}},
        "fault 'latency.by': expected a whole number of ns, got '0.5 ns'",
    ),
    (
        {"latency": {"by": "9" * 13 + "s"}},
        "fault 'latency.by': expected a time of at most a year, got '9999999999999s'",
    ),
    (
        {"noise_bursts": {"per_second": 1, "bytes": 0}},
        "fault 'noise_bursts': expected 1 or more bytes a burst, got 0",
    ),
    (
        {"noise_bursts": {"per_second": 1, "bytes": 1.5}},
        "fault 'noise_bursts.bytes': expected a whole number, got 1.5",
    ),
    (
        {"babble": {"pattern": "0", "every": "1 s"}},
        "fault 'babble.pattern': expected bytes in hexadecimal such as \"02 0a\", got '0'",
    ),
    (
        {"babble": {"pattern": "00", "every": "1 s", "node": 0}},
        "fault 'babble.node': expected an address, 1 to 255, got 0",
    ),
    ({"dead": 256}, "fault 'dead.node': expected an address, 1 to 255, got 256"),
    ({"cut": []}, "fault 'cut.beyond': expected a list of addresses, got []"),
    ({"cut": ["a"]}, "fault 'cut.beyond': expected an address, 1 to 255, got 'a'"),
    ({"wrong_baud": 10}, "fault 'wrong_baud.baud': expected a whole number, got nothing"),
    (
        {"wrong_baud": {"node": 10, "baud": 49}},
        "fault 'wrong_baud': expected 50 to 4000000 baud, got 49",
    ),
    (
        {"late_direction": {"by": "1 ms", "node": 10, "link": "a"}},
        "fault 'late_direction': expected a node or a link, not both, got 'a'",
    ),
]


@pytest.mark.parametrize(("given", "text"), WRONG)
def test_what_is_no_fault_is_told_with_key_expected_and_got(
    given: Mapping[str, object], text: str
) -> None:
    with pytest.raises(FaultError) as told:
        fault_from(given)
    assert str(told.value) == text


def test_an_unknown_fault_is_told_with_those_that_there_are() -> None:
    with pytest.raises(
        FaultError, match="fault 'fire': expected one of bit_errors, drop, "
    ) as told:
        fault_from({"fire": 1})
    assert (told.value.key, told.value.got) == ("fire", 1)
