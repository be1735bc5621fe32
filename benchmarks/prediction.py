"""What bit errors should do to packets, worked out: the other half of ``benchmarks.protection``.

Owns the formulas, for data bits that are inverted independently with probability ``p``, and the
bound within which chance keeps a count. docs/protection.md derives them in words.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache
from math import exp

from sacbus.wire import ACK, ETX, GENERAL_CALL, MOTHER, NUL, STX, crc8
from sacbus.wire.times import ANSWER_BYTES

__all__ = ["Predicted", "bound", "turns", "undetected"]


def turns(sent: int, into: int, p: float) -> float:
    """The probability that a byte arrives as one other, or as itself."""
    wrong = (sent ^ into).bit_count()
    return p**wrong * (1 - p) ** (8 - wrong)


@lru_cache
def undetected(size: int, p: float) -> float:
    """The probability that a body of ``size`` bytes and its CRC are damaged and agree all the same.

    A damage is undetected when it is a code word itself. By MacWilliams the probability follows
    from the weights of the 256 words of the dual code: word j has a one where bit i of body and CRC
    changes the parity of those bits of the check that j selects.
    """
    bits = 8 * (size + 1)
    checks = [crc8((1 << place).to_bytes(size, "little")) for place in range(8 * size)]
    checks += [1 << place for place in range(8)]
    words = 0.0
    for word in range(256):
        weight = sum((check & word).bit_count() & 1 for check in checks)
        words += (1 - 2 * p) ** weight
    return words / 256 - float((1 - p) ** bits)


class Predicted:
    """How often each thing should happen to packets of mother's to ``nodes``, one after another.

    ``packets`` counts the distinct ones that were sent, as (destination, body).
    """

    def __init__(self, packets: Counter[tuple[int, bytes]], nodes: Sequence[int], p: float) -> None:
        self._p = p
        self._nodes = frozenset(nodes)
        self.packets = packets.total()
        #: Executed by its node as sent, with the CRC checked.
        self.as_sent = 0.0
        #: Of these, those of which mother never learns.
        self.unknown = 0.0
        #: Executed by another node, and by everybody, each time counted once.
        self.other_node = 0.0
        self.everybody = 0.0
        #: Another line than was sent, with a CRC that is right for it.
        self.undetected = 0.0
        #: The verdict byte became 00, or 03 (then the NUL behind it is taken for the verdict), and
        #: the line is that which was sent, or another.
        self.unchecked = 0.0
        self.unchecked_wrong = 0.0
        for (node, body), count in packets.items():
            self._add(node, body, count)

    def _add(self, node: int, body: bytes, count: int) -> None:
        p = self._p
        whole = 1 - p
        #: STX and ETX arrive, and the source is neither STX nor ETX.
        framing = whole**16 * (1 - turns(MOTHER, STX, p) - turns(MOTHER, ETX, p))
        text = whole ** (8 * len(body))
        right = framing * text * whole**8
        there = whole**8
        self.as_sent += count * right * there
        answered = whole**16 * text * whole**8 * there * whole**8 * whole ** (8 * ANSWER_BYTES)
        self.unknown += count * (right * there - answered)
        elsewhere = sum(turns(node, other, p) for other in self._nodes if other != node)
        self.other_node += count * right * elsewhere
        self.everybody += count * right * turns(node, GENERAL_CALL, p)
        self.undetected += count * framing * there * undetected(len(body), p)
        verdict = crc8(body)
        blind = turns(verdict, NUL, p) + turns(verdict, ETX, p) * whole**8
        self.unchecked += count * framing * there * text * blind
        damaged = 1.0
        for byte in body:
            # Bytes that would end the packet, or begin another.
            damaged *= 1 - sum(turns(byte, end, p) for end in (STX, ETX, ACK))
        self.unchecked_wrong += count * framing * there * (damaged - text) * blind
        # Or ETX became a character of the body, and the verdict byte, as 03, stands for it.
        longer = 1 - sum(turns(ETX, end, p) for end in (STX, ETX, ACK))
        late = longer / whole**8 * turns(verdict, ETX, p) * whole**8
        self.unchecked_wrong += count * framing * there * damaged * late


def bound(expected: float, chance: float = 1e-3) -> tuple[int, int]:
    """Between which counts a count stays that should be ``expected``, by Poisson.

    Below the first and above the second it is with a probability of at most ``chance`` each.
    """
    if expected > 500:
        spread = 3.1 * expected**0.5  # of a normal distribution, 1e-3 on either side
        return int(expected - spread), int(expected + spread) + 1
    low, high, count = 0, 0, 0
    term, below = exp(-expected), 0.0
    while below + term < 1 - chance:
        below += term
        count += 1
        if below <= chance:
            low = count
        term *= expected / count
    high = count
    return low, high
