"""A serial port that an RFC 2217 server has: pyserial's client, in a thread of its own.

Owns that thread, and pyserial's defects (3.5) in it, which end in this file:

- opening, writing and closing wait: hence the thread;
- its own reader dies of an answer that nobody asked for or that is cut short, and then nobody is
  told that the line is gone;
- a server that says nothing to RTS and DTR is refused, such as ser2net on a pty, which has neither;
- what came just before the server hung up is thrown away;
- what is heard is kept without limit, an object for each byte;
- a socket that the server has closed already is left open;
- closing waits 0.3 s for nothing;
- it starts its reader by calls that Python has deprecated.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
import time
import warnings
from collections import deque
from collections.abc import Callable
from typing import Any

import serial
from serial import rfc2217

from sacbus.bus import NINE_BITS

from .client import BOUND, unreachable
from .errors import LinkError
from .marking import runs

__all__ = ["RemotePort"]


class _Heard:
    """In place of the queue that pyserial keeps what it hears in: hands it on to the loop.

    pyserial's thread puts bytes, one at a time, and at last None.
    """

    def __init__(self, tell: Callable[[], object]) -> None:
        self._tell = tell
        self._lock = threading.Lock()
        self._bytes = bytearray()
        self._ended = False
        #: Why none will come any more.
        self.why = "closed by the other end"

    def put(self, byte: bytes | None) -> None:
        """pyserial's: a byte has come, or, None, none will any more."""
        with self._lock:
            first = not self._bytes and not self._ended
            if byte is None:
                self._ended = True
            elif len(self._bytes) < BOUND:  # or else the loop stands still, and the line goes on
                self._bytes += byte
        if first or byte is None:
            self._tell()

    def take(self) -> tuple[bytes, bool]:
        """The loop's: what has come since, and whether that was all."""
        with self._lock:
            data = bytes(self._bytes)
            self._bytes.clear()
            return data, self._ended

    def qsize(self) -> int:
        """pyserial's, when it is to forget what has come: nothing is kept here for it."""
        return 0


class _Port(rfc2217.Serial):
    """pyserial's port, with what it hears taken from it at once."""

    _socket: socket.socket | None
    _thread: threading.Thread | None
    _rfc2217_options: dict[str, Any]  # pyserial's questions, which its stubs leave out

    def __init__(self, heard: _Heard) -> None:
        self._heard = heard
        #: The parity that was asked for last.
        self._asked = ""
        super().__init__()

    @property
    def _read_buffer(self) -> _Heard:
        return self._heard

    @_read_buffer.setter
    def _read_buffer(self, _queue: object) -> None:
        """No other queue is kept, such as pyserial's own."""

    def _telnet_read_loop(self) -> None:
        """The reader's thread: whatever it dies of, it is told that nothing comes any more."""
        try:
            super()._telnet_read_loop()  # type: ignore[misc]  # the stubs leave it out
        except OSError:
            pass  # it could not answer any more, which is as good as hung up
        except Exception as fault:  # noqa: BLE001 (a server may send what it likes)
            self._heard.why = f"its server sent what is no RFC 2217: {fault}"
        self._heard.put(None)

    def _telnet_process_subnegotiation(self, suboption: bytes) -> None:
        """The reader's thread: an answer. One to no question is ignored."""
        with contextlib.suppress(TypeError, ValueError):
            super()._telnet_process_subnegotiation(suboption)  # type: ignore[misc]  # as above

    def rfc2217_set_control(self, value: bytes) -> None:
        """RTS, DTR and the like: asked for, and not insisted upon."""
        self._rfc2217_options["control"].set(value)

    def ask_parity(self, parity: str) -> None:
        """Have the server set it before what is written next; pyserial's own setting waits."""
        if parity != self._asked:
            self._asked = parity
            self._rfc2217_options["parity"].set(bytes((rfc2217.RFC2217_PARITY_MAP[parity],)))

    def close(self) -> None:
        """Close the socket whatever state it is in, and see its reader's thread end."""
        self.is_open = False
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()
        if self._thread is not None:
            self._thread.join()
        self._thread = self._socket = None


class RemotePort:
    """The port behind ``url`` at ``baud``, 8N1; to be opened.

    ``hear`` gets what comes, ``lose`` why it is gone: once. ``rts`` is the level that its RTS is
    asked to have.
    """

    def __init__(
        self,
        url: str,
        host: str,
        baud: int,
        hear: Callable[[bytes], None],
        lose: Callable[[str], None],
        *,
        rts: bool = True,
    ) -> None:
        self._url = url
        self._host = host
        self._hear = hear
        self._lose = lose
        self._loop = asyncio.get_running_loop()
        self._opened: asyncio.Future[None] = self._loop.create_future()
        self._ended = asyncio.Event()
        self._told = False
        self._heard = _Heard(lambda: self._on_loop(self._attend))
        self._port = _Port(self._heard)
        self._port.baudrate = baud
        self._port.rts = rts
        self._port.port = url
        #: What is to be written, and whether anything more will be; both under the condition.
        self._work = threading.Condition()
        self._waiting = bytearray()
        self._marked: deque[tuple[str, bytes]] = deque()
        self._closing = False

    async def open(self) -> None:
        """Connect and agree with the server; LinkError in one line when that cannot be had.

        A server that says nothing to RFC 2217 is waited for 3 s.
        """
        # pyserial's thread is started by deprecated calls, which is nobody's business here.
        warnings.filterwarnings("ignore", category=DeprecationWarning, module=r"serial\.rfc2217")
        threading.Thread(target=self._run, name=f"sacbus {self._url}", daemon=True).start()
        try:
            await self._opened
        except BaseException:
            self.close()
            raise

    def send(self, data: bytes) -> None:
        """Have it written; what the server does not take in time is dropped beyond BOUND."""
        with self._work:
            if len(self._waiting) + len(data) <= BOUND:
                self._waiting += data
                self._work.notify()

    def check_marking(self) -> None:
        """Its server is asked for the parity when there is something to send."""

    def send_marked(self, data: bytes, ninth: bytes) -> None:
        """Have it written, each run of bytes with the parity that makes their ninth bits."""
        with self._work:
            self._marked += runs(data, ninth)
            self._work.notify()

    def set_dtr(self, *, asserted: bool) -> bool:  # noqa: ARG002 (as other wires)
        """Not here: when a server would have set it nobody knows."""
        return False

    def close(self) -> None:
        """Have it closed, behind what waits to be written. Idempotent."""
        with self._work:
            self._closing = True
            self._work.notify()

    async def finish(self) -> None:
        self.close()
        await self._ended.wait()

    def _run(self) -> None:
        """The thread's: open, write, close."""
        try:
            try:
                self._port.open()
            except Exception as fault:  # noqa: BLE001 (all that pyserial lets through)
                self._on_loop(self._open_failed, fault)
                return
            self._on_loop(self._open_done)
            with contextlib.suppress(OSError):  # the reader tells of it
                while data := self._next():
                    self._port.write(data)
                    if self._marked:
                        # RFC 2217 has no word for "when these are out": wait for as long as the
                        # line takes, or the parity changes under them.
                        time.sleep(len(data) * NINE_BITS / self._port.baudrate)
        finally:
            self._port.close()
            self._on_loop(self._ended.set)

    def _next(self) -> bytes:
        """What is to be written next; b"" when that was all."""
        with self._work:
            self._work.wait_for(lambda: self._waiting or self._marked or self._closing)
            if self._marked:
                parity, data = self._marked.popleft()
                self._port.ask_parity(parity)
                return data
            data = bytes(self._waiting)
            self._waiting.clear()
            return data

    def _on_loop(self, callback: Callable[..., object], *arguments: object) -> None:
        """From a thread: have the loop call, if it still runs."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(callback, *arguments)

    def _open_done(self) -> None:
        if not self._opened.done():  # the caller may have gone
            self._opened.set_result(None)

    def _open_failed(self, fault: Exception) -> None:
        if not self._opened.done():
            self._opened.set_exception(_refusal(self._url, self._host, self._port.baudrate, fault))

    def _attend(self) -> None:
        """Hand on what has come."""
        data, ended = self._heard.take()
        if data:
            self._hear(data)
        if ended and not self._told:
            self._told = True
            self.close()
            self._lose(self._heard.why)


def _refusal(url: str, host: str, baud: int, fault: Exception) -> LinkError:
    """What pyserial's refusal to open a port comes from, in one line."""
    if str(fault).startswith("Could not open port"):  # before there was a connection
        cause: BaseException | None = fault
        innermost: BaseException = fault
        while cause is not None:
            if isinstance(cause, OSError) and not isinstance(cause, serial.SerialException):
                return unreachable(url, host, cause)
            innermost, cause = cause, cause.__context__
        return LinkError(f"a malformed URL ({innermost})", url, "write it as rfc2217://host:port")
    # An OSError of the system's own: it has hung up upon the first question.
    if isinstance(fault, OSError) and (fault.errno or "seem to support" in str(fault)):
        what = "the peer is no RFC 2217 server"
    else:
        what = f"the peer is no RFC 2217 server, or does not take {baud} baud 8N1"
    return LinkError(what, url, "check host and port, or try socket:// for plain TCP")
