"""Nodes on a line: who hears what, who answers when, and what a bus keeps to itself."""

from __future__ import annotations

import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from random import Random

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from nodes.sac import KIND, SacNode, SacProtocol, SacSettings
from sacbus.bus import LATENCY, Bus, NoSuchNode, Port, Transmission
from sacbus.kernel import MS, SECOND, US, Kernel, Ns
from sacbus.node import Report, ReportKind
from sacbus.wire import GENERAL_CALL, MOTHER, ack
from tests.bus.strategies import ADDRESSES, traffic
from tests.nodes.sac.bench import NODE, Bench, Said, packet

MOVE = "m200v100a1d1"
MOVED = 200
#: Long enough for the move to be over.
LATER = 2 * SECOND

#: All addresses that a node may have without a warning, up to 250 of them.
MANY = range(4, 254)


# ---- who is there -------------------------------------------------------------------------------


def test_nodes_are_listed_in_the_order_in_which_they_were_added() -> None:
    assert [node.address for node in Bench(12, 10, 11).bus.nodes] == [12, 10, 11]


def test_a_node_is_found_by_its_address_and_one_that_is_not_there_is_named() -> None:
    bus = Bench(10, 11).bus
    assert bus.node(11).address == 11
    with pytest.raises(NoSuchNode) as nobody:
        bus.node(12)
    assert str(nobody.value) == "no node 12 on bus, expected one of its own: 10, 11"
    assert (nobody.value.address, nobody.value.bus, nobody.value.present) == (12, "bus", (10, 11))
    assert isinstance(nobody.value, KeyError)


def test_of_many_nodes_some_are_named_to_who_asks_for_a_wrong_one() -> None:
    assert str(NoSuchNode("10", "bus", range(10, 30))) == (
        "no node '10' on bus, expected one of its own: "
        "10, 11, 12, 13, 14, 15, 16, 17, 18, 19 and 10 more"
    )
    assert str(NoSuchNode(10, "bus", ())) == "no node 10 on bus, expected one of its own: no nodes"


def test_two_nodes_of_one_address_both_answer_and_spoil_each_others_answer() -> None:
    bench = Bench()
    bench.bus.add(KIND.create(NODE, SacSettings(), bench.bus.rate, bench.bus.tell))
    bench.hears(MOVE, at=20 * MS)
    bench.run()
    assert [node.snapshot(LATER).position_pulses for node in bench.bus.nodes] == [MOVED, MOVED]
    assert bench.bus.medium.counters().collided == 2
    assert [len(answer) for answer in bench.answers] == [4, 4]
    assert ack(MOTHER, NODE) not in bench.answers


def test_a_node_that_was_driven_from_outside_is_asked_anew_when_it_wants_to_be_woken() -> None:
    bench = Bench()
    bench.node.board.network.send(MOTHER, b" hi", 5 * MS)
    bench.run()
    assert bench.heard == []
    bench.bus.touch(bench.node)
    bench.run()
    assert bench.heard == [Said(5 * MS, packet(" hi", MOTHER, NODE))]


# ---- reports ------------------------------------------------------------------------------------


def test_reports_are_kept_up_to_a_thousand_counted_beyond_and_shown_as_they_are_made() -> None:
    bus = Bench().bus
    seen: list[Report] = []
    bus.report_watchers.append(seen.append)
    for number in range(1_500):
        bus.tell(Report(number, NODE, ReportKind.WARNING, "careful"))
    assert [report.when for report in bus.reports] == list(range(500, 1_500))
    assert bus.report_counts == {"warning": 1_500}
    assert len(seen) == 1_500


# ---- line time ----------------------------------------------------------------------------------


class Program:
    """Sends its next request in the moment in which the answer is there, as quick programs do."""

    def __init__(self, bench: Bench, requests: Sequence[bytes]) -> None:
        self.answers: list[bytes] = []
        self._requests = iter(requests)
        self._port = Port(bench.bus.medium, lambda heard, now: self._take(heard.data))
        self._next()

    def _take(self, answer: bytes) -> None:
        self.answers.append(answer)
        self._next()

    def _next(self) -> None:
        self._port.talk(next(self._requests, b""))


def test_a_hundred_exchanges_take_exactly_what_the_figures_add_up_to() -> None:
    bench = Bench()
    request = packet("v100".ljust(14))
    assert len(request) == 20
    program = Program(bench, [request] * 100)
    bench.run()
    assert program.answers == [ack(MOTHER, NODE)] * 100
    # 385 us for 5 characters, 13 for each further one.
    exchange = bench.span(20) + (385 + 9 * 13) * US + bench.span(4)
    assert bench.kernel.now == 100 * exchange + 99 * LATENCY


@pytest.mark.parametrize("lanes", [1, 2])
def test_250_nodes_answer_a_round_each_with_its_own_ack_and_none_is_missing(lanes: int) -> None:
    bench = Bench(*MANY, lanes=lanes)
    assert len(bench.nodes) == 250
    program = Program(bench, [packet(MOVE, address) for address in MANY])
    bench.run()
    assert program.answers == [ack(MOTHER, address) for address in MANY]
    assert {bench.position(bench.kernel.now, address) for address in MANY} == {MOVED}
    assert bench.bus.medium.counters().collided == 0


def test_a_broadcast_reaches_all_of_250_nodes_and_none_answers() -> None:
    bench = Bench(*MANY)
    bench.hears(MOVE, at=20 * MS, to=GENERAL_CALL)
    assert {node.snapshot(20 * MS).state for node in bench.nodes.values()} == {"STOP"}
    bench.run()
    assert bench.heard == []
    assert bench.bus.medium.counters().transmissions == 1
    assert {bench.position(bench.kernel.now, address) for address in MANY} == {MOVED}


def test_a_packet_for_nobody_here_is_answered_by_silence_and_moves_nobody() -> None:
    bench = Bench(*range(10, 20))
    bench.hears(MOVE, at=20 * MS, to=99)
    bench.run()
    assert bench.heard == []
    assert {bench.position(LATER, address) for address in range(10, 20)} == {0}


# ---- two senders --------------------------------------------------------------------------------

QUIET = SacSettings(ack=False)
FIRST, SECOND_ONE = packet(MOVE, 10), packet(MOVE, 11)


def two_senders(apart: Ns, *, lanes: int = 1, settings: SacSettings | None = None) -> Bench:
    """A packet for 10 and one for 11, the second ``apart`` ns after the end of the first."""
    bench = Bench(10, 11, lanes=lanes, settings=settings)
    first = bench.sends(FIRST, at=10 * MS, sender="one")
    start = first.end + apart
    bench.sends(SECOND_ONE, at=start, sender="other")
    bench.kernel.run_until(LATER)
    return bench


def moved(bench: Bench) -> list[int]:
    return [bench.position(LATER, address) for address in (10, 11)]


@pytest.mark.parametrize("eighths", range(-8 * len(FIRST), -8 * 3, 5))
def test_two_packets_that_overlap_arrive_garbled_and_nobody_executes(eighths: int) -> None:
    bench = two_senders(Bench().span(1) * eighths // 8)
    assert bench.bus.medium.counters().collided == 2
    assert moved(bench) == [0, 0]
    assert ack(MOTHER, 10) not in bench.answers
    assert ack(MOTHER, 11) not in bench.answers
    heard = [said.data for said in bench.heard if len(said.data) > 4]
    assert heard
    assert FIRST not in heard
    assert SECOND_ONE not in heard


def test_the_same_two_a_byte_time_apart_are_both_executed_on_two_lanes() -> None:
    bench = two_senders(Bench().span(1), lanes=2)
    assert moved(bench) == [MOVED, MOVED]
    assert bench.answers == [ack(MOTHER, 10), ack(MOTHER, 11)]
    assert bench.bus.medium.counters(0).collided == bench.bus.medium.counters(1).collided == 0


def test_the_same_two_a_byte_time_apart_are_both_executed_where_nobody_answers() -> None:
    bench = two_senders(Bench().span(1), settings=QUIET)
    assert moved(bench) == [MOVED, MOVED]
    assert bench.answers == [FIRST, SECOND_ONE]
    assert bench.bus.medium.counters().collided == 0


def test_on_one_lane_the_answer_to_the_first_runs_into_the_second() -> None:
    bench = two_senders(Bench().span(1))
    assert moved(bench) == [MOVED, 0]
    assert bench.bus.medium.counters().collided == 2
    assert ack(MOTHER, 10) not in bench.answers


# ---- routing ------------------------------------------------------------------------------------


class Everybody(SacProtocol):
    """The same protocol, but for a bus that cannot tell who is meant, and wakes for every byte."""

    def cuts(self, data: bytes) -> Sequence[int]:
        return range(1, len(data))

    def addressed(self, data: bytes) -> Sequence[int] | None:
        return None


def play(bench: Bench, talk: list[tuple[Ns, bytes]]) -> list[object]:
    """Bursts one after the other; a pause of none at all leaves none between them."""
    end = 0
    for pause, data in talk:
        end = bench.sends(data, at=end + pause).end
    bench.kernel.run_until(end + 10 * SECOND)
    return bench.transcript()


@pytest.mark.slow
@settings(max_examples=150)
@given(traffic())
@example([(0, bytes((2, *[0] * 50)))])  # too long, which is seen before the end
def test_those_whom_the_bus_does_not_bother_would_not_have_done_anything(
    talk: list[tuple[Ns, bytes]],
) -> None:
    chosen, everybody = Bench(*ADDRESSES, lanes=2), Bench(lanes=2)
    everybody.bus = Bus(everybody.kernel, Everybody(), lanes=2)
    everybody.nodes.clear()
    for address in ADDRESSES:
        everybody.add(address, SacSettings())
    everybody.port = Port(everybody.bus.medium, everybody._take, latency=0)
    assert play(chosen, talk) == play(everybody, talk)


@pytest.mark.slow
@settings(max_examples=50)
@given(traffic())
def test_whether_anybody_listens_makes_no_difference_to_the_nodes(
    talk: list[tuple[Ns, bytes]],
) -> None:
    with_ears, without = Bench(*ADDRESSES, lanes=2), Bench(*ADDRESSES, lanes=2)
    without.port.close()
    heard, unheard = play(with_ears, talk), play(without, talk)
    count = len(with_ears.heard)
    assert [heard[0], *heard[1 + count :]] == unheard


@pytest.mark.slow
@settings(max_examples=50)
@given(traffic())
def test_the_same_inputs_give_the_same_transcript(talk: list[tuple[Ns, bytes]]) -> None:
    def run() -> list[object]:
        bench = Bench(*ADDRESSES, seed=3)
        for number, (pause, data) in enumerate(talk):
            bench.sends(data, at=number * 2 * MS + pause % MS, sender=f"talker {number}")
        bench.kernel.run_until(20 * SECOND)
        return bench.transcript()

    assert run() == run()


# ---- quiet appointments -------------------------------------------------------------------------


def due(bench: Bench) -> tuple[Ns | None, Ns | None]:
    """When the next event is due, and the next that is not quiet."""
    return bench.kernel.next_at(), bench.kernel.next_loud_at()


def test_an_answer_is_punctual_and_the_end_of_a_motion_is_quiet() -> None:
    bench = Bench()
    bench.port.close()
    bench.hears(MOVE, at=20 * MS)
    answer, end = bench.node.board.network.due, bench.node.board.commands.due
    assert answer is not None
    assert due(bench) == (answer, answer)
    # The answer ends on the line, which is punctual as well.
    bench.kernel.run_until(answer + bench.span(4))
    assert due(bench) == (end, None)
    bench.run()
    assert bench.kernel.now == end
    assert due(bench) == (None, None)


def test_where_soft_ops_tell_of_it_the_end_of_a_motion_is_punctual() -> None:
    bench = Bench(settings=SacSettings(soft_ops=True))
    bench.hears(MOVE, at=20 * MS)
    bench.kernel.run_until(SECOND)
    end = bench.node.board.commands.due
    assert due(bench) == (end, end)


@pytest.mark.parametrize("apart", [-200 * US, -1, 0, 1, 300 * US])
def test_an_appointment_that_was_quiet_is_punctual_once_the_node_has_something_to_send(
    apart: Ns,
) -> None:
    """A packet comes shortly before a motion ends; its answer is due ``apart`` after that end."""
    bench = Bench()
    bench.hears(MOVE, at=20 * MS)
    bench.kernel.run_until(SECOND)
    end = bench.node.board.commands.due
    assert end is not None
    assert due(bench) == (end, None)
    # 385 us for 5 characters, from the end of the NUL behind ETX (which `hears` does not send).
    bench.sends(packet("v100"), at=end + apart - 385 * US - bench.span(len(packet("v100"))))
    bench.kernel.run_until(end + apart - 350 * US)
    answer = bench.node.board.network.due
    assert answer == end + apart
    assert bench.kernel.next_at() == min(end, answer)
    # Were the end late, so would be what the node wants after it.
    assert bench.kernel.next_loud_at() == min(end, answer)
    bench.kernel.run_until(min(end, answer))
    if answer > end:
        assert due(bench) == (answer, answer)
    elif answer < end:
        assert due(bench) == (end, answer + bench.span(4))
    bench.run()
    assert bench.position(bench.kernel.now) == MOVED
    assert bench.answers == [ack(MOTHER, NODE)] * 2


class Punctual(SacNode):
    """A SAC that has the process woken for whatever it does."""

    __slots__ = ()

    @property
    def quiet(self) -> bool:
        return False


@pytest.mark.slow
@settings(max_examples=100)
@given(traffic(), st.booleans())
def test_whether_nodes_are_quiet_makes_no_difference_to_what_happens(
    talk: list[tuple[Ns, bytes]], soft_ops: bool
) -> None:
    some = SacSettings(soft_ops=soft_ops)
    quiet, punctual = Bench(*ADDRESSES, settings=some), Bench()
    punctual.bus = Bus(punctual.kernel, KIND.protocol)
    punctual.nodes.clear()
    for address in ADDRESSES:
        node = Punctual(address, some, punctual.bus.rate, punctual.bus.tell)
        punctual.bus.add(node)
        punctual.nodes[address] = node
    punctual.port = Port(punctual.bus.medium, punctual._take, latency=0)
    assert play(quiet, talk) == play(punctual, talk)


# ---- noise --------------------------------------------------------------------------------------

NOISE = 1_000_000
#: The noise in bursts with pauses between them, which takes some 460 s of bus time.
BABBLE_TIME = 480 * SECOND


class Babble:
    """A bus on which somebody talks rubbish and somebody else packets, and neither listens."""

    def __init__(self, kernel: Kernel, *, size: int = NOISE) -> None:
        self.bench = Bench(*ADDRESSES, kernel=kernel, seed=7)
        self.random = Random(11)
        self.left = size
        self.packets: list[Transmission] = []
        kernel.at(0, self._burst)
        kernel.at(0, self._packet)

    def _send(self, data: bytes, sender: str) -> Transmission:
        return self.bench.bus.medium.transmit(sender, data, 0)

    def _burst(self) -> None:
        size = min(self.left, self.random.randrange(1, 2_000))
        self.left -= size
        if size:
            end = self._send(self.random.randbytes(size), "babbler").end
            self.bench.kernel.at(end + self.random.randrange(400 * MS), self._burst)

    def _packet(self) -> None:
        if self.left:
            address = self.random.choice(ADDRESSES)
            self.packets.append(self._send(packet("v100", address), "mother"))
            pause = 20 * MS + self.random.randrange(200 * MS)
            self.bench.kernel.at(self.packets[-1].end + pause, self._packet)


def exchange_on(bench: Bench, until: Ns) -> None:
    """A quiet dialogue: a packet every second."""
    for number, at in enumerate(range(SECOND, until, SECOND)):
        bench.kernel.at(at, bench.bus.medium.transmit, "mother", packet(f"m{number % 9}1", 10), 0)


@pytest.mark.slow
def test_a_megabyte_of_noise_on_one_bus_costs_another_nothing() -> None:
    alone = Bench(10, 11)
    exchange_on(alone, BABBLE_TIME)
    alone.kernel.run_until(BABBLE_TIME)

    kernel = Kernel()
    beside, babble = Bench(10, 11, kernel=kernel), Babble(kernel)
    exchange_on(beside, BABBLE_TIME)
    kernel.run_until(BABBLE_TIME)

    assert babble.bench.bus.medium.counters().bytes > NOISE
    assert len(beside.heard) == 2 * (BABBLE_TIME // SECOND - 1)
    assert beside.transcript() == alone.transcript()


@pytest.mark.slow
def test_in_noise_every_packet_that_nothing_overlapped_is_answered_and_the_others_counted() -> None:
    babble = Babble(Kernel())
    bench = babble.bench
    sent: list[Transmission] = []
    bench.bus.medium.watchers.append(sent.append)
    bench.kernel.run_until(BABBLE_TIME)

    assert babble.left == 0
    ends: Ns = -1
    overlapped: set[int] = set()
    by_start = sorted(range(len(sent)), key=lambda at: (sent[at].start, sent[at].end))
    longest = -1
    for at in by_start:
        if sent[at].start < ends:
            overlapped |= {at, longest}
        if sent[at].end > ends:
            ends, longest = sent[at].end, at
    # The longest so far overlaps all that begin in it; one that only a shorter one overlapped would
    # have to lie in the longest as well.
    assert {at for at, one in enumerate(sent) if one.collided} == overlapped
    assert bench.bus.medium.counters().collided == len(overlapped)

    answers = {(one.start, one.data) for one in sent if one.sender in bench.nodes.values()}
    whole = [one for one in babble.packets if not one.collided]
    assert 500 < len(whole) < len(babble.packets) - 500
    for one in whole:
        assert (one.end + 385 * US, ack(MOTHER, one.data[1])) in answers


@pytest.mark.slow
def test_noise_leaves_nothing_behind_in_memory() -> None:
    babble = Babble(Kernel(), size=2 * NOISE)
    babble.packets = Forgetful()
    kernel = babble.bench.kernel
    babble.bench.port.close()
    kernel.run_until(BABBLE_TIME // 2)
    tracemalloc.start()
    try:
        kernel.run_until(BABBLE_TIME)
        first, _ = tracemalloc.get_traced_memory()
        kernel.run_until(BABBLE_TIME * 3 // 2)
        second, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert babble.left > 0
    # What is kept is bounded: a thousand reports, the lines parsed last, what is on its way.
    assert second - first < 100_000
    assert peak < 1_000_000


class Forgetful(list[Transmission]):
    """A list that keeps what came last."""

    def append(self, item: Transmission) -> None:
        self[:] = [item]


def test_counters_of_different_lanes_and_buses_are_their_own() -> None:
    kernel = Kernel()
    one, other = Bench(kernel=kernel, lanes=2), Bench(kernel=kernel)
    before = replace(other.bus.medium.counters())
    one.hears("v100", at=20 * MS)
    one.run()
    assert other.bus.medium.counters() == before
    assert other.heard == []
    assert one.bus.medium.counters(1).bytes == 4


@pytest.mark.parametrize("lines", [("",), ("S", "m4000000000v1")])
def test_what_a_moving_node_hears_leaves_nothing_behind_in_the_kernel(lines: tuple[str]) -> None:
    bench = Bench()
    each = 30 * MS
    bench.hears("m4000000000v1", at=each)
    for number in range(400):
        bench.hears(lines[number % len(lines)], at=(number + 2) * each)
        bench.kernel.run_until((number + 2) * each + each // 2)
    # What is cancelled is cleared away when it is more than half, and 64 at least.
    assert len(bench.kernel._loud) + len(bench.kernel._quiet) < 80
