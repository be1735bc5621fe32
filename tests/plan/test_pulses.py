"""Files of pulse times: exact, in order, and made piece by piece."""

from __future__ import annotations

import csv
import io
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from sacbus.motion import Drive
from sacbus.plan import Commands, Plan, PlanError
from sacbus.plan.pulses import PIECE, PulseFormat, format_of, write_pulses


def written(plan: Plan, form: PulseFormat) -> bytes:
    file = io.BytesIO()
    write_pulses(plan, plan.survey(), file, form)
    return file.getvalue()


def rows(plan: Plan) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(written(plan, PulseFormat.CSV).decode())))


def test_csv_has_time_command_and_position_of_every_pulse() -> None:
    plan = Plan(Commands(["m3v100a999d999", "m-2v101t1000"]), Drive())
    first, second = plan
    assert written(plan, PulseFormat.CSV).decode().splitlines() == [
        "time_us,command,position",
        "0,1,1",
        "3000,1,2",
        "6000,1,3",
        f"{second.start // 2},2,2",
        f"{second.start // 2 + 2970},2,1",
    ]
    # The third pulse has its period, then come the wait and, since acc changes not, 16 us.
    assert first.end == 18_000
    assert second.start == first.end + 2 * 1_016 or second.profile.start_rpm == 100


def test_half_microseconds_are_written_as_such() -> None:
    times = [row["time_us"] for row in rows(Plan(Commands(["m5v100"]), Drive()))]
    assert times[:3] == ["0", "30000", "57272.5"]


def test_npy_has_the_same_times_as_csv() -> None:
    plan = Plan(Commands(["m200v100a.5d1", "m-100l1v300a50d50", "m20u3p"]), Drive(ustep=2), loops=2)
    times = np.load(io.BytesIO(written(plan, PulseFormat.NPY)))
    assert times.dtype == np.float64
    assert times.tolist() == [float(row["time_us"]) for row in rows(plan)]
    assert (np.diff(times) > 0).all()


def test_positions_count_up_clockwise_and_down_the_other_way() -> None:
    plan = Plan(Commands(["m20", "m-50", "m7p"]), Drive(ustep=1))
    positions = [int(row["position"]) for row in rows(plan)]
    assert positions == [*range(1, 41), *range(39, -61, -1), *range(-59, -52)]
    assert [row["command"] for row in rows(plan)] == ["1"] * 40 + ["2"] * 100 + ["3"] * 7


@pytest.mark.parametrize("pulses", [PIECE - 1, PIECE, PIECE + 1], ids=str)
def test_pieces_join_without_a_seam(pulses: int) -> None:
    plan = Plan(Commands([f"m{pulses}v500a.5d.5p"]), Drive())
    (planned,) = plan
    assert planned.profile.duration is not None
    times = np.load(io.BytesIO(written(plan, PulseFormat.NPY)))
    expected = planned.profile.pulse_times(0, planned.profile.duration) / 2
    assert len(times) == pulses
    assert (times == expected).all()


def test_what_is_written_is_told() -> None:
    told: list[int] = []
    plan = Plan(Commands(["m100000", "m5"]), Drive())
    write_pulses(plan, plan.survey(), io.BytesIO(), PulseFormat.NPY, told.append)
    assert told == [PIECE, 100_000 - PIECE, 5]


def test_what_never_ends_is_refused() -> None:
    with pytest.raises(PlanError, match="never ends"):
        written(Plan(Commands(["m200", "m"]), Drive()), PulseFormat.CSV)


def test_times_that_a_file_cannot_say_are_refused() -> None:
    plan = Plan(Commands(["m2000000vc4294967295a999d999"]), Drive())
    with pytest.raises(PlanError, match="142 years"):
        written(plan, PulseFormat.NPY)


@pytest.mark.parametrize(
    ("name", "form"),
    [("a.csv", PulseFormat.CSV), ("a.npy", PulseFormat.NPY), ("A.CSV", PulseFormat.CSV)],
)
def test_the_ending_tells_the_format(name: str, form: PulseFormat) -> None:
    assert format_of(Path(name)) is form


@pytest.mark.parametrize("name", ["pulses", "pulses.txt", "npy"])
def test_another_ending_is_refused(name: str) -> None:
    with pytest.raises(PlanError, match=r"ends in \.csv or \.npy"):
        format_of(Path(name))


@pytest.mark.slow
def test_memory_does_not_grow_with_the_pulses() -> None:
    class Nowhere(io.RawIOBase):
        def write(self, piece: object) -> int:
            return 0

    def peak(pulses: int) -> int:
        plan = Plan(Commands([f"m{pulses}"]), Drive())
        survey = plan.survey()
        tracemalloc.start()
        try:
            # A raw file stands in for a buffered one: what is written goes nowhere.
            write_pulses(plan, survey, Nowhere(), PulseFormat.NPY)  # type: ignore[arg-type]
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    assert peak(20 * PIECE) < 1.5 * peak(2 * PIECE)
