"""The serial port of the bus, as real programs meet it."""

from __future__ import annotations

import asyncio
import fcntl
import os
import resource
import select
import shutil
import subprocess
import sys
import termios
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import pytest_asyncio
import serial

from sacbus.links import LinkError, Presence, PtyLink
from tests.links.rig import Ear, LinkRig, NoPresence, PtyProgram, until

pytestmark = pytest.mark.asyncio

NOBODY = 65_534


@pytest_asyncio.fixture
async def rig(tmp_path: Path) -> AsyncIterator[LinkRig]:
    rig = LinkRig(PtyLink(tmp_path / "port"))
    rig.open()
    yield rig
    rig.close()


@pytest.fixture
def unprivileged(tmp_path: Path) -> Iterator[None]:
    """An ordinary user's rights, which root lays down for the while."""
    if os.geteuid() != 0:
        yield
        return
    for directory in (tmp_path, *tmp_path.parents):
        if directory.owner() == "root" and directory.is_relative_to("/tmp/"):  # noqa: S108
            directory.chmod(0o755)
    os.chown(tmp_path, NOBODY, -1)
    os.seteuid(NOBODY)
    yield
    os.seteuid(0)


def absent(rig: LinkRig) -> bool:
    """Whether the link drops what it is told to send, since nobody is there."""
    before = rig.link.counters.bytes_out
    rig.link.send(b"?")
    return rig.link.counters.bytes_out == before


async def test_the_symlink_is_where_and_leads_to_the_line(rig: LinkRig, tmp_path: Path) -> None:
    assert rig.link.where == str(tmp_path / "port")
    assert str(Path(rig.link.where).readlink()).startswith("/dev/")
    rig.close()
    assert list(tmp_path.iterdir()) == []


async def test_without_a_symlink_where_is_the_device_once_it_is_there() -> None:
    link = PtyLink()
    assert link.where == ""
    link.open(lambda data: None)
    assert Path(link.where).is_char_device()
    link.close()
    assert link.where == ""


async def test_a_path_that_is_taken_leaves_no_pty_behind(rig: LinkRig) -> None:
    # The descriptors are counted after every test.
    second = PtyLink(rig.link.where)
    with pytest.raises(LinkError, match=f"served by process {os.getpid()}"):
        second.open(lambda data: None)
    second.close()
    assert Path(rig.link.where).is_char_device()


async def test_a_rate_that_cannot_be_set_leaves_no_pty_behind() -> None:
    with pytest.raises(ValueError, match="cannot set 0 baud"):
        PtyLink(baud=0).open(lambda data: None)


async def test_a_system_without_a_pty_to_give_is_told_in_one_line() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        with pytest.raises(LinkError, match=r"no pty to be had \(.+\), /dev/ptmx, "):
            PtyLink().open(lambda data: None)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


async def test_a_program_that_sets_nothing_finds_the_line_raw(rig: LinkRig) -> None:
    client = await rig.client_is_known()
    ear = Ear(client)
    tricky = b"\x03\x04\x0d\x0a\x11\x13\x1a\x7f\x00\xff\n"
    client.write(tricky)
    rig.link.send(tricky)
    await until(lambda: rig.heard == tricky)
    await until(lambda: ear.has(tricky))
    assert rig.heard == tricky  # no echo came back in the meantime


@pytest.mark.parametrize("rate", [9600, 57_600, 250_000])
async def test_pyserial_talks_and_its_rate_is_seen(rig: LinkRig, rate: int) -> None:
    with serial.Serial(rig.link.where, rate, timeout=0) as port:
        await until(lambda: rig.link.client_baud() == rate)
        port.write(b"to the bus")
        await until(lambda: rig.heard == b"to the bus")
        rig.link.send(b"from the bus")
        await until(lambda: port.in_waiting == 12)
        assert port.read(12) == b"from the bus"
    await until(lambda: absent(rig))
    assert rig.link.client_baud() == 38_400


async def test_pyserial_may_hold_the_port_for_itself(rig: LinkRig) -> None:
    with serial.Serial(rig.link.where, timeout=0, exclusive=True) as port:
        port.write(b"mine")
        await until(lambda: rig.heard == b"mine")
        with pytest.raises(serial.SerialException):
            serial.Serial(rig.link.where, exclusive=True)


async def test_the_modem_lines_that_a_pty_lacks_are_refused_by_the_system(rig: LinkRig) -> None:
    with serial.Serial(rig.link.where) as port, pytest.raises(OSError, match="Inappropriate ioctl"):
        port.rts = True


@pytest.mark.skipif(shutil.which("socat") is None, reason="socat is not installed")
async def test_socat_talks(rig: LinkRig) -> None:
    known = rig.link.counters.clients
    socat = await asyncio.create_subprocess_exec(
        "socat",
        "-",
        f"{rig.link.where},raw,echo=0",
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
    )
    assert socat.stdin is not None
    assert socat.stdout is not None
    await until(lambda: rig.link.counters.clients > known)
    socat.stdin.write(b"over")
    await until(lambda: rig.heard == b"over")
    rig.link.send(b"and out")
    assert await socat.stdout.readexactly(7) == b"and out"
    socat.stdin.close()
    await socat.wait()
    await until(lambda: absent(rig))


async def test_a_shell_may_write_a_packet_and_leave_at_once(rig: LinkRig) -> None:
    for _ in range(20):
        rig.heard.clear()
        with Path(rig.link.where).open("wb", buffering=0) as port:
            port.write(b"\x02\x00\x01S\x03\x0f\x00")
        await until(lambda: rig.heard == b"\x02\x00\x01S\x03\x0f\x00")
    await until(lambda: absent(rig))


async def test_a_killed_program_has_left(rig: LinkRig) -> None:
    hold = (
        "import os, sys; os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY); print(); sys.stdin.read()"
    )
    known = rig.link.counters.clients
    with subprocess.Popen(
        [sys.executable, "-c", hold, rig.link.where], stdin=subprocess.PIPE
    ) as program:
        await until(lambda: rig.link.counters.clients > known)
        rig.link.send(b"unread")
        program.kill()
        program.wait()
        await until(lambda: absent(rig))
    assert rig.link.counters.dropped_out >= 6


async def test_two_programs_share_the_line_until_the_last_has_left(rig: LinkRig) -> None:
    first = await rig.client_is_known()
    second = await rig.client_is_known()
    first.write(b"one ")
    await until(lambda: rig.heard == b"one ")
    second.write(b"two")
    await until(lambda: rig.heard == b"one two")
    first.close()
    rig._programs.remove(first)
    ear = Ear(second)
    rig.link.send(b"still there?")
    await until(lambda: ear.has(b"still there?"))
    await rig.leave(second)


async def test_programs_that_come_and_go_in_the_same_instant_are_not_miscounted(
    rig: LinkRig,
) -> None:
    # The kernel tells three opens in a row as one event, and two closes as well.
    programs = [rig.client() for _ in range(3)]
    programs[2].write(b"one")
    await until(lambda: rig.heard == b"one")
    for program in programs[:2]:
        program.close()
        rig._programs.remove(program)
    programs[2].write(b" two")
    await until(lambda: rig.heard == b"one two")
    ear = Ear(programs[2])
    rig.link.send(b"still there?")
    await until(lambda: ear.has(b"still there?"))
    await rig.leave(programs[2])


async def test_the_next_program_finds_nothing_stale_however_quick_it_is(rig: LinkRig) -> None:
    # The line is never hung up between them: one closes and one opens while the loop is busy.
    client = await rig.client_is_known()
    for turn in range(1, 10):
        rig.link.send(b"stale")
        client.close()
        rig._programs.remove(client)
        client = rig.client()
        client.write(b"%d" % turn)
        await until(lambda: rig.heard.endswith(b"%d" % turn))
        ear = Ear(client)
        rig.link.send(b"fresh")
        await until(lambda: ear.has_bytes(5))
        assert ear.heard == b"fresh"
        assert rig.link.counters.dropped_out == 5 * turn
        assert rig.link.counters.clients == 1 + turn


async def test_an_answer_given_at_once_is_not_thrown_away_with_what_is_stale(rig: LinkRig) -> None:
    # All of this is there when the loop looks, the former program's last byte the first of it.
    rig.link.close()
    rig.link.open(lambda data: rig.link.send(b"answer") if data.endswith(b"?") else None)
    former = await rig.client_is_known()
    rig.link.send(b"stale")
    former.write(b"x")
    assert isinstance(rig.link, PtyLink)
    assert rig.link._pair is not None
    select.select([rig.link._pair.master], [], [], 10)  # now it is first in the loop's queue
    former.close()
    rig._programs.remove(former)
    client = rig.client()
    client.write(b"?")
    ear = Ear(client)
    await until(lambda: rig.link.counters.bytes_in == 2)
    await until(lambda: ear.has_bytes(6))
    assert ear.heard == b"answer"


class ComesMeanwhile(Presence):
    """A program opens the line while the link, busy with one that has left, is given no hints."""

    def __init__(self, come: Callable[[], object]) -> None:
        super().__init__()
        self._come = come

    @contextmanager
    def unseen(self, path: str) -> Iterator[None]:
        with super().unseen(path):
            yield
            self._come()


async def test_a_program_that_comes_while_another_leaves_is_heard() -> None:
    came: list[PtyProgram] = []

    def come() -> None:
        if not came:
            came.append(PtyProgram(link.where))
            came[0].write(b"here")

    heard = bytearray()
    link = PtyLink(presence=ComesMeanwhile(come))
    link.open(heard.extend)
    former = PtyProgram(link.where)
    await until(lambda: link.counters.clients == 1)
    former.close()
    await until(lambda: heard == b"here")
    assert link.counters.clients == 2
    link.send(b"hello")
    await until(lambda: Ear(came[0]).has(b"hello"))
    came[0].close()
    link.close()


@pytest.mark.slow
async def test_no_program_is_missed_in_the_moment_when_another_leaves(rig: LinkRig) -> None:
    # It hangs, and the test with it, as soon as one answer is lost.
    ask = """
import os, sys
for turn in range(2000):
    port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
    os.write(port, b"?")
    assert os.read(port, 10) == b"!", turn
    os.close(port)
"""
    rig.link.close()
    rig.link.open(lambda data: rig.link.send(b"!" * len(data)))
    program = await asyncio.create_subprocess_exec(sys.executable, "-c", ask, rig.link.where)
    try:
        async with asyncio.timeout(60):
            assert await program.wait() == 0
    finally:
        if program.returncode is None:
            program.kill()
            await program.wait()
    assert rig.link.counters.bytes_in == 2000


async def test_what_is_unread_when_the_link_closes_is_counted(rig: LinkRig) -> None:
    await rig.client_is_known()
    rig.link.send(b"unread")
    rig.link.close()
    assert rig.link.counters.dropped_out == 6


async def test_what_a_program_did_to_the_line_is_undone_when_it_leaves(rig: LinkRig) -> None:
    client = PtyProgram(rig.link.where)
    attributes = termios.tcgetattr(client.descriptor)
    attributes[0] = termios.ICRNL | termios.IXON
    attributes[1] = termios.OPOST | termios.ONLCR
    attributes[3] = termios.ICANON | termios.ECHO
    attributes[4] = attributes[5] = termios.B9600
    termios.tcsetattr(client.descriptor, termios.TCSANOW, attributes)
    await until(lambda: rig.link.client_baud() == 9600)
    await until(lambda: rig.link.counters.clients == 1)
    rig.link.send(b"half a line")
    client.close()
    await until(lambda: absent(rig))
    assert rig.link.counters.dropped_out >= 11
    assert rig.link.client_baud() == 38_400
    rig.heard.clear()
    ear = Ear(await rig.client_is_known())
    rig.link.send(b"raw\n\r")
    await until(lambda: ear.has(b"raw\n\r"))
    assert rig.heard == b""


async def test_a_line_left_exclusive_by_a_killed_program_is_open_to_the_next(
    tmp_path: Path, unprivileged: None
) -> None:
    rig = LinkRig(PtyLink(tmp_path / "port"))
    rig.open()
    for _ in range(3):
        client = PtyProgram(rig.link.where)
        await until(lambda: not absent(rig))
        fcntl.ioctl(client.descriptor, termios.TIOCEXCL)
        if os.geteuid() != 0:
            with pytest.raises(OSError, match="busy"):
                PtyProgram(rig.link.where)
        client.close()  # without TIOCNXCL, as by a kill
        await until(lambda: absent(rig))
    ear = Ear(await rig.client_is_known())
    rig.link.send(b"welcome")
    await until(lambda: ear.has(b"welcome"))
    rig.close()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, whom an exclusive line does not stop")
async def test_a_line_left_exclusive_is_open_to_all_again_when_the_bus_runs_as_root(
    rig: LinkRig,
) -> None:
    client = PtyProgram(rig.link.where)
    await until(lambda: not absent(rig))
    fcntl.ioctl(client.descriptor, termios.TIOCEXCL)
    client.close()
    await until(lambda: absent(rig))
    device = Path(rig.link.where).resolve()
    device.chmod(0o666)
    os.seteuid(NOBODY)
    try:
        PtyProgram(device).close()
    finally:
        os.seteuid(0)


async def test_links_may_share_what_tells_presence(tmp_path: Path) -> None:
    presence = Presence()
    rigs = [LinkRig(PtyLink(tmp_path / str(number), presence=presence)) for number in range(3)]
    for rig in rigs:
        rig.open()
    ears = [Ear(await rig.client_is_known()) for rig in rigs]
    for number, rig in enumerate(rigs):
        rig.link.send(b"%d" % number)
    for number, ear in enumerate(ears):
        await until(lambda: ear.has(b"%d" % number))
    rigs[0].close()
    await rigs[1].leave(rigs[1]._programs[0])
    await rigs[1].client_is_known()
    for rig in rigs:
        rig.close()


async def test_without_inotify_what_nobody_reads_fills_a_buffer_and_is_then_dropped() -> None:
    rig = LinkRig(PtyLink(presence=NoPresence()))
    rig.open()
    for _ in range(100):
        rig.link.send(bytes(1024))
    counters = rig.link.counters
    assert 4096 <= counters.bytes_out < 102_400
    assert counters.bytes_out + counters.dropped_out == 102_400
    client = rig.client()
    client.write(b"hello")
    await until(lambda: rig.heard == b"hello")
    rig.close()


async def test_the_loop_sleeps_while_nobody_is_there(rig: LinkRig) -> None:
    # A master that nobody has open is ready to be read for ever; a loop that watched it would spin.
    loop = asyncio.get_running_loop()
    assert isinstance(loop, asyncio.SelectorEventLoop)
    client = await rig.client_is_known()
    await rig.leave(client)
    assert loop._selector.select(0) == []  # type: ignore[attr-defined]  # no public way to ask
