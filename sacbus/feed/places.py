"""Where feeds are found: the runtime directory and its sockets, and whether a LINK is a bus's.

Owns the names. A socket is ``PID-NUMBER.feed``; that of a run that was killed refuses connections,
and whoever notices removes it. It bears its name only once it listens, so a live one never refuses.
"""

from __future__ import annotations

import os
import socket
import warnings
from ipaddress import ip_address
from pathlib import Path
from typing import Final
from urllib.parse import SplitResult, urlsplit

import platformdirs

from sacbus.feed.lines import Way

__all__ = ["default_directory", "private_directory", "remove_stale", "same_link", "sockets"]

SUFFIX: Final = ".feed"


def default_directory(*, make: bool = False) -> Path:
    """The user's runtime directory for sacbus; OSError if others could have put it there."""
    with warnings.catch_warnings():
        # Newer ones warn where the system has no such directory and they take one under /tmp.
        warnings.simplefilter("ignore")
        return platformdirs.user_runtime_path("sacbus", ensure_exists=make)


def private_directory(directory: Path | None) -> Path:
    """The directory, made if need be, for the user alone; OSError when that cannot be had."""
    place = default_directory(make=True) if directory is None else directory
    place.mkdir(parents=True, exist_ok=True)
    status = place.lstat()
    if status.st_uid != os.geteuid() or place.is_symlink():
        raise PermissionError(None, "it belongs to somebody else", str(place))
    if status.st_mode & 0o077:
        place.chmod(0o700)
    return place


def sockets(directory: Path) -> list[Path]:
    """All that may be feeds, in the order of their names; none where there is no directory."""
    return sorted(directory.glob(f"*{SUFFIX}"))


def remove_stale(directory: Path) -> None:
    """Remove the sockets that nobody listens at any more; OSError when that cannot be done."""
    for path in sockets(directory):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as hail:
            hail.settimeout(0)
            try:
                hail.connect(os.fspath(path))
            except ConnectionRefusedError:
                path.unlink(missing_ok=True)
            except OSError:  # gone already, not ours, or busy: not to be removed
                continue


def same_link(asked: str, way: Way) -> bool:
    """Whether ``asked`` is that link: its path or URL, the device behind it, or another name of it.

    A server at a wildcard address is found under any name of this machine's loopback.
    """
    if asked == way.where:
        return True
    if "://" in asked or "://" in way.where:
        try:
            return _same_url(urlsplit(asked), urlsplit(way.where))
        except ValueError:  # brackets that do not match, a port that there cannot be
            return False
    return way.device is not None and os.path.realpath(asked) == way.device


def _same_url(asked: SplitResult, served: SplitResult) -> bool:
    if (asked.scheme, asked.port) != (served.scheme, served.port) or asked.port is None:
        return False
    there, here = asked.hostname or "localhost", served.hostname or "localhost"
    if there == here:
        return True
    try:
        listens = ip_address(here)
        if there == "localhost":  # whichever of the two it is taken for
            return listens.is_loopback or listens.is_unspecified
        wanted = ip_address(there)
    except ValueError:  # a name: what it stands for is not asked
        return False
    return wanted.is_loopback and listens.is_unspecified and wanted.version == listens.version
