"""What every link must do, whatever it is made of."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.links import LinkError, TellingLink
from tests.links.rig import BACKENDS, Client, Ear, Rig, able_to, rig_of, until

pytestmark = pytest.mark.asyncio

EVERY_BYTE = bytes(range(256))

#: More than any link may keep of what its client does not read, the system's own buffers included.
TOO_MUCH = 8_000_000


async def say(client: Client, data: bytes) -> None:
    """Write all of it, as far as the line takes it at a time."""
    rest = memoryview(data)

    def written() -> bool:
        nonlocal rest
        rest = rest[client.write(bytes(rest[:4096])) :]
        return not rest

    await until(written)


async def turn_the_loop() -> None:
    """Let happen what is about to: descriptors that are ready are attended to at every turn."""
    for _ in range(50):
        await asyncio.sleep(0)


@pytest.mark.slow
@pytest.mark.parametrize("name", BACKENDS)
@given(
    said=st.lists(st.binary(min_size=1, max_size=600), max_size=6),
    answered=st.lists(st.binary(min_size=1, max_size=600), max_size=6),
)
@settings(max_examples=25)
async def test_bytes_arrive_in_order_both_ways_however_they_are_split(
    name: str, said: list[bytes], answered: list[bytes]
) -> None:
    async with rig_of(name) as rig:
        client = await rig.client_is_known()
        ear = Ear(client)
        for chunk in said:
            await say(client, chunk)
        for chunk in answered:
            rig.link.send(chunk)
        await until(lambda: rig.heard == b"".join(said))
        await until(lambda: ear.has(b"".join(answered)))
        counters = rig.link.counters
        assert (counters.bytes_in, counters.bytes_out) == (len(rig.heard), len(ear.heard))
        assert counters.dropped_out == 0


async def test_every_byte_value_passes_untouched(rig: Rig) -> None:
    client = await rig.client_is_known()
    ear = Ear(client)
    await say(client, EVERY_BYTE)
    rig.link.send(EVERY_BYTE)
    await until(lambda: rig.heard == EVERY_BYTE)
    await until(lambda: ear.has(EVERY_BYTE))


async def test_what_is_delivered_is_never_empty(rig: Rig) -> None:
    chunks: list[bytes] = []
    rig.deliver = chunks.append
    client = await rig.client_is_known()
    client.write(b"")
    client.write(b"x")
    await until(lambda: chunks)
    assert chunks == [b"x"]
    assert rig.link.counters.bytes_in == 1


async def test_a_deliver_that_answers_at_once_is_heard(rig: Rig) -> None:
    rig.deliver = lambda data: rig.link.send(data[::-1])
    client = await rig.client_is_known()
    ear = Ear(client)
    client.write(b"abc")
    await until(lambda: ear.has(b"cba"))


@able_to("stands alone", "tells absence")
async def test_what_is_sent_before_anybody_came_is_dropped_counted_and_never_found(
    rig: Rig,
) -> None:
    rig.link.send(b"to nobody")
    assert rig.link.counters.dropped_out == 9
    ear = Ear(await rig.client_is_known())
    rig.link.send(b"to you")
    await until(lambda: ear.has(b"to you"))


@able_to("tells absence")
async def test_what_is_sent_when_all_have_left_is_dropped_counted_and_never_found(
    rig: Rig,
) -> None:
    await rig.leave(await rig.client_is_known())
    dropped = rig.link.counters.dropped_out
    rig.link.send(b"to nobody")
    assert rig.link.counters.dropped_out == dropped + 9
    ear = Ear(await rig.client_is_known())
    rig.link.send(b"to you")
    await until(lambda: ear.has(b"to you"))


async def test_a_client_may_go_and_another_come(rig: Rig) -> None:
    for turn in range(1, 4):
        client = await rig.client_is_known()
        ear = Ear(client)
        client.write(b"%d" % turn)
        await until(lambda: rig.heard.endswith(b"%d" % turn))
        rig.link.send(b"answer %d" % turn)
        await until(lambda: ear.has(b"answer %d" % turn))
        await rig.leave(client)
    if rig.tells_absence:
        assert rig.counters.clients == 3
    assert rig.heard == b"123"


@able_to("tells absence")
async def test_what_one_client_left_unread_is_not_found_by_the_next(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.send(b"unread" * 1000)
    assert rig.link.counters.bytes_out == 6000
    await rig.leave(client)
    ear = Ear(await rig.client_is_known())
    rig.link.send(b"fresh")
    await until(lambda: ear.has(b"fresh"))


@able_to("counts unread")
async def test_what_a_client_left_unread_is_counted_as_dropped(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.send(b"unread" * 1000)
    dropped = rig.link.counters.dropped_out
    await rig.leave(client)
    assert rig.link.counters.dropped_out - dropped >= 6000


async def test_what_a_client_wrote_before_it_left_is_heard(rig: Rig) -> None:
    client = rig.client()
    await say(client, b"last words")
    rig.forget(client)
    await until(lambda: rig.heard == b"last words")


@able_to("tells leaving")
async def test_that_a_client_has_left_is_told_once_all_that_it_said_is_heard(rig: Rig) -> None:
    heard_then: list[bytes] = []
    client = await rig.client_is_known()
    link = rig.link
    assert isinstance(link, TellingLink)
    link.left = lambda: heard_then.append(bytes(rig.heard))
    await say(client, b"last words")
    await turn_the_loop()
    assert heard_then == []
    rig.forget(client)
    await until(lambda: heard_then)
    assert heard_then == [b"last words"]


@able_to("tells leaving")
async def test_a_link_that_is_closed_is_not_left_by_its_client(rig: Rig) -> None:
    told: list[str] = []
    await rig.client_is_known()
    link = rig.link
    assert isinstance(link, TellingLink)
    link.left = lambda: told.append("left")
    rig.shut()
    await turn_the_loop()
    assert told == []


async def test_a_slow_reader_loses_the_rest_and_nothing_else(rig: Rig) -> None:
    client = await rig.client_is_known()
    ear = Ear(client)
    counters = rig.link.counters
    sent = 0
    while counters.dropped_out < 10_000:
        rig.link.send(EVERY_BYTE * 4)
        sent += 1024
        assert sent < TOO_MUCH
    assert counters.bytes_out + counters.dropped_out == sent
    held = counters.bytes_out
    assert held >= 4096
    await until(lambda: ear.has_bytes(held))
    assert ear.heard[:4096] == EVERY_BYTE * 16
    assert len(ear.heard) == held
    rig.link.send(b"and on")
    await until(lambda: ear.has_bytes(held + 6))
    assert ear.heard.endswith(b"and on")
    assert counters.bytes_out == held + 6


@pytest.mark.slow
async def test_a_megabyte_passes_both_ways_to_a_reader_that_reads(rig: Rig) -> None:
    client = await rig.client_is_known()
    ear = Ear(client)
    megabyte = EVERY_BYTE * 4096
    await say(client, megabyte)
    await until(lambda: len(rig.heard) >= len(megabyte))
    assert rig.heard == megabyte
    for at in range(0, len(megabyte), 4096):
        rig.link.send(megabyte[at : at + 4096])
        await until(lambda: ear.has_bytes(at + 4096))
    assert ear.heard == megabyte
    assert rig.link.counters.dropped_out == 0


async def test_what_a_client_says_while_held_is_heard_afterwards(rig: Rig) -> None:
    client = await rig.client_is_known()
    client.write(b"before ")
    await until(lambda: rig.heard == b"before ")
    rig.link.hold(held=True)
    rig.link.hold(held=True)
    waiting = b"meanwhile "[client.write(b"meanwhile ") :]
    await turn_the_loop()
    assert rig.heard == b"before "
    rig.link.hold(held=False)
    rig.link.hold(held=False)
    await say(client, waiting + b"after")
    await until(lambda: rig.heard == b"before meanwhile after")


async def test_a_client_that_is_held_has_to_wait_in_the_end(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.hold(held=True)
    said = 0
    while (taken := client.write(bytes(65_536))) > 0:
        said += taken
        await turn_the_loop()
        assert said < 10 * TOO_MUCH  # what systems let two sockets hold is a good deal
    rig.link.hold(held=False)
    ear = Ear(client)  # a program that also reads writes on what it has not got rid of
    await until(lambda: ear.has(b"") and len(rig.heard) == said)


async def test_a_client_may_leave_while_it_is_held_and_is_heard_all_the_same(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.hold(held=True)
    taken = client.write(b"last words")
    rig.forget(client)
    await turn_the_loop()
    rig.link.hold(held=False)
    await until(lambda: rig.heard == b"last words"[:taken])


async def test_a_link_that_was_closed_while_held_is_not_held_any_more(rig: Rig) -> None:
    await rig.client_is_known()
    rig.link.hold(held=True)
    rig.shut()
    await rig.start()
    client = await rig.client_is_known()
    await say(client, b"free")
    await until(lambda: rig.heard == b"free")


@able_to("has rate")
async def test_the_line_has_the_rate_of_the_bus_until_a_client_sets_its_own(rig: Rig) -> None:
    await rig.client_is_known()
    assert rig.link.client_baud() == 38_400


async def test_opening_twice_is_refused_and_harmless(rig: Rig) -> None:
    with pytest.raises(LinkError, match="open already"):
        await rig.start()
    client = await rig.client_is_known()
    with pytest.raises(LinkError, match="open already"):
        rig.link.open(rig.hear)
    client.write(b"still here")
    await until(lambda: rig.heard == b"still here")


async def test_closing_twice_is_closing_once(rig: Rig) -> None:
    await rig.client_is_known()
    rig.link.close()
    rig.link.close()
    rig.shut()
    rig.shut()


async def test_a_closed_link_drops_what_it_is_told_to_send(rig: Rig) -> None:
    await rig.client_is_known()
    rig.link.close()
    dropped = rig.link.counters.dropped_out
    rig.link.send(b"nobody")
    rig.link.hold(held=True)
    assert rig.link.counters.dropped_out == dropped + 6


@able_to("hangs up")
async def test_a_client_of_a_closed_link_finds_the_line_dead(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.close()

    def dead() -> bool:
        try:
            client.write(b"anyone?")
            client.read()
        except OSError:
            return True
        return False

    await until(dead)
    assert rig.heard == b""


async def test_a_link_may_be_opened_again(rig: Rig) -> None:
    rig.shut()
    await rig.start()
    client = await rig.client_is_known()
    ear = Ear(client)
    client.write(b"again")
    rig.link.send(b"yes")
    await until(lambda: rig.heard == b"again")
    await until(lambda: ear.has(b"yes"))


async def test_a_link_may_be_closed_by_what_it_delivers(rig: Rig) -> None:
    heard: list[bytes] = []

    def deliver(data: bytes) -> None:
        heard.append(data)
        rig.link.close()

    rig.deliver = deliver
    client = await rig.client_is_known()
    client.write(b"stop")
    await until(lambda: heard)
    await turn_the_loop()
    assert b"".join(heard) == b"stop"
