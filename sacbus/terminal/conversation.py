"""A person at a terminal: lines are edited here, and sent when they are finished.

Owns keyboard and screen of ``sacbus terminal``. Editing and history are readline's, so the prompt
is readline's as well: what a SAC shows is printed as it comes, up to the beginning of the line that
it leaves open, its prompt, and readline goes on from there.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from platformdirs import user_state_path

from sacbus.terminal.background import Background
from sacbus.terminal.dialog import PROMPT, NoAnswer, Untypable

try:
    import readline
except ImportError:  # Windows edits lines itself
    _HERE = False
else:
    _HERE = True

__all__ = ["converse"]

HISTORY_LINES: Final = 1_000


def converse(link: str, baud: int, *, history: bool) -> None:
    """Talk until the end of input (Ctrl-D). KeyboardInterrupt is passed on.

    ``history``: keep what is typed for the next time. LinkError, ConnectionError, and NoAnswer to
    the first question, in one line each.
    """
    screen = _Screen()
    if _HERE:
        # Nobody wants files completed here, nor an Esc too many to change what all keys mean.
        for binding in ("tab: self-insert", '"\\M-\\C-j": accept-line', '"\\M-\\C-m": accept-line'):
            readline.parse_and_bind(binding)
    main = threading.get_ident()
    lost = threading.Event()

    def lose() -> None:
        lost.set()
        if hasattr(signal, "pthread_kill"):
            signal.pthread_kill(main, signal.SIGINT)  # nothing else ends readline's waiting

    with (
        _history(_history_file() if history else None),
        Background(link, baud, screen.show, lose) as dialog,
    ):
        try:
            dialog.begin()
            while True:
                with screen.edited() as prompt:
                    line = input(prompt)
                try:
                    dialog.ask(line)
                except (Untypable, NoAnswer) as fault:
                    # The next line may fare better.
                    screen.show(f"{fault}\n{prompt}")
        except EOFError:
            screen.end()
        except KeyboardInterrupt:
            if not lost.is_set():
                raise
            screen.end()
            dialog.ask("")  # says what has become of the line


class _Screen:
    """What is on the screen: whole lines, and the one that is open. Shown from another thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._open = ""
        #: What stands before the line that is being edited; None while there is none.
        self._prompt: str | None = None

    def show(self, text: str) -> None:
        """Print what has come, above the line that is being edited if one is."""
        with self._lock:
            *whole, self._open = (self._open + text).split("\n")
            if not whole:
                return
            if self._prompt is not None:
                # A prompt stands before the line that is edited; what comes ends with one as well,
                # which is a whole line once more has come behind it.
                bare = {"", PROMPT, self._prompt.strip()}
                whole = [line for line in whole if line.strip() not in bare]
                sys.stdout.write("".join(map(_above, whole)))
            else:
                sys.stdout.write("".join(f"{line}\n" for line in whole))
            sys.stdout.flush()

    @contextmanager
    def edited(self) -> Iterator[str]:
        """While a line is edited behind the prompt that this gives."""
        with self._lock:
            self._prompt = prompt = self._open
            self._open = ""
        try:
            yield prompt
        finally:
            with self._lock:
                # What has come meanwhile ends with a prompt again, which the answer follows.
                self._open = ""
                self._prompt = None

    def end(self) -> None:
        """Leave the open line."""
        with self._lock:
            sys.stdout.write("\n")
            sys.stdout.flush()


def _above(line: str) -> str:
    """What puts a line above the one that the cursor is in, and the cursor back where it was.

    Room is made below first (IND, and up again), so that the line inserted pushes nothing off the
    screen; then the old line is one further down.
    """
    if os.environ.get("TERM") == "dumb":
        return f"\n{line}\n"
    return f"\x1bD\x1b[A\x1b7\r\x1b[L{line}\x1b8\x1b[B"


def _history_file() -> Path | None:
    """Where lines are kept for the next time; None for a user without a home."""
    try:
        return user_state_path("sacbus") / "terminal-history"
    except RuntimeError:
        return None


@contextmanager
def _history(file: Path | None) -> Iterator[None]:
    """Lines that were typed before can be fetched back, and are kept if there is a file."""
    if not _HERE or file is None:
        yield
        return
    # A history that cannot be kept is no reason to have no terminal.
    with contextlib.suppress(OSError):
        readline.read_history_file(file)
    try:
        yield
    finally:
        readline.set_history_length(HISTORY_LINES)
        with contextlib.suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            readline.write_history_file(file)
