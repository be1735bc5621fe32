"""The entry point, as ``sacbus`` and as ``python -m sacbus``.

Owns what becomes of Ctrl-C where no command can heed it: while one is being loaded, and after its
end.
"""

from __future__ import annotations

import os
import signal
import sys

TYPE_CHECKING = False  # without `typing`: until `main` runs, Ctrl-C is a traceback
if TYPE_CHECKING:
    from typing import Final, NoReturn

__all__ = ["main"]

#: Exit status after Ctrl-C (spec, cli).
_INTERRUPTED: Final = 130


def main(*, interrupted: int = _INTERRUPTED) -> NoReturn:
    """Run the command that the arguments name, and exit with its status.

    ``interrupted`` is the status after Ctrl-C, for whom that is a good end: make would call any
    other than 0 an error.
    """
    heeded = signal.getsignal(signal.SIGINT)
    _end_at_once(interrupted, heeded)
    try:
        from sacbus.cli import run  # noqa: PLC0415 (it loads what takes a tenth of a second)

        signal.signal(signal.SIGINT, heeded)
        status = run(sys.argv[1:])
    except KeyboardInterrupt:  # once more, while the first was being told of
        status = _INTERRUPTED
    if status == _INTERRUPTED:
        status = interrupted
    _end_at_once(status, heeded)
    sys.exit(status)


def _end_at_once(status: int, heeded: object) -> None:
    """Have Ctrl-C end the process here and now: nothing is open that would have to be closed.

    The exception would come as a traceback out of whatever is being imported or taken down. Where
    Ctrl-C is ignored, as by what a shell starts in the background, it stays so.
    """
    if heeded is signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda _number, _frame: os._exit(status))


if __name__ == "__main__":
    main()
