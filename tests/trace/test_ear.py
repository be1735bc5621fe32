"""Who listens to what was recorded begins anew where a device would have."""

from __future__ import annotations

from nodes.sac import KIND as SAC
from nodes.superstepper import KIND
from sacbus.kernel import MS, LineRate, Ns
from sacbus.trace.ear import Ear
from sacbus.trace.records import Sent
from sacbus.wire import encode as packet
from sacbus.wire.superstepper import Answer, Read, encode, encode_answer
from sacbus.wire.superstepper_receivers import Acknowledged, Told

RATE = LineRate(9_600)
READ = encode(3, Read(6))


def sent(data: bytes, start: Ns, lane: int = 0, ninth: bytes | None = None) -> Sent:
    end = start + RATE.span(len(data))
    return Sent(end, 0, start, end, lane, "mother", data, data, ninth=ninth)


def told(ear: Ear, one: Sent) -> list[str]:
    return [ear.protocol.tell(event).words for event, _, _ in ear.hear(one)]


def test_what_a_device_has_given_up_is_not_waited_for() -> None:
    ear = Ear(KIND.protocol, RATE)
    assert told(ear, sent(READ[:2], 0)) == []
    # Within the time-out the rest completes it; the message behind it is whole.
    assert told(ear, sent(READ[2:] + READ, 8 * MS)) == ["read the byte at RAM 0x06"] * 2
    assert told(ear, sent(READ[:2], 50 * MS)) == []
    assert told(ear, sent(READ, 100 * MS)) == ["read the byte at RAM 0x06"]


def test_each_lane_is_heard_for_itself_with_its_ninth_bits() -> None:
    ear = Ear(KIND.protocols[1], LineRate(9_600, 11))
    (event,) = (one for one, _, _ in ear.hear(sent(READ[:2] + READ, 0, 0, b"\1\0\1\0\0"))[1:])
    assert isinstance(event, Told)
    ((answer, first, last),) = ear.hear(sent(encode_answer(Answer(3)), MS, 1))
    assert (answer, first, last) == (Acknowledged(Answer(3)), 0, 5)


def test_a_sac_waits_for_ever() -> None:
    ear = Ear(SAC.protocol, LineRate())
    data = packet(10, 1, b"m400")
    assert told(ear, sent(data[:5], 0)) == []
    assert told(ear, sent(data[5:], 60_000 * MS)) == ["move 400 full steps"]
