"""A runtime directory of a test's own, so that its buses and other people's do not meet."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["runtime_directory"]


@contextmanager
def runtime_directory() -> Iterator[Path]:
    """Not one of pytest's own directories: a socket's path has at most 107 bytes."""
    directory = Path(tempfile.mkdtemp(prefix="sac"))
    try:
        yield directory
    finally:
        shutil.rmtree(directory)
