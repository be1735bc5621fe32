"""Programs at the other end of a link, each as plain as such a program can be."""

from __future__ import annotations

import contextlib
import os
import socket
from pathlib import Path
from typing import Protocol
from urllib.parse import urlsplit

from sacbus.links import MemoryLink


class Client(Protocol):
    """A program that has the other end open. Neither call ever waits; OSError: the line is dead."""

    def write(self, data: bytes) -> int:
        """Write what the line takes; how many bytes that was."""

    def read(self) -> bytes: ...

    def close(self) -> None: ...


class MemoryProgram:
    def __init__(self, link: MemoryLink) -> None:
        self._client = link.client()

    def write(self, data: bytes) -> int:
        return self._client.write(data)

    def read(self) -> bytes:
        return self._client.read()

    def close(self) -> None:
        self._client.close()


class PtyProgram:
    """Bare system calls: it sets nothing, flushes nothing, and so sees what the link left."""

    def __init__(self, path: str | Path) -> None:
        self.descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def write(self, data: bytes) -> int:
        try:
            return os.write(self.descriptor, data)
        except BlockingIOError:
            return 0

    def read(self) -> bytes:
        try:
            return os.read(self.descriptor, 65_536)
        except BlockingIOError:
            return b""

    def close(self) -> None:
        os.close(self.descriptor)


class TcpProgram:
    """A bare socket, connected to a URL as a server's ``where`` is one."""

    def __init__(self, url: str) -> None:
        parts = urlsplit(url)
        self.socket = socket.create_connection((parts.hostname, parts.port), timeout=20)
        self.socket.setblocking(False)

    def write(self, data: bytes) -> int:
        try:
            return self.socket.send(data)
        except BlockingIOError:
            return 0

    def read(self) -> bytes:
        try:
            data = self.socket.recv(65_536)
        except BlockingIOError:
            return b""
        if not data:
            raise ConnectionError("closed by the other end")
        return data

    def close(self) -> None:
        self.socket.close()


class TelnetProgram(TcpProgram):
    """Telnet at its plainest: it keeps data and commands apart, and never answers one."""

    def __init__(self, url: str) -> None:
        super().__init__(url)
        self._unsent = b""
        self._received = b""

    def write(self, data: bytes) -> int:
        self._send_on()
        if self._unsent:
            return 0
        self._unsent = data.replace(b"\xff", b"\xff\xff")
        self._send_on()
        return len(data)

    def _send_on(self) -> None:
        if self._unsent:
            self._unsent = self._unsent[super().write(self._unsent) :]

    def read(self) -> bytes:
        self._send_on()
        with contextlib.suppress(BlockingIOError):
            self._received += super().read()
        data, self._received = plain(self._received)
        return data


def plain(stream: bytes) -> tuple[bytes, bytes]:
    """The data in a telnet stream, and what of it is a sequence without its end."""
    data = bytearray()
    at = 0
    while at < len(stream):
        if stream[at] != 0xFF:
            data.append(stream[at])
            at += 1
            continue
        command = stream[at + 1 : at + 2]
        if command == b"\xff":
            data += command
            size = 2
        elif command == b"\xfa":
            end = stream.find(b"\xff\xf0", at)
            size = end + 2 - at if end >= 0 else len(stream) + 1
        else:
            size = 3 if command and command in b"\xfb\xfc\xfd\xfe" else 2
        if at + size > len(stream):
            break
        at += size
    return bytes(data), stream[at:]
