"""The servers there are, and what tests of all of them need."""

from __future__ import annotations

from collections.abc import Callable
from urllib.parse import urlsplit

import pytest

from sacbus.links import Link, LinkError, Server
from sacbus.links.rfc2217 import Rfc2217Server
from sacbus.links.tcp import TcpServer
from tests.links.programs import TcpProgram, TelnetProgram

AnyServer = TcpServer | Rfc2217Server

#: By the name that they have among all links: a server, and a program that connects to it.
KINDS: dict[str, tuple[type[AnyServer], type[TcpProgram]]] = {
    "tcp": (TcpServer, TcpProgram),
    "rfc2217": (Rfc2217Server, TelnetProgram),
}


def ignore(link: Link) -> Callable[[], None]:
    link.open(lambda data: None)
    return lambda: None


async def refusal(server: Server) -> LinkError:
    with pytest.raises(LinkError) as refused:
        await server.open(ignore)
    server.close()
    assert "\n" not in str(refused.value)
    return refused.value


def port_of(server: Server) -> int:
    port = urlsplit(server.where).port
    assert port is not None
    return port
