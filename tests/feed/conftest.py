"""A runtime directory for each test."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def runtime() -> Iterator[Path]:
    """Not pytest's own directories: a socket's path has at most 107 bytes."""
    directory = Path(tempfile.mkdtemp(prefix="sac"))
    yield directory
    shutil.rmtree(directory)
