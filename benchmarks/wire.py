"""How fast the wire is: packets per second through both receivers, and encoding.

    python benchmarks/wire.py [--json] [--rounds N]

Every figure is the median of several rounds and stands beside a baseline of the same run, a plain
loop over the same bytes, since machines differ: the ratio travels, the figure does not. All packets
have 20 bytes (a body of 14). The goals are stated for CPython 3.11 with crcmod's C extension.
"""

from __future__ import annotations

import argparse
import json
import platform
import random
import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

from sacbus.wire import CRC_IS_FAST, DeviceReceiver, PacketReceiver, ack, crc8, encode

PACKETS = 20_000
OWN = 82


@dataclass(frozen=True, slots=True)
class Figure:
    """One measurement: packets per second, and how many times as fast as the baseline."""

    name: str
    per_second: float
    ratio: float
    goal_per_second: float | None = None


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


def seconds(act: Callable[[], int], expected: int) -> float:
    began = time.perf_counter()
    done = act()
    took = time.perf_counter() - began
    assert done == expected, f"{done} events, expected {expected}"
    return took


def measure(rounds: int) -> list[Figure]:
    """All figures; baseline and measurement alternate, so that both meet the same weather."""
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
    nuls = plain_byte_loop(own)
    acts: list[tuple[str, Callable[[], int], int, float | None]] = [
        ("robust", lambda: robust(own), PACKETS, 1e6),
        ("robust, in chunks of 4096 bytes", lambda: robust_in_chunks(own), PACKETS, 1e6),
        ("robust, pairs of packet and ACK", lambda: robust(answered), 2 * PACKETS, None),
        ("robust, without CRC", lambda: robust(unchecked), PACKETS, None),
        ("robust, CRC of any value", lambda: robust(any_crc), PACKETS, None),
        ("robust, 1 in 100 damaged", lambda: robust(damaged), PACKETS, None),
        ("device, all its own", lambda: device(own), PACKETS, 0.5e6),
        ("device, 1 in 10 its own", lambda: device(one_in_ten), PACKETS // 10, 0.5e6),
        ("device, a call a packet", lambda: device_a_packet_a_call(packets), PACKETS, None),
        ("encode", lambda: sum(encode(OWN, 1, text)[0] == 2 for text in bodies), PACKETS, None),
    ]
    figures = []
    for name, act, expected, goal in acts:
        took, baseline = [], []
        for _ in range(rounds):
            baseline.append(seconds(lambda: plain_byte_loop(own), nuls))
            took.append(seconds(act, expected))
        median = statistics.median(took)
        ratio = statistics.median(baseline) / median
        figures.append(Figure(name, PACKETS / median, ratio, goal))
    return figures


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Packets per second through sacbus.wire.")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--rounds", type=int, default=15, help="rounds a median is taken of")
    options = parser.parse_args(argv)
    figures = measure(options.rounds)
    if options.json:
        about = {"python": platform.python_version(), "crc_is_fast": CRC_IS_FAST}
        print(json.dumps({"benchmark": "wire", **about, "figures": [asdict(f) for f in figures]}))
        return 0
    print(f"20-byte packets, CPython {platform.python_version()}, crcmod in C: {CRC_IS_FAST}")
    for figure in figures:
        goal = f"  goal {figure.goal_per_second / 1e6:.1f}" if figure.goal_per_second else ""
        print(
            f"{figure.name:<34}{figure.per_second / 1e6:6.2f} M/s"
            f"{figure.ratio:7.2f} x a byte loop{goal}"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
