"""The recorded exchanges of the packet firmware, replayed to a node on a bus.

Those marked `overlaps` were recorded on two separate wires (the device answered while the sender
was still talking), and are replayed on two lanes; all others on one.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from nodes.sac import SacSettings
from sacbus.kernel import US, LineRate, Ns
from sacbus.wire import GENERAL_CALL, STX
from tests.nodes.sac.bench import EVEN, NODE, Bench

Vector = dict[str, Any]  # parsed JSON: its values are of any type
Pieces = list[tuple[Ns, bytes]]
"""What is sent, in pieces, each with the pause before it."""

_FILE = Path(__file__).parents[2] / "data" / "wire-vectors.jsonl"
#: What was typed at the device's terminal is not for its network port.
VECTORS: list[Vector] = [
    vector
    for vector in map(json.loads, _FILE.read_text(encoding="utf-8").splitlines())
    if "rx_hex" in vector
]

#: ACK, NAK, ETX, NUL and the device's own address, but no STX: nothing of this opens a receiver.
NOISE = bytes.fromhex("4180ff0031 5201 03 00 15 06")


def pieces_of(vector: Vector) -> Pieces:
    """What came in at the device's network port, with its pauses, as recorded."""
    data = bytes.fromhex(vector["rx_hex"])
    gap = vector["gap_us"]
    if isinstance(gap, dict):
        rows = zip(gap["before_each_us"], gap["segments"], gap["ports"], strict=True)
        assert gap["between_bytes_us"] == 0
        return [(us * US, bytes.fromhex(piece)) for us, piece, port in rows if port == "net"]
    if gap:
        return [(gap * US if at else 0, data[at : at + 1]) for at in range(len(data))]
    return [(0, data)]


def whole(pieces: Pieces) -> Pieces:
    return pieces


def byte_by_byte(pieces: Pieces) -> Pieces:
    return [
        (0 if at else pause, data[at : at + 1]) for pause, data in pieces for at in range(len(data))
    ]


def behind_noise(pieces: Pieces) -> Pieces:
    """In one transmission with it, right before."""
    (pause, first), *rest = pieces
    return [(pause, NOISE + first), *rest]


def after_noise(pieces: Pieces) -> Pieces:
    """In a transmission of its own, which the noise went before."""
    return [(0, NOISE), *pieces]


def replay(
    pieces: Pieces,
    lanes: int,
    *,
    settings: SacSettings | None = None,
    rate: LineRate | None = None,
) -> Bench:
    bench = Bench(NODE, lanes=lanes, settings=settings, rate=rate)
    end = 0
    for pause, data in pieces:
        end = bench.sends(data, at=end + pause).end
    bench.run()
    return bench


def lanes_of(vector: Vector) -> int:
    return 2 if vector.get("overlaps") else 1


def named(vector: Vector) -> str:
    return str(vector["name"])


def test_there_are_vectors_of_every_outcome() -> None:
    assert {vector["outcome"] for vector in VECTORS} == {
        "message",
        "silent",
        "bad_crc",
        "forwarded",
        "ack_seen",
    }
    assert sum(lanes_of(vector) == 2 for vector in VECTORS) >= 5
    assert STX not in NOISE


@pytest.mark.parametrize("form", [whole, byte_by_byte, behind_noise, after_noise])
@pytest.mark.parametrize("vector", VECTORS, ids=named)
def test_a_node_sends_what_the_device_sent(
    vector: Vector, form: Callable[[Pieces], Pieces]
) -> None:
    bench = replay(form(pieces_of(vector)), lanes_of(vector))
    assert b"".join(bench.answers).hex() == vector["tx_hex"]
    # What went out on one lane went out unharmed.
    assert bench.bus.medium.counters().collided == 0


@pytest.mark.parametrize("vector", VECTORS, ids=named)
def test_a_packet_cut_in_two_anywhere_is_answered_at_the_same_times(vector: Vector) -> None:
    pieces = pieces_of(vector)
    expected = replay(pieces, 2, rate=EVEN).heard
    for number, (pause, data) in enumerate(pieces):
        for at in range(1, len(data)):
            cut = [*pieces[:number], (pause, data[:at]), (0, data[at:]), *pieces[number + 1 :]]
            assert replay(cut, 2, rate=EVEN).heard == expected, (
                f"cut at byte {at} of piece {number}"
            )


@pytest.mark.parametrize("vector", [v for v in VECTORS if lanes_of(v) == 2], ids=named)
def test_an_overlapping_exchange_collides_on_one_lane(vector: Vector) -> None:
    bench = replay(pieces_of(vector), 1)
    # In 50 ms between two bytes the whole answer fits.
    assert (bench.bus.medium.counters().collided >= 2) == (vector["name"] != "slow_50ms")


@pytest.mark.parametrize(
    "vector", [v for v in VECTORS if v["outcome"] in ("message", "forwarded")], ids=named
)
def test_without_acks_the_device_accepts_the_same_packets_in_silence(vector: Vector) -> None:
    replies = bytes.fromhex(vector["tx_hex"])
    with_ack = replay(pieces_of(vector), 2)
    bench = replay(pieces_of(vector), 2, settings=SacSettings(ack=False))
    own = b"".join(data for data in bench.answers)
    assert replies.endswith(own)
    assert not own or (own[0] == STX and vector["outcome"] == "forwarded")
    assert bench.node.snapshot(0).counters["ack"] == 0
    # A device that does not answer hears again sooner, never later.
    packets = bench.node.snapshot(0).counters["packets"]
    assert packets >= with_ack.node.snapshot(0).counters["packets"] > 0
    assert GENERAL_CALL not in bench.nodes
