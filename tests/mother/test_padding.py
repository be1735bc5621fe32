"""Bodies whose CRC is 00, 02 or 03: all there are of some kinds, as mother sends them and raw.

The receiver is the device's (``sacbus.wire.DeviceReceiver``); what is short goes through a bus with
a real node as well. Source: spec, wire ("Bodies that a device loses or accepts unchecked").
"""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.mother import Acknowledged, safe_body
from sacbus.wire import MOTHER, DeviceReceiver, Packet, Verdict, crc8, encode
from tests.language.strategies import nearly_commands
from tests.mother.rig import Rig

UNSAFE = (0x00, 0x02, 0x03)
PRINTABLE = bytes(range(0x20, 0x7F))

#: All bodies of one and two printable characters.
SHORT = [bytes(body) for size in (1, 2) for body in product(PRINTABLE, repeat=size)]

#: Motions and edits, as programs say them.
COMMANDS = [
    *(b"m%d" % steps for steps in range(20_000)),
    *(b"m-%dv%d" % (steps, rpm) for steps in range(100, 200) for rpm in range(60, 160)),
    *(
        b"q%dm%dv%da%dd%ds1" % (position, steps, 120, acc, acc)
        for position in range(1, 31)
        for steps in range(400, 480)
        for acc in (2, 5, 10)
    ),
]

VECTORS = [
    bytes.fromhex(json.loads(line).get("rx_hex", ""))
    for line in (Path(__file__).parent.parent / "data/wire-vectors.jsonl").read_text().splitlines()
]
#: The bodies of all whole packets that the firmware was given.
RECORDED = [
    packet[3:-3] for packet in VECTORS if packet[:1] == b"\x02" and packet[-3:-2] == b"\x03"
]


def unsafe(bodies: list[bytes]) -> list[bytes]:
    return [body for body in bodies if body and crc8(body) in UNSAFE]


def heard(packet: bytes) -> Packet | None:
    """What the device at address 10 makes of these bytes."""
    found = DeviceReceiver(10).receive(packet)
    if found is None:
        return None
    event, _ = found
    assert isinstance(event, Packet)
    return event


def damaged(packet: bytes) -> bytes:
    """One bit of the body's first character is another."""
    return packet[:3] + bytes((packet[3] ^ 0x01,)) + packet[4:]


def prove(body: bytes) -> None:
    """Mother's packet arrives checked; the same without her padding is lost, or not checked."""
    crc = crc8(body)
    assert crc in UNSAFE
    sent = encode(10, MOTHER, safe_body(body))
    assert heard(sent) == Packet(10, MOTHER, body + b" ", Verdict.RIGHT)
    spoilt = heard(damaged(sent))
    assert spoilt is not None
    assert spoilt.verdict is Verdict.WRONG
    raw = encode(10, MOTHER, body)
    if crc == 0x02:
        assert heard(raw) is None
    else:
        assert heard(raw) == Packet(10, MOTHER, body, Verdict.UNCHECKED)
        anything = heard(damaged(raw))
        assert anything is not None
        assert anything.verdict is Verdict.UNCHECKED
        assert anything.body != body


@pytest.mark.parametrize(
    ("bodies", "count"),
    [(SHORT, 95 + 95 * 95), (COMMANDS, 37_200), (RECORDED, None)],
    ids=["short", "commands", "recorded"],
)
def test_every_body_of_these_arrives_checked_from_mother_and_not_when_sent_raw(
    bodies: list[bytes], count: int | None
) -> None:
    found = unsafe(bodies)
    assert count in (None, len(set(bodies)))
    if count is not None:
        # Three packets in 256.
        assert 0.8 < len(found) / (count * 3 / 256) < 1.2
        assert {crc8(body) for body in found} == set(UNSAFE)
    assert found
    for body in found:
        prove(body)


@given(nearly_commands, st.sampled_from(UNSAFE))
def test_every_command_line_of_such_a_crc_arrives_checked(line: str, crc: int) -> None:
    text = bytes(byte for byte in line.encode("latin-1") if byte in PRINTABLE)[:40]
    # Of 256 characters behind it, one gives each CRC.
    body = next(
        (
            text + b"u" + bytes((last, other))
            for last in PRINTABLE
            for other in PRINTABLE
            if crc8(text + b"u" + bytes((last, other))) == crc
        ),
    )
    prove(body)


@pytest.mark.slow
def test_on_a_bus_every_short_one_is_acknowledged_and_refused_when_it_was_damaged() -> None:
    for body in unsafe(SHORT):
        mothers = Rig(10)
        outcome = mothers.ask(10, body)
        assert isinstance(outcome, Acknowledged), body
        assert outcome.attempts == 1, body
        spoilt = Rig(10)
        spoilt.port.talk(damaged(mothers.sent[0]))
        spoilt.kernel.run()
        assert spoilt.answers == [b"\x02\x01\x0a\x15"], body
        raw = Rig(10)
        raw.port.talk(encode(10, MOTHER, body))
        raw.kernel.run_until(30_000_000)
        assert raw.answers[:1] == ([] if crc8(body) == 2 else [b"\x02\x01\x0a\x06"]), body
