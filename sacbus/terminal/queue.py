"""A SAC's queue as its terminal shows it.

Owns asking for it, and what is wrong with an answer that is no whole queue. What a screen looks
like is ``sacbus.language``'s business.
"""

from __future__ import annotations

from sacbus.language import QUEUE_LENGTH
from sacbus.language.queue_screen import QueueScreen, WrongScreen
from sacbus.links import LinkError, open_line
from sacbus.terminal.dialog import Dialog

__all__ = ["read_queue"]

_AGAIN = "check that it is a SAC's terminal, and the baud rate, and try again"


async def read_queue(link: str, baud: int) -> QueueScreen:
    """The queue: its positions from 1 on in order, without those that debug mode adds.

    LinkError says in one line what has come instead, NoAnswer that nothing has, ConnectionError
    that the line is gone.
    """
    async with open_line(link, baud) as line:
        dialog = Dialog(line, link)
        await dialog.begin()
        shown = await dialog.ask("q")
        screen = _read(shown, link)
        if screen is None:
            # Whoever was here before may have left it in a program mode, which X leaves; at the
            # prompt an X alone does nothing.
            await dialog.ask("x")
            shown = await dialog.ask("q")
            screen = _read(shown, link)
    if screen is None:
        last = (shown.split("\n") or [""])[-1]
        what = f"no queue screen upon q, expected its last line 'Q is at …', got {last[:60]!r}"
        raise LinkError(what, link, _AGAIN)
    rows = tuple(row for row in screen.rows if 1 <= row.position <= QUEUE_LENGTH)
    positions = [row.position for row in rows]
    if not rows or positions != list(range(1, len(rows) + 1)):
        what = f"lines of the queue screen are missing, expected positions from 1, got {positions}"
        raise LinkError(what, link, _AGAIN)
    return QueueScreen(rows, screen.next_free)


def _read(shown: str, link: str) -> QueueScreen | None:
    try:
        return QueueScreen.read(shown)
    except WrongScreen as fault:
        what = f"this is no row of a queue screen, got {fault.got[:100]!r}"
        raise LinkError(what, f"{link}, line {fault.line} of the answer to q", _AGAIN) from fault
