"""Disks that are full: which of them the machine has that tests run on."""

from __future__ import annotations

import resource
from pathlib import Path

import pytest

__all__ = ["needs_full_device", "needs_full_disk"]

#: A device that every write fails on with "No space left on device".
needs_full_device = pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="only Linux has /dev/full"
)

#: A limit on the size of files that a test can set on another process: "File too large".
needs_full_disk = pytest.mark.skipif(
    not hasattr(resource, "prlimit"), reason="only Linux has prlimit"
)
