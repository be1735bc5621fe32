"""Addresses of nodes and of servers as people write them, on a command line or in a file.

Owns ``10-19,85`` and ``HOST:PORT``, both ways. A NotationError says all that is wrong with a text,
what was expected and what came; who asked adds the place.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from ipaddress import IPv4Address, IPv6Address
from typing import Final

__all__ = [
    "HIGHEST_ADDRESS",
    "LOOPBACK",
    "LOWEST_ADDRESS",
    "NotationError",
    "addresses",
    "endpoint",
    "endpoint_text",
    "quoted",
    "ranges",
    "right_addresses",
]

#: The addresses that a node of any kind may have; its protocol says which of them its own may.
LOWEST_ADDRESS: Final = 0
HIGHEST_ADDRESS: Final = 255

#: Where a server listens when nothing else is said: nobody outside this machine gets in.
LOOPBACK: Final = "127.0.0.1"

#: More digits than any address or port has; what is longer is not worth converting.
_DIGITS: Final = 10

_NAME: Final = re.compile(r"[A-Za-z0-9_]([A-Za-z0-9_.-]*[A-Za-z0-9_])?")


class NotationError(ValueError):
    """A text that means nothing: all that is wrong with it, in words."""

    def __init__(self, *faults: str) -> None:
        super().__init__("; ".join(faults))


def addresses(text: str) -> tuple[int, ...]:
    """``10-19,85``: addresses and ranges of them, in the order given, each once."""
    found, faults = right_addresses(text)
    if faults:
        raise NotationError(*faults)
    return found


def right_addresses(text: str) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """What is right in such a text, each address once, and all that is wrong with it."""
    found: list[int] = []
    faults: list[str] = []
    for part in text.split(","):
        first, dash, last = (word.strip() for word in part.partition("-"))
        if not _is_number(first) or (dash and not _is_number(last)):
            faults.append(f"expected addresses like 10-19,85, got {quoted(part)}")
            continue
        low, high = int(first), int(last or first)
        if LOWEST_ADDRESS <= low <= high <= HIGHEST_ADDRESS:
            found.extend(range(low, high + 1))
        else:
            faults.append(
                f"expected addresses from {LOWEST_ADDRESS} to {HIGHEST_ADDRESS}, low to high, "
                f"got {quoted(part)}"
            )
    twice = {address for address, count in Counter(found).items() if count > 1}
    if twice:
        faults.append(f"expected each address once, got {ranges(sorted(twice))} twice")
    return tuple(dict.fromkeys(found)), tuple(faults)


def ranges(addresses: Iterable[int]) -> str:
    """``10-12,85`` for 10, 11, 12, 85: what :func:`addresses` reads."""
    runs: list[list[int]] = []
    for address in addresses:
        if runs and runs[-1][1] == address - 1:
            runs[-1][1] = address
        else:
            runs.append([address, address])
    return ",".join(str(low) if low == high else f"{low}-{high}" for low, high in runs)


def endpoint(text: str) -> tuple[str, int]:
    """``127.0.0.1:7000``, ``[::1]:7000`` or ``7000``, which is on the loopback; host and port.

    Port 0 lets the system choose. Nothing is looked up: whether a name is known shows only when a
    server is opened there.
    """
    host, colon, port = text.strip().rpartition(":")
    if not colon:
        host = LOOPBACK
    elif host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
        if not _is_address(host, IPv6Address):
            raise _no_endpoint(text)
    elif not _is_host(host):
        raise _no_endpoint(text)
    if not _is_number(port):
        raise _no_endpoint(text)
    if int(port) > 65_535:
        raise NotationError(f"expected a port from 0 to 65535, got {quoted(port)}")
    return host, int(port)


def endpoint_text(host: str, port: int) -> str:
    """``127.0.0.1:7000`` or ``[::1]:7000``: what :func:`endpoint` reads."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def quoted(value: object) -> str:
    """How a value is quoted: on one line, and not at any length."""
    if isinstance(value, str) and len(value) > 60:
        return f"{value[:57]!r}…"
    return repr(value)


def _no_endpoint(text: str) -> NotationError:
    return NotationError(
        "expected HOST:PORT, such as 127.0.0.1:7000 or [::1]:7000, or a port alone, "
        f"got {quoted(text)}"
    )


def _is_host(host: str) -> bool:
    if host.replace(".", "").isdecimal():  # not a name, so it must be right
        return _is_address(host, IPv4Address)
    return _NAME.fullmatch(host) is not None


def _is_address(host: str, family: type[IPv4Address | IPv6Address]) -> bool:
    try:
        family(host)
    except ValueError:
        return False
    return True


def _is_number(word: str) -> bool:
    return word.isascii() and word.isdecimal() and len(word) <= _DIGITS
