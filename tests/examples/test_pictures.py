"""The example draws what the manual shows, and the documentation shows what is drawn."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from examples import pictures
from tests.drawing import without_matplotlib

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"


def words(picture: Path) -> str:
    """All that is written in an SVG."""
    return "\n".join(re.findall(r"<text[^>]*>([^<]*)</text>", picture.read_text(encoding="utf-8")))


def test_five_pictures_are_written_and_say_what_they_show(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert pictures.main([str(tmp_path)]) == 0
    names = ["harmonic.svg", "last-steps.svg", "linear.svg", "two-axes.svg", "jitter.svg"]
    assert capsys.readouterr().out.splitlines() == [str(tmp_path / name) for name in names]
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(names)
    said = {name: words(tmp_path / name) for name in names}
    assert "step 90, 705 ms" in said["harmonic.svg"]
    assert "3333 µs\n3157 µs\n3030 µs\n3000 µs" in said["last-steps.svg"]
    assert "10.47 rad/s², 100 RPM in a second" in said["linear.svg"]
    assert "steps of the minor axis 3.0 ms or 6.0 ms apart" in said["two-axes.svg"]
    assert "steps of the minor axis 3.6 ms apart" in said["two-axes.svg"]
    tethered, own = re.findall(
        r"jitter at speed ([\d.]+) %, at most ([\d.]+) %", said["jitter.svg"]
    )
    assert [float(figure) for figure in tethered] == pytest.approx([33, 67], abs=3)
    assert max(float(figure) for figure in own) < 1


def test_they_are_the_same_files_every_time(tmp_path: Path) -> None:
    both = []
    for name in ("once", "again"):
        (tmp_path / name).mkdir()
        assert pictures.main([str(tmp_path / name)]) == 0
        both.append([file.read_bytes() for file in sorted((tmp_path / name).iterdir())])
    assert both[0] == both[1]


def test_the_harmonic_curve_is_the_manuals() -> None:
    # Manual, "Discussion": cycle = 300,000 / RPM, 90 steps from 10 to 100 RPM.
    times = pictures.pulse_times("m110v100a1d999")
    rpm = pictures.velocities(times)
    assert rpm[:90] == pytest.approx(range(10, 100), rel=1e-3)
    assert rpm[90:] == pytest.approx([100] * 20)


def test_both_axes_of_a_move_are_through_within_one_step() -> None:
    x = pictures.pulse_times("m240vc3000l1a50d50")
    y = pictures.pulse_times("m200vc3600l1a41.66d41.66")
    assert (len(x), len(y)) == (241, 201)
    assert x[-1] == pytest.approx(y[-1], abs=3.6)


def test_a_directory_that_is_not_there_is_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert pictures.main([str(tmp_path / "none")]) == 1
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert "none/harmonic.svg, name a directory that is there" in written.err


def test_without_matplotlib_it_says_what_to_install(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    without_matplotlib(monkeypatch)
    assert pictures.main([str(tmp_path)]) == 2
    written = capsys.readouterr()
    assert (written.out, written.err.count("\n")) == ("", 1)
    assert "python -m pip install 'sacbus[plot]'" in written.err


def test_every_picture_of_the_pages_on_planning_and_lines_is_there() -> None:
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", (DOCS / "planning.md").read_text("utf-8"))
    assert len(shown) == 5
    shown += re.findall(r"!\[[^\]]+\]\(([^)]+)\)", (DOCS / "lines.md").read_text("utf-8"))
    assert len(shown) == 6
    for name in shown:
        assert (DOCS / name).read_bytes().startswith(b"<?xml")
        assert (DOCS / name).stat().st_size < 60_000
