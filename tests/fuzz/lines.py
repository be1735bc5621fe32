"""Lines for the fuzz: good ones, spoilt ones, and bytes that never were one.

Owns what is drawn. All of it comes from the generator that it is given, so one seed gives the same
lines on every machine. Drawn in batches of words, since ten million of them are.
"""

from __future__ import annotations

from random import Random
from typing import Final

from sacbus.language import Parameter

__all__ = ["Lines"]

#: Values at which something changes in the language, or overflows.
_EDGES: Final = (
    *("", "0", "1", "2", "7", "8", "30", "31", "99", "100", "255", "256", "999", "1000", "1200"),
    *("65535", "65536", "4294967295", "4294967296", "00012", "99999999999999"),
)
_DECIMALS: Final = ("", "0", ".", ".5", "1.25", "7.", "10.47", "99.999", "100.9", "999", "1000")

_MOVES: Final = ("m", "m", "m", "m-", "M", "M-", "xm", "XM-")
_LONE: Final = (
    *("S", "s", "N", "n", "y", "+", "-", "++-", "v", "a", "D", "vd", "m", "xm", "m-", "l", "L"),
    *("q", "Q", "qp", "qs", "qr", "qc", "ln", "la", "x", "X", "xp", "xd", "xl", "g", "G", "b"),
    *("cc", "cf", "z", "Z", "/", "$C", "$E", "$F", "$P", "$U", "$H", "$K", "$n", "$R", ""),
    *("\x11", "\x12", " ", ".", "\xff", "\x00", "85 hello", "/ there", "m200 and more"),
)
_NUMBERED: Final = (
    *("v", "V", "vc", "a", "d", "ls", "LS", "lf", "lf", "ln", "l", "x", "xp0,", "xp1,", "xp2,"),
    *("/m", "85m", "0m", "7.", "$L", "$O", "$H", "$K", "$CU2", "$CU", "$x"),
    *("$C" + parameter.letter for parameter in Parameter),
    *(parameter.letter for parameter in Parameter),
)
_EDITS: Final = tuple(f"q{position}" for position in (*range(1, 31), 0, 31))
_NUMBERS: Final = (*(str(number) for number in range(100)), *_EDGES, *_DECIMALS)
_QUALIFIERS: Final = (
    *("v300", "v60", "v1200", "vc900", "a", "d", "a5", "d5", "a.5", "d999", "a999", "l1", "l0"),
    *(letter + number for letter in ("v", "V", "vc", "t", "u") for number in _NUMBERS[::3]),
    *(letter + number for letter in "ADad" for number in (*_DECIMALS, *_NUMBERS[::9])),
    *("s", "S0", "s1", "f", "p", "P", "u7", "t500"),
)
#: What does not belong there, but might.
_STRAY: Final = (*_QUALIFIERS, *_NUMBERS, *_LONE, *_MOVES, ",", "L", "$C", " rest")
#: What bytes are put into a line that is spoilt.
_SPOILS: Final = bytes(range(256)) + b"\x02\x03\x00\x06\x15\r\n\x08\x7f$qmx-+., " * 8

_BATCH: Final = 1_024


class Lines:
    """An endless supply of them."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._drawn: list[bytes] = []

    def next(self) -> bytes:
        """A line, without its end; up to some 60 bytes, which is more than either port takes."""
        if not self._drawn:
            self._draw()
        return self._drawn.pop()

    def _draw(self) -> None:
        rng = self._rng
        words = iter(rng.choices(_QUALIFIERS, k=_BATCH * 4))
        numbers = iter(rng.choices(_NUMBERS, k=_BATCH))
        for sort in rng.choices(range(40), k=_BATCH):
            number, count = next(numbers), sort & 3
            if sort < 18:
                steps = int(rng.random() * 400)
                text = f"{_pick(rng, _MOVES)}{steps}" + "".join([next(words) for _ in range(count)])
            elif sort < 24:
                text = _pick(rng, _LONE)
            elif sort < 30:
                text = _pick(rng, _NUMBERED) + number
            elif sort < 34:
                text = f"{_pick(rng, _EDITS)}m{number}" + "".join([next(words)] * count)
            elif sort < 38:
                text = "".join(rng.choices(_STRAY, k=1 + count))
            else:
                text = ""
            line = text.encode("latin-1")
            if sort == 39:
                line = rng.randbytes(int(rng.random() ** 3 * 60))
            elif sort in (17, 23, 29, 33, 37):
                line = self._spoilt(line)
            self._drawn.append(line)

    def _spoilt(self, line: bytes) -> bytes:
        """With some bytes of it changed, put in or left out."""
        rng, spoilt = self._rng, bytearray(line)
        for _ in range(1 + int(rng.random() * 3)):
            at = int(rng.random() * (len(spoilt) + 1))
            kept = at + int(rng.random() * 2)
            spoilt[at:kept] = rng.choices(_SPOILS, k=int(rng.random() * 3))
        return bytes(spoilt)


def _pick(rng: Random, words: tuple[str, ...]) -> str:
    """One of them, quicker than ``choice``."""
    return words[int(rng.random() * len(words))]
