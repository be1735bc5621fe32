"""Telling a service manager how far we are: systemd's readiness protocol.

Owns one datagram. Source: systemd, sd_notify(3): ``NOTIFY_SOCKET`` names a unix datagram socket, a
leading ``@`` an abstract one. A leaf beside the command line.
"""

from __future__ import annotations

import contextlib
import os
import socket

__all__ = ["notify"]


def notify(state: str) -> bool:
    """Send ``READY=1``, ``STOPPING=1``, ...; False when nobody asked for it or it cannot be sent.

    A manager that has gone away is no reason for a bus to end, so nothing is raised.
    """
    address = os.environ.get("NOTIFY_SOCKET", "")
    if not address or not hasattr(socket, "AF_UNIX"):
        return False
    if address.startswith("@"):
        address = "\0" + address[1:]
    with contextlib.suppress(OSError):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) as manager:
            manager.settimeout(0)
            manager.sendto(state.encode(), address)
        return True
    return False
