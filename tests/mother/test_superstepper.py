"""The master of a Super Stepper Bus: what becomes of messages, on a line and through links."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any, TypeVar

import pytest

from sacbus.configuration import Configuration
from sacbus.daemon import open_bus
from sacbus.host import VirtualLoop
from sacbus.hosted import HostedBus
from sacbus.kernel import MS, Kernel
from sacbus.links import LinkError
from sacbus.links.places import PtyAt, Rfc2217At, TcpAt
from sacbus.mother import BadRequest, LineLost, MotherError
from sacbus.mother.superstepper import (
    BadChecksum,
    Exchanges,
    Nak,
    NoReply,
    SuperStepper,
    SuperStepperError,
)
from sacbus.wire.superstepper import (
    Answer,
    Decay,
    Message,
    Microsteps,
    MoveSteps,
    Rate,
    Read,
    Status,
    Stop,
    encode_answer,
)
from tests.nodes.superstepper.bench import Bench

_T = TypeVar("_T")
Outcome = Answer | MotherError

MOVE = MoveSteps(True, 10_000, 10)


class Rig:
    """A bench, and the master's transactions on its line."""

    def __init__(self, *, nine: bool = False) -> None:
        self.bench = Bench(3, 4, nine=nine)
        self.sent: list[tuple[bytes, bytes]] = []
        #: What happens to the next messages instead of their being sent.
        self.weather: list[str] = []
        self.exchanges = Exchanges(self.bench.kernel, self.talk, self.bench.bus.rate)
        self.bench.port._hear = lambda heard, _now: self.exchanges.hear(heard.data)

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

    def ask(self, address: int, message: Message, **how: bool) -> Outcome:
        outcomes: list[Outcome] = []
        self.exchanges.call(address, message, outcomes.append, **how)
        while not outcomes:
            assert self.bench.kernel.run_next()
        (outcome,) = outcomes
        return outcome


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
    assert outcomes == [Answer(3, value=10), Answer(4, value=10), Answer(3, value=10)]


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
    once = bench.span(11) + bench.span(10) + 10 * MS
    assert bench.now - begin == 4 * once


@pytest.mark.parametrize(
    ("address", "message"), [(32, Stop()), (3, MoveSteps(True, 1, 70_000)), (3, Microsteps(9))]
)
def test_what_cannot_be_sent_is_refused_at_once(address: int, message: Message) -> None:
    rig = Rig()
    with pytest.raises(BadRequest, match=f"module {address}: "):
        rig.exchanges.call(address, message, lambda _: None)
    assert not rig.sent


# ---- for coroutines ----


def virtually(main: Coroutine[Any, Any, _T]) -> _T:
    loop = VirtualLoop(Kernel())
    try:
        return loop.run_until_complete(main)
    finally:
        loop.close()


def hosted(**more: Any) -> Any:  # noqa: ANN401 (a configuration's keys, and what open_bus gives)
    return open_bus(Configuration(nodes=(3, 4), kind="ss-mst67", **more))


async def everything(master: SuperStepper, bus: HostedBus) -> None:
    await master.microsteps(3, 4, Decay.SLOW)
    await master.move_at_speed(3, 4_000, clockwise=False, accelerate=False)
    assert bus.snapshot(3).rpm == -37.5
    assert await master.status(3) == Status(busy=True)
    await master.change_speed(3, 8_000)
    await master.stop(3, decelerate=False, enabled=False)
    assert await master.status(3) == Status()
    await master.move_steps(3, 5, speed=100, rate=Rate.MEDIUM)
    await asyncio.sleep(2)
    assert await master.steps_run(3) == 5
    await master.home(3, speed=10_000, most=3)
    await master.write(3, 0x10, 0x42)
    assert await master.read(3, 0x10) == 0x42
    await master.write(3, 2, 1, eeprom=True)
    assert await master.read(3, 2, eeprom=True) == 1
    assert await master.read_word(3, 3) == 32_000
    with pytest.raises(NoReply) as silent:
        await master.stop(9)
    assert isinstance(silent.value, TimeoutError)
    with pytest.raises(BadRequest, match="1, 2, 4 or 8"):
        await master.microsteps(3, 3)


@pytest.mark.parametrize("jmp2", ["open", "closed"])
def test_every_opcode_has_a_method(jmp2: str) -> None:
    async def session() -> None:
        async with hosted(settings={"jmp2": jmp2}) as bus:
            master = SuperStepper.on(bus)
            await everything(master, bus)
            master.lose("the bus is closed")
            with pytest.raises(LineLost):
                await master.stop(3)

    virtually(session())


def test_a_call_that_is_cancelled_leaves_the_line_to_others() -> None:
    async def session() -> None:
        async with hosted() as bus:
            master = SuperStepper.on(bus)
            waits = asyncio.ensure_future(master.stop(9))
            await asyncio.sleep(0.001)
            waits.cancel()
            assert await master.read(3, 2) == 10

    virtually(session())


@pytest.mark.slow
@pytest.mark.asyncio
async def test_it_works_through_a_pty_and_tcp() -> None:
    async with hosted(links=(PtyAt(None), TcpAt("127.0.0.1", 0))) as bus:
        for link in bus.links:
            async with SuperStepper.connect(link.where) as master:
                await master.move_at_speed(3, 4_000)
                assert (await master.status(3)).busy
                await master.stop(3, decelerate=False)
            with pytest.raises(LineLost, match="connect again"):
                await master.stop(3)
            with pytest.raises(LinkError, match="no ninth bits there"):
                async with SuperStepper.connect(link.where, nine=True):
                    pass


@pytest.mark.slow
@pytest.mark.asyncio
async def test_9_bit_mode_works_behind_rfc_2217() -> None:
    nine = {"jmp2": "closed"}
    async with hosted(settings=nine, links=(Rfc2217At("127.0.0.1", 0),)) as bus:
        async with SuperStepper.connect(bus.links[0].where, nine=True) as master:
            await master.move_steps(3, 5, speed=1_000)
            assert await master.read_word(3, 3) == 32_000
            assert await master.read(4, 2) == 10
        assert bus.snapshot(3).counters["ack"] == 2
