"""The files that ``--sacbus-record`` leaves: one for each bus of a test, and for each scenario.

Owns their names. Two tests never share one, wherever their files lie, and a test's is the same in
every run and on every machine.
"""

from __future__ import annotations

import os
import re
from hashlib import sha256
from pathlib import Path
from typing import BinaryIO, Final

__all__ = ["Recordings"]

#: What stands in the name of a file otherwise than in a test's: as one ``-``.
_ODD: Final = re.compile(r"[^A-Za-z0-9_.-]+")

#: Characters of a test's name that the file's has at most: file systems take 255 in all.
MOST: Final = 150


class Recordings:
    """Where a test is recorded to: files in ``directory``, which is made with the first of them.

    ``test`` is how pytest calls it, ``path`` its file and ``root`` what pytest's names begin at;
    of tests beyond that the name alone does not say which one it is.
    """

    def __init__(self, directory: Path, test: str, path: Path, root: Path) -> None:
        self._directory = directory
        self._test = test
        try:
            self._place = Path(os.path.relpath(path, root)).as_posix()
        except ValueError:  # another drive of Windows
            self._place = path.as_posix()

    def open(self, *what: str) -> BinaryIO:
        """A new file for writing and reading; ``what`` tells it from others of the same test.

        Its last eight digits are of all that makes it this one.
        """
        digits = sha256("\0".join((self._place, self._test, *what)).encode()).hexdigest()[:8]
        words = (_ODD.sub("-", one).strip("-") for one in (self._test[-MOST:], *what))
        self._directory.mkdir(parents=True, exist_ok=True)
        # Without a buffer: one that is full tries again when it is closed.
        return (self._directory / f"{'-'.join((*words, digits))}.jsonl").open("w+b", buffering=0)
