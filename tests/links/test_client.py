"""LINKs as users write them, against real peers: ptys, plain TCP, and other people's RFC 2217."""

from __future__ import annotations

import asyncio
import errno
import re
import socket
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager

import pytest
import pytest_asyncio
import serial
from serial.urlhandler import protocol_loop

from sacbus.links import Line, LinkError, client, open_line
from sacbus.links.serialport import SerialConnection
from tests.links.peers import OPENED, Far, PortManagerPeer, TcpPeer, free_port, of_pty
from tests.links.rig import until

pytestmark = pytest.mark.asyncio

EVERY_BYTE = bytes(range(256))
IAC, SB, SE = b"\xff", b"\xfa", b"\xf0"


class Talk:
    """An open line, what it has heard, and what it has told of its end."""

    def __init__(self, line: Line) -> None:
        self.line = line
        self.heard = bytearray()
        self.lost: list[str] = []
        line.start(self.heard.extend, self.lost.append)


@asynccontextmanager
async def talking(link: str, baud: int = 38_400) -> AsyncIterator[Talk]:
    async with open_line(link, baud) as line:
        yield Talk(line)


async def refusal(link: str) -> str:
    """What opening it says, in one line that names it."""
    with pytest.raises(LinkError) as refused:
        async with open_line(link, 38_400):
            pass
    assert "\n" not in str(refused.value)
    assert refused.value.where == link
    return str(refused.value)


@pytest_asyncio.fixture(params=list(OPENED))
async def far(request: pytest.FixtureRequest) -> AsyncIterator[Far]:
    async with OPENED[request.param]() as far:
        yield far


# -------------------------------------------------------------------------------- the same for all


async def test_every_byte_passes_untouched_both_ways(far: Far) -> None:
    async with talking(far.link) as talk:
        talk.line.send(EVERY_BYTE)
        await until(lambda: talk.heard == EVERY_BYTE)
        far.say(b"and more")
        await until(lambda: talk.heard == EVERY_BYTE + b"and more")
    assert talk.lost == []


@pytest.mark.slow
async def test_much_passes_in_its_order(far: Far) -> None:
    async with talking(far.link) as talk:
        for turn in range(1, 31):
            talk.line.send(EVERY_BYTE * 4)
            await until(lambda: len(talk.heard) == turn * 1024)
    assert talk.heard == EVERY_BYTE * 120


@pytest.mark.slow
async def test_a_line_that_is_lost_is_told_of_once_in_one_line(far: Far) -> None:
    async with talking(far.link) as talk:
        far.say(b"last words")
        await until(lambda: talk.heard == b"last words")
        far.hang_up()
        await until(lambda: talk.lost)
        talk.line.send(b"to nobody")
        for _ in range(50):
            await asyncio.sleep(0)
    (told,) = talk.lost
    assert told.startswith("the line is gone (")
    assert told.endswith(f"), {far.link}, open it again")
    assert "\n" not in told


@pytest.mark.slow
async def test_what_came_before_anybody_listened_is_not_heard(
    far: Far, monkeypatch: pytest.MonkeyPatch
) -> None:
    come = bytearray()
    hear = Line.hear

    def noting(line: Line, data: bytes) -> None:
        come.extend(data)
        hear(line, data)

    monkeypatch.setattr(Line, "hear", noting)
    async with open_line(far.link, 38_400) as line:
        far.say(b"stale")
        line.send(b"!")
        await until(lambda: b"stale" in come and b"!" in come)
        talk = Talk(line)
        line.send(b"fresh")
        await until(lambda: len(talk.heard) >= 5)
        assert talk.heard == b"fresh"


@pytest.mark.slow
async def test_a_line_that_is_lost_before_anybody_listens_is_told_of_all_the_same(far: Far) -> None:
    async with open_line(far.link, 38_400) as line:
        far.hang_up()
        await until(lambda: line._lost)
        assert Talk(line).lost == [line._lost]


@pytest.mark.slow
async def test_closing_is_no_loss_and_may_be_done_again_and_by_who_hears(far: Far) -> None:
    async with open_line(far.link, 38_400) as line:
        heard = bytearray()
        lost: list[str] = []

        def hear(data: bytes) -> None:
            heard.extend(data)
            line.close()

        line.start(hear, lost.append)
        far.say(b"stop")
        await until(lambda: heard)
        line.close()
        line.send(b"nothing")
        far.say(b"nothing")
    assert (bytes(heard), lost) in [(b"stop"[:count], []) for count in range(1, 5)]


@pytest.mark.slow
async def test_a_line_may_be_opened_again(far: Far) -> None:
    for _ in range(2):
        async with talking(far.link) as talk:
            talk.line.send(b"hello")
            await until(lambda: talk.heard == b"hello")


# --------------------------------------------------------------------------------------- LINKs


@pytest.mark.parametrize(
    ("link", "why"),
    [
        ("socket://host", "a URL without a port number, .*write it as socket://host:port"),
        ("rfc2217://host", "a URL without a port number, .*write it as rfc2217://host:port"),
        ("socket://host:port", "'port' is not a port number, .*give one from 1 to 65535"),
        ("socket://host:70000", "'70000' is not a port number"),
        ("socket://host:0", "'0' is not a port number"),
        ("rfc2217://host:-1", "'-1' is not a port number"),
        ("socket://", "a malformed URL"),
        ("socket://:7000", "a malformed URL"),
        ("socket://[::1:7000", "a malformed URL .Invalid IPv6 URL."),
        ("socket://me@host:7000", "a malformed URL"),
        ("socket://host:7000/dev/ttyUSB0", "a malformed URL"),
        ("socket://host:7000?timeout=3", "a malformed URL"),
        ("rfc2217://127.0.0.1:1?colour=red", "a malformed URL .unknown option: 'colour'."),
        ("rfc2217://127.0.0.1:1?logging=loudly", "a malformed URL"),
        ("loop://", "loop:// is no kind of link, .*give a path, socket://host:port or rfc2217://"),
        ("http://host:80", "http:// is no kind of link"),
        ("C://COM5", "c:// is no kind of link"),
        ("COM5", "no such file"),
        ("/nonexistent/port", "no such file.*, check the path"),
        ("/", "it is a directory"),
        ("/dev/null", "it is not a serial port"),
        ("socket://[fe80::1%nosuch]:7000", "unknown host fe80::1%nosuch, .*check the name"),
        ("rfc2217://[fe80::1%nosuch]:7000", "unknown host fe80::1%nosuch"),
        (f"socket://{'long' * 20}:7000", "unknown host long"),
    ],
)
async def test_a_link_that_is_wrong_says_what_is_wrong(link: str, why: str) -> None:
    text = await refusal(link)
    assert re.search(why, text), text


@pytest.mark.parametrize("scheme", ["socket", "rfc2217"])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
async def test_a_port_that_nobody_listens_on_is_told(scheme: str, host: str) -> None:
    text = await refusal(f"{scheme}://{host}:{free_port()}")
    assert text.startswith("connection refused: nobody listens there, ")
    assert text.endswith(", check host and port, and whether the bus is running")


async def test_a_name_of_several_addresses_is_tried_to_the_last() -> None:
    async with TcpPeer().served() as link, talking(link.replace("127.0.0.1", "localhost")) as talk:
        talk.line.send(b"hello")
        await until(lambda: talk.heard == b"hello")


async def test_the_sixth_version_of_ip_is_spoken_too() -> None:
    if not socket.has_ipv6:
        pytest.skip("this Python has no IPv6")
    with ExitStack() as stack:
        try:
            stack.enter_context(socket.create_server(("::1", 0), family=socket.AF_INET6))
        except OSError:
            pytest.skip("this machine has no IPv6")
    async with TcpPeer().served(host="::1") as link, talking(link.upper()) as talk:
        talk.line.send(b"hello")
        await until(lambda: talk.heard == b"hello")


async def test_a_peer_that_answers_nothing_at_all_is_not_waited_for_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(client, "CONNECT_TIMEOUT", 0.05)
    with ExitStack() as stack:
        # Nobody lets those in that come, and there is room for none to wait.
        listener = stack.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        address = listener.getsockname()
        for _ in range(3):
            waiting = stack.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(address)
        assert "nobody answers there" in await refusal(f"socket://127.0.0.1:{address[1]}")


# --------------------------------------------------------------------------------- serial ports


async def test_a_port_is_had_by_one_alone() -> None:
    async with of_pty() as far, talking(far.link):
        assert "another program has it" in await refusal(far.link)
        with pytest.raises(serial.SerialException) as refused:
            serial.Serial(far.link, exclusive=True)
        assert refused.value.errno == errno.EWOULDBLOCK


@pytest.mark.parametrize("rts", [False, True])
async def test_rts_is_as_asked_for_from_the_start(rts: bool) -> None:
    # A pty has none; that the port would set it is all that can be seen there.
    async with of_pty() as far, open_line(far.link, 38_400, rts=rts) as line:
        assert isinstance(line._wire, SerialConnection)
        assert line._wire.port.rts is rts
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link, open_line(link, 38_400, rts=rts):
        await until(lambda: peer.port.rts is rts)


# -------------------------------------------------------------------------------------- plain TCP


async def test_what_was_written_last_reaches_a_peer_that_is_left_at_once() -> None:
    peer = TcpPeer(lambda _data: b"")
    async with peer.served() as link:
        async with talking(link) as talk:
            talk.line.send(b"x" * 60_000)
        await until(lambda: len(peer.heard) == 60_000)


async def test_a_peer_that_does_not_read_is_not_kept_more_for_than_the_bound() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        async with open_line(f"socket://127.0.0.1:{listener.getsockname()[1]}", 38_400) as line:
            peer, _ = listener.accept()
            for _ in range(10_000):
                line.send(bytes(1000))
            wire = line._wire
            assert isinstance(wire, client._Socket)
            assert wire._transport is not None
            assert wire._transport.get_write_buffer_size() <= client.BOUND
            peer.close()
            await until(lambda: line._lost)


async def test_a_peer_that_never_reads_is_left_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(client, "FINISH_TIMEOUT", 0.01)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        async with open_line(f"socket://127.0.0.1:{listener.getsockname()[1]}", 38_400) as line:
            peer, _ = listener.accept()
            for _ in range(10_000):
                line.send(bytes(1000))
        peer.close()


# --------------------------------------------------------------------------------------- RFC 2217


def rooms() -> list[threading.Thread]:
    return [one for one in threading.enumerate() if "2217" in one.name]


async def test_a_server_is_told_the_rate_and_the_room_is_left_empty() -> None:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link:
        async with talking(link, baud=19_200):
            assert peer.port.baudrate == 19_200
            assert (peer.port.bytesize, peer.port.parity, peer.port.stopbits) == (8, "N", 1)
            assert len(rooms()) == 2  # ours, and pyserial's reader
        await until(lambda: not rooms())


@pytest.mark.slow
@pytest.mark.parametrize("reply", [bytes, lambda _data: b"", lambda _data: IAC + SE])
async def test_a_peer_that_is_no_rfc_2217_server_is_told(reply: Callable[[bytes], bytes]) -> None:
    async with TcpPeer(reply).served("rfc2217") as link:
        text = await refusal(f"{link}?timeout=0.2")
    assert text.startswith("the peer is no RFC 2217 server, ")
    assert text.endswith(", check host and port, or try socket:// for plain TCP")
    await until(lambda: not rooms())


async def test_a_peer_that_hangs_up_at_once_is_no_rfc_2217_server() -> None:
    class Rude(TcpPeer):
        def data_received(self, data: bytes) -> None:
            self.hang_up()

    async with Rude().served("rfc2217") as link:
        assert "no RFC 2217 server" in await refusal(f"{link}?timeout=0.2")


async def test_a_server_that_keeps_to_another_rate_is_told() -> None:
    class OneRate(protocol_loop.Serial):
        def _reconfigure_port(self) -> None:
            if self.baudrate != 9600:
                raise ValueError("no such rate")

    peer = PortManagerPeer()
    peer.port = OneRate("loop://", 9600)
    async with peer.served("rfc2217") as link:
        assert "or does not take 38400 baud 8N1" in await refusal(f"{link}?timeout=0.5")


@pytest.mark.slow
@pytest.mark.parametrize(
    "answer",
    [
        IAC + SB + b"\x2c\x70\x01" + IAC + SE,  # a purge that nobody asked for
        IAC + SB + IAC + SE,
        IAC + SB + b"\x2c" + IAC + SE,
        IAC + SB + b"\x2c\x65" + IAC + SE,
        IAC + b"\xf1",
        IAC + b"\xfb\x2a",
    ],
)
async def test_an_answer_to_no_question_does_no_harm(answer: bytes) -> None:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link, talking(link) as talk:
        peer.write(b"be" + answer + b"fore")
        await until(lambda: talk.heard == b"before")
        talk.line.send(b" and after")
        await until(lambda: talk.heard == b"before and after")
    assert talk.lost == []


async def test_a_server_that_sends_what_cannot_be_read_is_lost_and_told_of() -> None:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link, talking(link) as talk:
        peer.write(b"before" + IAC + SE + b"after")
        await until(lambda: talk.lost)
    assert talk.heard == b"before"
    assert "its server sent what is no RFC 2217" in talk.lost[0]
    assert "\n" not in talk.lost[0]


@pytest.mark.slow
async def test_what_a_server_says_before_it_hangs_up_is_heard() -> None:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link, talking(link) as talk:
        peer.say(EVERY_BYTE * 100)
        peer.hang_up()
        await until(lambda: talk.lost)
    assert talk.heard == EVERY_BYTE * 100


async def test_what_was_written_last_reaches_a_server_that_is_left_at_once() -> None:
    peer = PortManagerPeer(lambda _data: b"")
    async with peer.served("rfc2217") as link:
        async with talking(link) as talk:
            peer.heard.clear()
            talk.line.send(EVERY_BYTE * 20)
        await until(lambda: peer.heard == EVERY_BYTE * 20)


@pytest.mark.slow
async def test_a_loop_that_stands_still_is_not_kept_more_for_than_the_bound() -> None:
    peer = PortManagerPeer()
    async with peer.served("rfc2217") as link, talking(link) as talk:
        wire = talk.line._wire
        heard = wire._port._heard  # type: ignore[union-attr]  # a RemotePort
        for _ in range(client.BOUND + 10):
            heard.put(b"x")
        await until(lambda: talk.heard)
        assert len(talk.heard) == client.BOUND


@pytest.mark.parametrize("peer", [lambda: TcpPeer(lambda _data: b""), PortManagerPeer])
async def test_a_caller_who_gives_up_while_it_is_opened_leaves_nothing_behind(
    peer: Callable[[], TcpPeer],
) -> None:
    async with peer().served("rfc2217") as link:
        opening = asyncio.ensure_future(refusal(f"{link}?timeout=0.1"))
        await until(rooms)
        opening.cancel()
        with pytest.raises(asyncio.CancelledError):
            await opening
        await until(lambda: not rooms())
