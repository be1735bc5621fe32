"""When an answer of a terminal port is complete, and when there is none."""

from __future__ import annotations

import asyncio
import tracemalloc
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import pytest

from sacbus.host import run_virtual
from sacbus.kernel import Kernel
from sacbus.links import Line, open_line
from sacbus.terminal.dialog import BREATH, PAUSE, Dialog, NoAnswer
from tests.terminal.rig import PROMPT, Device, device

_T = TypeVar("_T")


def talk(with_device: Device, scene: Callable[[Dialog], Awaitable[_T]]) -> _T:
    async def main() -> _T:
        async with open_line(with_device.path, 38_400) as line:
            return await scene(Dialog(line, with_device.path))

    return asyncio.run(main())


#: A message that comes unasked, and how many of them.
ROW = b"85:10> hello\n"
ROWS = 5_000


@contextmanager
def traced() -> Iterator[None]:
    """What is allocated is counted meanwhile."""
    tracemalloc.start()
    try:
        yield
    finally:
        tracemalloc.stop()


async def begun(dialog: Dialog) -> tuple[str, str]:
    return await dialog.begin(), await dialog.ask("q")


def answers(line: bytes) -> bytes:
    return b"\r\nQ is at 1\r\n\r\nSAC>" if line == b"q" else PROMPT


@pytest.mark.parametrize("echo", [True, False])
def test_an_answer_is_what_comes_behind_the_echo_up_to_the_prompt(echo: bool) -> None:
    with device(answers, echo=echo) as port:
        assert talk(port, begun) == ("SAC>", "\nQ is at 1\n\nSAC>")
        assert port.heard == [b"", b"q"]


def test_an_answer_is_as_long_as_it_is() -> None:
    screen = b"".join(b"%d\t200\tCW\r\n" % row for row in range(5_000))
    with device(lambda line: (screen if line else b"") + PROMPT) as port:
        _, shown = talk(port, begun)
        assert shown == screen.replace(b"\r", b"").decode() + "SAC>"


def test_an_answer_in_many_pieces_is_not_copied_with_each() -> None:
    async def scene() -> None:
        line = Line("memory")
        dialog = Dialog(line, "memory")
        asking = asyncio.create_task(dialog.ask("q"))
        await asyncio.sleep(0)
        for _ in range(ROWS):
            line.hear(ROW)
        tracemalloc.reset_peak()
        before, _ = tracemalloc.get_traced_memory()
        line.hear(ROW)
        _, peak = tracemalloc.get_traced_memory()
        assert peak - before < ROWS * len(ROW) / 10
        line.hear(PROMPT)
        assert await asking == ROW.decode() * (ROWS + 1) + "SAC>"

    with traced():
        asyncio.run(scene())


def test_what_comes_while_nobody_waits_is_shown_and_not_kept() -> None:
    async def scene() -> None:
        line = Line("memory")
        shown = 0

        def show(text: str) -> None:
            nonlocal shown
            shown += len(text)

        dialog = Dialog(line, "memory", show)
        asking = asyncio.create_task(dialog.ask("q"))
        await asyncio.sleep(0)
        line.hear(PROMPT)
        assert await asking == "SAC>"
        before, _ = tracemalloc.get_traced_memory()
        for _ in range(ROWS):
            line.hear(ROW)
        after, _ = tracemalloc.get_traced_memory()
        assert after - before < ROWS * len(ROW) / 10
        assert shown == len(PROMPT) + ROWS * len(ROW)

    with traced():
        asyncio.run(scene())


@pytest.mark.parametrize(
    ("shown", "over"),
    [
        (b"SAC>", True),
        (b"\r\nSAC>\r\n", True),
        (b"x" * 200 + b"\nSAC>", True),
        (b"x" * 200 + b"SAC>", False),
        (b"xSAC>" + b" " * 60, False),
    ],
)
def test_a_prompt_stands_at_the_beginning_of_a_line(shown: bytes, over: bool) -> None:
    async def scene() -> None:
        line = Line("memory")
        asking = asyncio.create_task(Dialog(line, "memory").ask("q"))
        await asyncio.sleep(0)
        loop = asyncio.get_running_loop()
        began = loop.time()
        for at in range(len(shown)):
            line.hear(shown[at : at + 1])
        await asking
        # A prompt ends an answer at once, and what is none only by the silence behind it.
        assert loop.time() - began == pytest.approx(BREATH if over else PAUSE)

    run_virtual(Kernel(), scene())


@pytest.mark.parametrize(
    ("link", "at_once"),
    [
        ("/dev/pts/7", True),
        ("/dev/ttys007", True),  # macOS
        ("/dev/ttyS0", False),
        ("/dev/ttyUSB0", False),
        ("/dev/cu.usbserial-1", False),
        ("/dev/tty.usbserial-1", False),
    ],
)
def test_only_to_a_pty_a_line_is_sent_before_a_boot_would_be_over(link: str, at_once: bool) -> None:
    sent: list[bytes] = []

    class Listening(Line):
        def send(self, data: bytes) -> None:
            sent.append(data)

    async def scene() -> None:
        beginning = asyncio.create_task(Dialog(Listening(link), link).begin())
        await asyncio.sleep(0)
        beginning.cancel()

    asyncio.run(scene())
    assert sent == ([b"\r"] if at_once else [])


def test_what_follows_a_prompt_at_once_is_of_the_same_answer() -> None:
    # As when a key is obeyed at once, and the end of its line a moment later.
    async def scene() -> None:
        loop = asyncio.get_running_loop()
        line = Line("memory")
        dialog = Dialog(line, "memory")
        asking = asyncio.create_task(dialog.ask("+"))
        await asyncio.sleep(0)
        line.hear(b"+\r\nSAC>")
        loop.call_later(0.001, line.hear, b"\r\nSAC>")
        assert await asking == "SAC>\nSAC>"

    asyncio.run(scene())


def test_a_prompt_within_an_answer_does_not_end_it() -> None:
    with device(lambda line: b"SAC>\r\nSAC> is the prompt\r\nSAC>" if line else PROMPT) as port:
        assert talk(port, begun)[1] == "SAC>\nSAC> is the prompt\nSAC>"


@pytest.mark.slow
def test_silence_ends_an_answer_that_has_another_prompt() -> None:
    with device(lambda line: b"QP: " if line else PROMPT) as port:
        assert talk(port, begun)[1] == "QP: "


@pytest.mark.slow
@pytest.mark.parametrize("echo", [True, False], ids=["a loop of wire", "nobody"])
def test_where_nobody_answers_that_is_told(echo: bool) -> None:
    with (
        device(lambda _: b"" if echo else None, echo=echo) as port,
        pytest.raises(NoAnswer, match=r"^no answer within 3 s, expected the prompt SAC>, /dev/pts"),
    ):
        talk(port, Dialog.begin)


def test_a_line_that_is_gone_is_told_in_words() -> None:
    with device(lambda line: None if line else PROMPT) as port:

        async def scene(dialog: Dialog) -> None:
            await dialog.begin()
            asking = asyncio.ensure_future(dialog.ask("q"))
            async with asyncio.timeout(30):
                while b"q" not in port.heard:  # noqa: ASYNC110 (its thread has no event of ours)
                    await asyncio.sleep(0.001)
            port.unplug()
            with pytest.raises(ConnectionError, match=r"the line is gone .*, open it again"):
                await asking
            with pytest.raises(ConnectionError, match="the line is gone"):
                await dialog.ask("q")

        talk(port, scene)


@pytest.mark.slow
def test_no_key_falls_into_the_second_in_which_a_reset_device_takes_it_for_a_restore() -> None:
    # A board behind a network's serial server is reset when that opens its port.
    async def scene() -> None:
        heard: list[bytes] = []
        booted = asyncio.Event()

        async def board(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            async def boot() -> None:
                writer.write(b"SAC 1.17\r\n")
                await asyncio.sleep(1)  # the device's own second
                heard.append(b"booted")
                writer.write(b"SAC>")
                booted.set()

            task = asyncio.create_task(boot())
            while data := await reader.read(100):
                heard.append(data)
                writer.write(data + b"\r\nSAC>")
            await task
            writer.close()

        async with await asyncio.start_server(board, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            where = f"socket://127.0.0.1:{port}"
            async with open_line(where, 38_400) as line:
                dialog = Dialog(line, where)
                assert await dialog.begin() == "SAC 1.17\nSAC>"
                await dialog.ask("m400")
        assert heard == [b"booted", b"m400\r"]

    asyncio.run(scene())
