"""The study of what the protocol protects: what it counts and predicts, on fewer packets."""

from __future__ import annotations

import pytest

from benchmarks.prediction import bound, turns, undetected
from benchmarks.protection import ROWS, Study, main, table
from sacbus.wire import crc8

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
def study() -> Study:
    return Study(3_000, 0.01, 3)


@pytest.mark.slow
def test_measured_and_predicted_agree_on_a_bad_line(study: Study) -> None:
    rows = table(study, 0.01)
    assert len(rows) == len(ROWS) + 1
    assert all(row.endswith(": within") for row in rows[1:])
    assert study.counts["other node"] > 50


@pytest.mark.slow
def test_the_prediction_of_another_rate_does_not_fit(study: Study) -> None:
    assert any(row.endswith(": OUTSIDE") for row in table(study, 0.005))


@pytest.mark.slow
def test_every_wrong_execution_shows_in_the_trace_and_in_where_the_motors_stand(
    study: Study,
) -> None:
    counts = study.counts
    wrong = sum(
        counts[name]
        for name in ("other node", "everybody", "undetected", "unchecked", "unchecked wrong")
    )
    assert counts["visible"] == len(study.wrong) == wrong
    right, elsewhere, strange = study.motors()
    assert elsewhere == 0
    assert right + strange == 252
    assert right > 240


@pytest.mark.slow
def test_every_packet_is_counted_once(study: Study) -> None:
    within = ("unknown", "by others", "visible", "there")
    assert sum(n for name, n in study.counts.items() if name not in within) == 3_000


@pytest.mark.slow
def test_the_same_arguments_print_the_same_and_another_seed_does_not(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def run(seed: int) -> str:
        assert main(["--packets", "400", "--rate", "0.01", "--seed", str(seed), "--list"]) == 0
        return capsys.readouterr().out

    assert run(1) == run(1) != run(2)
