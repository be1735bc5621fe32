"""The signals that end a process which serves or looks on until somebody ends it.

Owns which these are, and the exit status after each. A leaf beside the command line.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Callable
from typing import Final

__all__ = ["heed_signals"]

#: Statuses after Ctrl-C and after the terminal was closed, as a shell expects them (128 and the
#: signal's number).
INTERRUPTED: Final = 130
HUNG_UP: Final = 129


def heed_signals(end: Callable[[int], object]) -> None:
    """Have ``end`` called in the running loop, with the exit status, for each signal that comes.

    SIGINT is 130, SIGTERM 0, and SIGHUP, the closed terminal, 129, unless it was ignored before.
    """
    loop = asyncio.get_running_loop()
    # Windows has no such handlers; there asyncio.run ends the task on Ctrl-C.
    with contextlib.suppress(NotImplementedError):
        loop.add_signal_handler(signal.SIGINT, end, INTERRUPTED)
        loop.add_signal_handler(signal.SIGTERM, end, 0)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup leaves it
            loop.add_signal_handler(signal.SIGHUP, end, HUNG_UP)
