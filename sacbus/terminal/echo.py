"""What a terminal port gives back of the keys it gets, taken out of what it shows.

Owns telling the echo of a line from what is said upon it. Synchronous; bytes in, bytes out.
"""

from __future__ import annotations

from typing import Final

__all__ = ["LineEcho"]

#: What a port may make of the CR that ends a line.
_ENDS: Final = (b"\r\n", b"\n\r", b"\r", b"\n")

#: What a SAC says of a line that is too long for it; it has echoed only as much as it took.
_TOO_LONG: Final = b"2big."


class LineEcho:
    """The echo of one line and its end, which is the first that comes after it was sent.

    A port that does not echo loses nothing: what does not fit goes through as it is.
    """

    def __init__(self, line: bytes) -> None:
        self._line = line
        self._held = b""
        #: Whether it is decided what was echo; the rest goes through.
        self.over = False

    def strip(self, data: bytes) -> bytes:
        """These bytes without what is echo; some are kept until more tell what they are."""
        if self.over:
            return data
        self._held += data
        held, line = self._held, self._line
        if line.startswith(held) and held != line:
            return b""
        if not held.startswith(line):
            return self._cut_short(held)
        rest = held[len(line) :]
        for end in _ENDS:
            if rest.startswith(end) and (len(end) == 2 or len(rest) > 1):
                return self._decide(rest[len(end) :])
        if len(rest) > 1:
            return self._decide(rest)
        return b""

    def _cut_short(self, held: bytes) -> bytes:
        """Take out the beginning of a line that is refused; else what has come is no echo."""
        echoed = 0
        while self._line.startswith(held[: echoed + 1]):  # as all of it would not
            echoed += 1
        rest = held[echoed:]
        for end in _ENDS if echoed else ():
            refusal = end + _TOO_LONG
            if rest.startswith(refusal):
                return self._decide(rest[len(end) :])
            if refusal.startswith(rest):
                return b""
        return self._decide(held)

    def settle(self) -> bytes:
        """No more comes: what was kept and is no echo."""
        held = self._held
        self.over, self._held = True, b""
        return held[len(self._line) :].strip(b"\r\n") if held.startswith(self._line) else held

    def _decide(self, rest: bytes) -> bytes:
        self.over, self._held = True, b""
        return rest
