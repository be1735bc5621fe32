"""What every link must do, whatever it is made of."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sacbus.links import LinkError
from tests.links.rig import BACKENDS, Client, Ear, Rig, rig_of, until

pytestmark = pytest.mark.asyncio

EVERY_BYTE = bytes(range(256))


async def say(client: Client, data: bytes) -> None:
    """Write all of it, as far as the line takes it at a time."""
    rest = memoryview(data)

    def written() -> bool:
        nonlocal rest
        rest = rest[client.write(bytes(rest[:4096])) :]
        return not rest

    await until(written)


@pytest.mark.parametrize("backend", BACKENDS)
@given(
    said=st.lists(st.binary(min_size=1, max_size=600), max_size=6),
    answered=st.lists(st.binary(min_size=1, max_size=600), max_size=6),
)
@settings(max_examples=25)
async def test_bytes_arrive_in_order_both_ways_however_they_are_split(
    backend: str, said: list[bytes], answered: list[bytes]
) -> None:
    with rig_of(backend) as rig:
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
    client = await rig.client_is_known()
    client.write(b"")
    client.write(b"x")
    await until(lambda: rig.heard == b"x")
    assert rig.link.counters.bytes_in == 1


async def test_a_deliver_that_answers_at_once_is_heard(rig: Rig) -> None:
    rig.link.close()
    rig.link.open(lambda data: rig.link.send(data[::-1]))
    client = await rig.client_is_known()
    ear = Ear(client)
    client.write(b"abc")
    await until(lambda: ear.has(b"cba"))


async def test_what_is_sent_to_nobody_is_dropped_counted_and_never_found(telling_rig: Rig) -> None:
    telling_rig.link.send(b"to nobody")
    assert telling_rig.link.counters.dropped_out == 9
    ear = Ear(await telling_rig.client_is_known())
    telling_rig.link.send(b"to you")
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
        assert rig.link.counters.clients == 3
    assert rig.heard == b"123"


async def test_what_one_client_left_unread_is_not_found_by_the_next(telling_rig: Rig) -> None:
    client = await telling_rig.client_is_known()
    telling_rig.link.send(b"unread" * 1000)
    assert telling_rig.link.counters.bytes_out == 6000
    dropped = telling_rig.link.counters.dropped_out
    await telling_rig.leave(client)
    assert telling_rig.link.counters.dropped_out - dropped >= 6000
    ear = Ear(await telling_rig.client_is_known())
    telling_rig.link.send(b"fresh")
    await until(lambda: ear.has(b"fresh"))


async def test_what_a_client_wrote_before_it_left_is_heard(rig: Rig) -> None:
    client = rig.client()
    client.write(b"last words")
    await rig.leave(client)
    await until(lambda: rig.heard == b"last words")


async def test_a_slow_reader_loses_the_rest_and_nothing_else(rig: Rig) -> None:
    client = await rig.client_is_known()
    ear = Ear(client)
    for _ in range(200):
        rig.link.send(EVERY_BYTE * 4)
    counters = rig.link.counters
    assert counters.dropped_out > 0
    assert counters.bytes_out + counters.dropped_out == 200 * 1024
    held = counters.bytes_out
    assert held >= 4096
    await until(lambda: ear.has_bytes(held))
    assert ear.heard[:4096] == EVERY_BYTE * 16
    assert len(ear.heard) == held
    rig.link.send(b"and on")
    await until(lambda: ear.heard.endswith(b"and on") or ear.has_bytes(held + 6))
    assert ear.heard.endswith(b"and on")


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


async def test_the_line_has_the_rate_of_the_bus_until_a_client_sets_its_own(rig: Rig) -> None:
    assert rig.link.client_baud() == 38_400
    await rig.client_is_known()
    assert rig.link.client_baud() == 38_400


async def test_opening_twice_is_refused_and_harmless(rig: Rig) -> None:
    with pytest.raises(LinkError, match="open already"):
        rig.open()
    client = await rig.client_is_known()
    client.write(b"still here")
    await until(lambda: rig.heard == b"still here")


async def test_closing_twice_is_closing_once(rig: Rig) -> None:
    await rig.client_is_known()
    rig.link.close()
    rig.link.close()


async def test_a_closed_link_drops_what_it_is_told_to_send(rig: Rig) -> None:
    rig.link.close()
    rig.link.send(b"nobody")
    assert rig.link.counters.dropped_out == 6


async def test_a_client_of_a_closed_link_finds_the_line_dead(rig: Rig) -> None:
    client = await rig.client_is_known()
    rig.link.close()
    with pytest.raises(OSError, match=r"closed|Input/output error"):
        client.write(b"anyone?")


async def test_a_link_may_be_opened_again(rig: Rig) -> None:
    rig.link.close()
    rig.open()
    client = await rig.client_is_known()
    ear = Ear(client)
    client.write(b"again")
    rig.link.send(b"yes")
    await until(lambda: rig.heard == b"again")
    await until(lambda: ear.has(b"yes"))


async def test_a_link_may_be_closed_by_what_it_delivers(rig: Rig) -> None:
    rig.link.close()
    heard: list[bytes] = []

    def deliver(data: bytes) -> None:
        heard.append(data)
        rig.link.close()

    rig.link.open(deliver)
    client = await rig.client_is_known()
    client.write(b"stop")
    await until(lambda: heard)
    await asyncio.sleep(0)
    assert b"".join(heard) == b"stop"
