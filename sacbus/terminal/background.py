"""A dialog that goes on while a person's, or another program's, next line is waited for.

Owns the thread that the event loop of a dialog runs in. A terminal's keyboard is read by calls that
block, readline's above all, so they have the main thread, where Ctrl-C ends them.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from types import TracebackType
from typing import Any, Self, TypeVar

from sacbus.links import open_line
from sacbus.terminal.dialog import Dialog

__all__ = ["Background"]

_T = TypeVar("_T")


class Background:
    """An open line and the dialog on it, for a ``with`` block. LinkError when it cannot be had.

    ``show`` and ``lose`` are as the dialog's, called in its thread.
    """

    def __init__(
        self,
        link: str,
        baud: int,
        show: Callable[[str], object] = lambda _: None,
        lose: Callable[[], object] = lambda: None,
    ) -> None:
        self._link = link
        self._baud = baud
        self._show = show
        self._lose = lose
        self._opened: Future[tuple[asyncio.AbstractEventLoop, asyncio.Event, Dialog]] = Future()
        self._thread = threading.Thread(target=self._run, name="sacbus terminal", daemon=True)

    def begin(self) -> str:
        """As :meth:`Dialog.begin`."""
        return self._call(lambda dialog: dialog.begin())

    def ask(self, line: str) -> str:
        """As :meth:`Dialog.ask`."""
        return self._call(lambda dialog: dialog.ask(line))

    def _call(self, ask: Callable[[Dialog], Coroutine[Any, Any, _T]]) -> _T:
        loop, _, dialog = self._opened.result()
        return asyncio.run_coroutine_threadsafe(ask(dialog), loop).result()

    def __enter__(self) -> Self:
        self._thread.start()
        try:
            self._opened.result()
        except Exception:
            self._thread.join()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        fault: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        loop, end, _ = self._opened.result()
        loop.call_soon_threadsafe(end.set)
        self._thread.join()

    def _run(self) -> None:
        asyncio.run(self._keep_open())

    async def _keep_open(self) -> None:
        end = asyncio.Event()
        try:
            async with open_line(self._link, self._baud) as line:
                dialog = Dialog(line, self._link, self._show, self._lose)
                self._opened.set_result((asyncio.get_running_loop(), end, dialog))
                await end.wait()
        except Exception as fault:
            if self._opened.done():
                raise
            self._opened.set_exception(fault)
