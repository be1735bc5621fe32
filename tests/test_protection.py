"""The study of what the protocol protects: what it counts and predicts, on fewer packets."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path

import pytest

from benchmarks.executions import Executions
from benchmarks.prediction import bound, turns, undetected
from benchmarks.protection import ROWS, Study, main, table
from sacbus.trace import read
from sacbus.wire import MOTHER, ack, crc8, encode

P = 0.1


def test_a_byte_arrives_as_something() -> None:
    assert sum(turns(0x5A, into, P) for into in range(256)) == pytest.approx(1)
    assert turns(0x5A, 0x5A, P) == pytest.approx((1 - P) ** 8)
    assert turns(0x5A, 0x5B, P) == pytest.approx(P * (1 - P) ** 7)


@pytest.mark.parametrize("p", [1e-4, 0.01, 0.3])
def test_damage_that_a_crc_lets_pass_is_as_likely_as_counting_all_of_it_says(p: float) -> None:
    """A body of one byte and its CRC: all 65 535 damages, one by one."""
    passes = sum(
        turns(0, damage, p) * turns(0, check, p)
        for damage in range(256)
        for check in range(256)
        if (damage or check) and crc8(bytes((0x41 ^ damage,))) == crc8(b"A") ^ check
    )
    assert undetected(1, p) == pytest.approx(passes, rel=1e-3, abs=1e-15)


@pytest.mark.parametrize("expected", [0.0, 0.01, 3.0, 80.0, 499.0, 501.0, 1e5])
def test_counts_stay_within_their_bound_unless_chance_is_as_rare_as_it_says(
    expected: float,
) -> None:
    low, high = bound(expected)
    assert low <= expected <= high
    assert high - low <= 7 * (expected + 1) ** 0.5 + 2
    assert high - low >= 6 * max(expected - 1, 0) ** 0.5 - 2


@pytest.fixture(scope="module")
def recorded() -> BytesIO:
    return BytesIO()


@pytest.fixture(scope="module")
def study(recorded: BytesIO) -> Study:
    return Study(3_000, 0.01, 3, recorded)


@pytest.mark.slow
def test_measured_and_predicted_agree_on_a_bad_line(study: Study) -> None:
    rows = table(study, 0.01)
    assert len(rows) == len(ROWS) + 1
    assert all(row.endswith(": within") for row in rows[1:])
    assert study.found.counts["other node"] > 50


@pytest.mark.slow
def test_the_prediction_of_another_rate_does_not_fit(study: Study) -> None:
    assert any(row.endswith(": OUTSIDE") for row in table(study, 0.005))


@pytest.mark.slow
def test_every_wrong_execution_shows_in_the_recording_and_in_where_the_motors_stand(
    study: Study,
) -> None:
    counts = study.found.counts
    wrong = sum(
        counts[name]
        for name in ("other node", "everybody", "undetected", "unchecked", "unchecked wrong")
    )
    assert counts["visible"] == counts["there"] == len(study.found.wrong) == wrong
    right, elsewhere, strange = study.motors()
    assert elsewhere == 0
    assert right + strange == 252
    assert right > 240


@pytest.mark.slow
def test_nodes_and_mother_tell_what_the_recording_says(study: Study) -> None:
    assert study.agrees()
    study.by_node[10, False, True] += 1
    assert not study.agrees()
    study.by_node[10, False, True] -= 1
    study.known -= 1
    assert not study.agrees()
    study.known += 1


SENT = encode(10, MOTHER, b"m4v900")


def damaged(place: int, byte: int) -> bytes:
    """What mother sent, with another byte in one place."""
    return SENT[:place] + bytes((byte,)) + SENT[place + 1 :]


def found(arrived: bytes, *others: dict[str, object]) -> Executions:
    """What is found of one packet to node 10 that arrived like this, and what is recorded after."""
    nodes: list[object] = [{"address": one, "kind": "sac", "settings": {}} for one in (10, 11, 12)]
    line = {"name": "bus", "protocol": "sac", "baud": 38_400, "bits": 10, "lanes": 1, "seed": 0}
    bus = {"bus": 0, **line, "nodes": nodes}
    head: dict[str, object] = {"sacbus": "recording", "format": 1, "buses": [bus]}
    sent = {"is": "sent", "start": 0, "lane": 0, "from": "mother"}
    packet = {**sent, "data": SENT.hex(), "arrived": arrived.hex()}
    records = [{"t": 10 + at, "bus": 0, **one} for at, one in enumerate((packet, *others))]
    lines = [json.dumps(one) + "\n" for one in (head, *records)]
    return Executions(read(BytesIO("".join(lines).encode())))


def acknowledges(node: int) -> dict[str, object]:
    data = ack(MOTHER, node).hex()
    return {"is": "sent", "start": 20, "lane": 0, "from": node, "data": data}


def reports(node: int, kind: str = "refused") -> dict[str, object]:
    return {"is": "report", "node": node, "kind": kind, "text": "the line does nothing"}


ONE_PACKET = {
    "other node": (damaged(1, 11), [acknowledges(11)]),
    "everybody": (damaged(1, 0), [reports(10), reports(11), reports(12)]),
    "undetected": (damaged(3, 0), [acknowledges(10)]),
    "unchecked wrong": (damaged(-2, 0)[:3] + b"n" + damaged(-2, 0)[4:], [acknowledges(10)]),
    "lost": (damaged(0, 0), [reports(10, "lost")]),
}


@pytest.mark.parametrize("kind", ONE_PACKET)
def test_a_packet_is_counted_by_who_is_seen_to_have_accepted_it_and_what_was_damaged(
    kind: str,
) -> None:
    arrived, others = ONE_PACKET[kind]
    counts = found(arrived, *others).counts
    assert counts[kind] == 1
    wrong = kind != "lost"
    assert counts["visible"] == counts["there"] == wrong


def without(recorded: BytesIO, kind: str) -> Executions:
    """What is found in a recording that lacks the records of a kind."""
    lines = recorded.getvalue().splitlines(keepends=True)
    kept = [line for line in lines if json.loads(line).get("is") != kind]
    return Executions(read(BytesIO(b"".join(kept))))


@pytest.mark.slow
def test_it_is_the_recorded_motion_that_is_counted(study: Study, recorded: BytesIO) -> None:
    still = without(recorded, "moves")
    # Who accepted is known by the answers, but nobody did what was sent.
    assert still.counts["other node"] == study.found.counts["other node"]
    assert still.counts["as sent"] == 0
    assert not any(right for _, _, right in still.by_node)


@pytest.mark.slow
def test_what_everybody_executes_is_one_packet_and_the_executions_of_all() -> None:
    file = BytesIO()
    # A seed with which a packet for one node becomes one for all.
    study = Study(2_000, 0.01, 43, file)
    counts = study.found.counts
    assert counts["everybody"] == 1
    # The one that was meant is among the 252.
    assert counts["by others"] == counts["other node"] + 251
    assert study.agrees()
    assert any("and 251 others" in one for one in study.found.wrong)


@pytest.mark.slow
def test_every_packet_is_counted_once(study: Study) -> None:
    within = ("unknown", "heard", "by others", "visible", "there")
    counts = study.found.counts
    assert sum(n for name, n in counts.items() if name not in within) == 3_000
    assert study.found.sent.total() == 3_000


@pytest.mark.slow
def test_the_same_arguments_print_the_same_and_another_seed_does_not(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def run(seed: int) -> str:
        assert main(["--packets", "400", "--rate", "0.01", "--seed", str(seed), "--list"]) == 0
        return capsys.readouterr().out

    assert run(1) == run(1) != run(2)


@pytest.mark.slow
def test_the_recording_is_kept_where_that_is_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "kept.jsonl"
    assert main(["--packets", "100", "--record", str(file)]) == 0
    assert Executions(read(file)).sent.total() == 100
