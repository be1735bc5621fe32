"""Steps in files: read in pieces, mistakes named by line, written so that they are read again."""

from __future__ import annotations

from io import BytesIO, StringIO
from pathlib import Path

import numpy as np
import pytest

from sacbus.simad import SimadError, Steps
from sacbus.simad import step_files as files
from sacbus.simad.step_files import axes_in, read_steps, write_csv, write_npy
from sacbus.simad.steps import joined

STEPS = Steps.of([5, 5, 7, 1_000_000_000_000], [0, 1, 0, 1], [1, -1, -1, 1])


def same(one: Steps, other: Steps) -> bool:
    return (
        np.array_equal(one.times, other.times)
        and np.array_equal(one.axes, other.axes)
        and np.array_equal(one.directions, other.directions)
    )


@pytest.fixture(params=[".csv", ".npy"])
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    found: Path = tmp_path / f"steps{request.param}"
    if request.param == ".csv":
        out = StringIO()
        assert write_csv([STEPS.slice(0, 1), STEPS.slice(1, 4)], out, ["85", "7"]) == 4
        found.write_text(out.getvalue())
    else:
        raw = BytesIO()
        assert write_npy(STEPS, raw, [85, 7]) == 4
        found.write_bytes(raw.getvalue())
    return found


def test_what_is_written_is_read_again(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert axes_in(path) == (7, 85)
    assert same(joined([*read_steps(path, (85, 7))]), STEPS)
    monkeypatch.setattr(files, "PIECE", 2)
    assert len([*read_steps(path, (85, 7))]) > 1
    assert same(joined([*read_steps(path, (85, 7))]), STEPS)


def test_axes_that_are_not_asked_for_are_left_out(path: Path) -> None:
    only = joined([*read_steps(path, (7,))])
    assert only.times.tolist() == [5, 1_000_000_000_000]
    assert only.axes.tolist() == [0, 0]
    assert [*read_steps(path, (8,))] == []


def test_csv_needs_no_first_line_of_names_and_may_have_blanks(tmp_path: Path) -> None:
    path = tmp_path / "steps.csv"
    path.write_text("5, 1 , -1\n6,1,+1")
    steps = joined([*read_steps(path, (1,))])
    assert (steps.times.tolist(), steps.directions.tolist()) == ([5, 6], [-1, 1])


@pytest.mark.parametrize("piece", [1, 2, 3, 100])
@pytest.mark.parametrize("text", ["\n \n{0}5,1,-1\n\n6,1,1\n\n", "{0}\n\n5,1,-1\n6,1,1\n \t\n\n\n"])
@pytest.mark.parametrize("names", ["", "time_ns,axis,direction\n"])
def test_blank_lines_count_for_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, piece: int, text: str, names: str
) -> None:
    monkeypatch.setattr(files, "PIECE", piece)
    path = tmp_path / "steps.csv"
    path.write_text(text.format(names))
    steps = joined([*read_steps(path, (1,))])
    assert (steps.times.tolist(), steps.directions.tolist()) == ([5, 6], [-1, 1])
    path.write_text("\n\n" + names)
    assert axes_in(path) == ()


def test_an_array_of_three_columns_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "steps.npy"
    np.save(path, np.array([[5, 1, -1], [6, 1, 1]], dtype=np.int32))
    steps = joined([*read_steps(path, (1,))])
    assert (steps.times.tolist(), steps.directions.tolist()) == ([5, 6], [-1, 1])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("5,1,1\n6,1\n", "line 2: expected time_ns,axis,direction as whole numbers, got '6,1'"),
        (
            "time_ns,axis,direction\n5,1,1\n\n6,1,1\n \n6,1\n\n",
            "line 6: expected time_ns,axis,direction as whole numbers, got '6,1'",
        ),
        (
            "5,1,1\n\n\n4,1,1\n",
            "line 4: expected a time of 5 ns or later, got 4, sort the steps",
        ),
        ("\n5,1,1\n\n6,1,3\n", "line 4: expected a direction of 1 or -1, got 3"),
        (
            "5,1,1\n\ntime_ns,axis,direction\n",
            (
                "line 3: expected time_ns,axis,direction as whole numbers, "
                "got 'time_ns,axis,direction'"
            ),
        ),
        ("5.5,1,1\n", "line 1: expected time_ns,axis,direction as whole numbers, got '5.5,1,1'"),
        (
            "5,1,1\n6,X,1\n",
            "line 2: expected time_ns,axis,direction as whole numbers, got '6,X,1'",
        ),
        (
            f"{1 << 63},1,1\n",
            f"line 1: expected time_ns,axis,direction as whole numbers, got '{1 << 63},1,1'",
        ),
        (
            "time_ns,axis,direction\n5,1,1\n4,1,1\n",
            "line 3: expected a time of 5 ns or later, got 4, sort the steps",
        ),
        ("-5,1,1\n", "line 1: expected a time of 0 ns or later, got -5, sort the steps"),
        ("5,1,0\n", "line 1: expected a direction of 1 or -1, got 0"),
    ],
)
def test_a_line_that_is_wrong_is_named(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "steps.csv"
    path.write_text(text)
    with pytest.raises(SimadError) as refused:
        joined([*read_steps(path, (1,))])
    assert str(refused.value) == f"{path}, {told}"


@pytest.mark.parametrize(
    ("array", "told"),
    [
        (np.zeros(3), "expected fields time_ns, axis, direction or three columns, got float64"),
        (np.zeros((3, 3)), "expected whole numbers, got float64"),
        (np.zeros((3, 3), dtype=int), "row 0: expected a direction of 1 or -1, got 0"),
        (
            np.full((1, 3), 1 << 63, dtype=np.uint64),
            r"expected numbers below 2\*\*63, got 9223372036854775808",
        ),
    ],
)
def test_an_array_that_is_wrong_is_refused(tmp_path: Path, array: object, told: str) -> None:
    path = tmp_path / "steps.npy"
    np.save(path, array)  # type: ignore[arg-type]
    with pytest.raises(SimadError, match=told):
        joined([*read_steps(path, (1,))])


@pytest.mark.parametrize("text", ["5,1,1\n", ""], ids=["CSV", "nothing"])
def test_what_is_no_array_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "steps.npy"
    path.write_text(text)
    with pytest.raises(SimadError, match="expected an array of numpy's"):
        axes_in(path)


def test_more_axes_than_a_dir_line_has_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "steps.csv"
    path.write_text("".join(f"{axis},{axis},1\n" for axis in range(256)))
    with pytest.raises(SimadError, match="expected 255 axes at most, got more, name some"):
        axes_in(path)
