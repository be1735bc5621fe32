"""How fast the wire is: packets per second through both receivers, and encoding.

The baseline is a plain loop over the same bytes. All packets have 20 bytes (a body of 14). The
goals are stated for CPython 3.11 with crcmod's C extension.
"""

from __future__ import annotations

import random
from collections.abc import Callable

from benchmarks.figure import Figure, alternate
from sacbus.wire import DeviceReceiver, PacketReceiver, ack, crc8, encode

PACKETS = 20_000
OWN = 82


def body(rng: random.Random) -> bytes:
    """14 bytes of a motion command that mother could send as they are, as most are."""
    while True:
        text = b"m%05dv%03da%d" % (rng.randrange(100_000), rng.randrange(1000), rng.randrange(100))
        text = text[:14].ljust(14)
        if crc8(text) not in (0, 2, 3):  # the others she pads
            return text


def any_body(rng: random.Random) -> bytes:
    return bytes(rng.choices(b"msv0123456789ad ", k=14))


def stream(dest: Callable[[int], int], make: Callable[[random.Random], bytes] = body) -> bytes:
    rng = random.Random(1)
    return b"".join(encode(dest(k), 1, make(rng)) for k in range(PACKETS))


def plain_byte_loop(data: bytes) -> int:
    packets = 0
    for byte in data:
        if byte == 0:
            packets += 1
    return packets


def robust(data: bytes) -> int:
    return len(PacketReceiver().receive(data))


def robust_in_chunks(data: bytes) -> int:
    receiver = PacketReceiver()
    return sum(len(receiver.receive(data[at : at + 4096])) for at in range(0, len(data), 4096))


def device(data: bytes) -> int:
    receive = DeviceReceiver(OWN).receive
    events = at = 0
    while (found := receive(data, at)) is not None:
        at = found[1]
        events += 1
    return events


def device_a_packet_a_call(packets: list[bytes]) -> int:
    receive = DeviceReceiver(OWN).receive
    return sum(receive(packet) is not None for packet in packets)


def figures(rounds: int) -> list[Figure]:
    """All figures of the wire."""
    own = stream(lambda _: OWN)
    one_in_ten = stream(lambda k: OWN if k % 10 == 0 else 10 + k % 70)
    rng = random.Random(2)
    bodies = [body(rng) for _ in range(PACKETS)]
    packets = [encode(OWN, 1, text) for text in bodies]
    answered = b"".join(packet + ack(1, OWN) for packet in packets)
    unchecked = b"".join(encode(OWN, 1, text, crc=False) for text in bodies)
    any_crc = stream(lambda _: OWN, any_body)
    damaged = b"".join(
        packet if k % 100 else packet[:7] + b"\xff" + packet[8:] for k, packet in enumerate(packets)
    )
    acts: list[tuple[str, Callable[[], int], int, float | None]] = [
        ("robust, in chunks of 4096 bytes", lambda: robust_in_chunks(own), PACKETS, 1e6),
        ("robust, 400 kB in one call", lambda: robust(own), PACKETS, 1e6),
        ("robust, pairs of packet and ACK", lambda: robust(answered), 2 * PACKETS, None),
        ("robust, without CRC", lambda: robust(unchecked), PACKETS, None),
        ("robust, CRC of any value", lambda: robust(any_crc), PACKETS, None),
        ("robust, 1 in 100 damaged", lambda: robust(damaged), PACKETS, None),
        ("device, all its own", lambda: device(own), PACKETS, 0.5e6),
        ("device, 1 in 10 its own", lambda: device(one_in_ten), PACKETS // 10, 0.5e6),
        ("device, a call a packet", lambda: device_a_packet_a_call(packets), PACKETS, None),
        ("encode", lambda: sum(encode(OWN, 1, text)[0] == 2 for text in bodies), PACKETS, None),
    ]
    found = []
    for name, act, expected, goal in acts:
        done = act()
        assert done == expected, f"{name}: {done} events, expected {expected}"
        took, baseline = alternate(act, lambda: plain_byte_loop(own), rounds)
        found.append(
            Figure(
                name,
                PACKETS / took,
                "packets/s",
                baseline / took,
                "a byte loop",
                goal,
                "value, at least" if goal else "",
            )
        )
    return found
