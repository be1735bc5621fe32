"""How long a SAC takes: the device's own figures between bytes.

Owns the turnaround and the deaf time of a SAC at 38 400 baud, as functions of the body's length,
and mother's gap. They were measured on the published packet firmware (P2P485 1.0) in simulation;
between the lengths measured we take straight lines. No clock here, only figures, all in ns.
Decisions: docs, "Where the manual is silent".
"""

from __future__ import annotations

from typing import Final

__all__ = [
    "ANSWER_BYTES",
    "ENABLE_LEAD_UNCHECKED",
    "MOTHER_GAP",
    "deaf_time",
    "enable_lead",
    "turnaround",
]

#: An ACK or NAK: STX, destination, source, 06 or 15.
ANSWER_BYTES: Final = 4

#: What mother leaves free after every ACK and broadcast, so that no node is still deaf.
MOTHER_GAP: Final = 1_000_000

#: From the end of the NUL that follows the trigger byte to the answer's first bit, for a body of
#: up to 5 characters; a further character costs 13 µs more (its share of the CRC).
_AFTER_NUL: Final = 385_000
#: The same from the trigger byte, when nothing follows it.
_AFTER_TRIGGER: Final = 406_000
_A_CHARACTER: Final = 13_000
_MEASURED_WITH: Final = 5

#: After the answer (5 characters) and after a broadcast; 39 characters take 0.25 ms more.
_DEAF_AFTER_ANSWER: Final = 310_000
_DEAF_AFTER_BROADCAST: Final = 370_000

#: How long before the first bit of an answer the driver is enabled: to a packet without CRC; to one
#: with a CRC of 5 characters, and of 46 (measured).
ENABLE_LEAD_UNCHECKED: Final = 287_000
_ENABLE_LEAD: Final = 330_000
_ENABLE_LEAD_OF_46: Final = 650_000


def enable_lead(body: int) -> int:
    """Ns from the enabling of the driver to the answer to a packet of ``body`` characters."""
    slope = _ENABLE_LEAD_OF_46 - _ENABLE_LEAD
    return _ENABLE_LEAD + max(0, body - _MEASURED_WITH) * slope // (46 - _MEASURED_WITH)


def turnaround(body: int, *, nul_follows: bool) -> int:
    """Ns of silence before the answer to a packet with ``body`` characters.

    Counted from the end of the NUL when one follows the trigger byte (the one after ETX) at once,
    otherwise from the end of the trigger byte.
    """
    base = _AFTER_NUL if nul_follows else _AFTER_TRIGGER
    return base + _A_CHARACTER * max(0, body - _MEASURED_WITH)


def deaf_time(body: int, *, answered: bool) -> int:
    """Ns for which a node loses what arrives, after the end of its answer, or of a broadcast.

    It was deaf from the trigger byte on as well. 0.31 ms for 5 characters and 0.56 ms for 39 after
    an answer; 0.37 ms after a broadcast, for which we take the same slope.
    """
    base = _DEAF_AFTER_ANSWER if answered else _DEAF_AFTER_BROADCAST
    return base + max(0, body - _MEASURED_WITH) * 250_000 // 34
