"""The two forms of output: every figure, and nothing kept."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from sacbus.motion import Drive
from sacbus.plan import Commands, Plan, as_json, as_text
from sacbus.plan.entries import Entry
from sacbus.plan.report import json_pieces, seconds, text_lines

DRIVE = Drive()


def planned(*lines: str, drive: Drive = DRIVE, loops: int = 1) -> Plan:
    return Plan(Commands(lines), drive, loops=loops)


def test_json_has_every_figure_and_null_for_what_never_ends() -> None:
    report = as_json(planned("m-200v100a.5d1", "m", drive=Drive(ustep=1)))
    first, second = report["commands"]
    assert first == {
        "command": "m-200v100a.5d1",
        "steps": 200,
        "pulses": 400,
        "n_acc": 133,
        "n_cruise": 0,
        "n_dec": 67,
        "duration_us": first["duration_us"],
        "start_us": 0,
        "peak_rpm": 76.258,
        "profile": "harmonic",
        "direction": "CCW",
        "warnings": ["200 steps are too few for the ramps: 100 RPM is not reached"],
    }
    assert (2 * first["duration_us"]) % 1 == 0
    assert second["start_us"] > first["duration_us"]
    assert (second["steps"], second["pulses"], second["n_cruise"], second["duration_us"]) == (
        (None,) * 4
    )
    assert report["duration_us"] is None


def test_the_pieces_of_json_are_one_object() -> None:
    plan = planned("m200v100a1d1", "m-30p", "m10l1", loops=2)
    written = "".join(json_pieces(plan, plan.survey()))
    assert written.count("\n") == 1
    assert json.loads(written) == as_json(plan)
    assert len(json.loads(written)["commands"]) == 6
    assert list(json.loads(written)) == ["commands", "duration_us"]


def test_text_has_a_line_a_command_its_warnings_below_and_the_total() -> None:
    assert as_text(planned("m200v100a1d1", "m200v100a.5d1")) == [
        "m200v100a1d1   90 + 20 + 90 steps CW, harmonic, peak 100.00 RPM  1.469006 s",
        "m200v100a.5d1  133 + 0 + 67 steps CW, harmonic, peak 76.01 RPM  1.859606 s",
        "  warning: 200 steps are too few for the ramps: 100 RPM is not reached",
        "total 3.328652 s",
    ]
    assert as_text(planned("m-v50p")) == [
        "m-v50p  40 + endless + 0 pulses CCW, harmonic, peak 50.00 RPM"
    ]


def test_loops_that_are_alike_are_told_once() -> None:
    line = "steps CW, harmonic, peak 100.00 RPM"
    assert as_text(planned("m500v100a1d999", loops=5)) == [
        "loop 1",
        f"m500v100a1d999  90 + 410 + 0 {line}  1.934503 s",
        "loop 2",
        f"m500v100a1d999  0 + 500 + 0 {line}  1.500000 s",
        "loops 3 to 5: as loop 2, 1.500000 s each",
        "total 7.934503 s",
    ]
    assert as_text(planned("m500v100a1d999", loops=3))[4:] == [
        "loop 3: as loop 2, 1.500000 s",
        "total 4.934503 s",
    ]
    assert as_text(planned("m500v100a1d999", loops=2))[4:] == ["total 3.434503 s"]


def test_a_very_long_command_does_not_push_the_others_away() -> None:
    long = "m" + "0" * 60 + "200"
    first, second, _total = as_text(planned("m200", long))
    assert first.index("90 +") == 42
    assert second.startswith(f"{long}  90 + ")


@pytest.mark.parametrize(
    ("ticks", "text"),
    [(0, "0.000000"), (1, "0.000000"), (2_938_012, "1.469006"), (2 * 10**24, f"{10**18}.000000")],
)
def test_seconds_are_exact_to_the_microsecond_at_any_size(ticks: int, text: str) -> None:
    assert seconds(ticks) == text


class Endless:
    """A source of more commands than any memory holds; notes how far it was read."""

    def __init__(self) -> None:
        self.read = 0

    def __iter__(self) -> Iterator[Entry]:
        while True:
            self.read += 1
            yield Entry("m10", f"line {self.read}")


def test_what_is_said_of_a_command_waits_for_none_after_it() -> None:
    survey = planned("m10").survey()
    for said in (text_lines, json_pieces):
        source = Endless()
        pieces = said(Plan(source, DRIVE), survey)
        for _ in range(5):
            next(pieces)
        assert source.read <= 5
