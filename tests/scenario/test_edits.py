"""Queue files as edits that fit into packets."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.language.queue_file import WrongRow
from sacbus.scenario.edits import MOST, queue_edits
from sacbus.wire import MAX_BODY

ROWS = Path(__file__).parents[1] / "data" / "companion-queue.txt"


def test_a_row_is_an_edit_of_its_position() -> None:
    edits = queue_edits(ROWS, "q.csv")
    assert len(edits) == 30
    assert edits[0] == "q1m800v150a1d1l0t3000f"


def test_a_row_that_is_too_long_is_several_edits_of_one_position(tmp_path: Path) -> None:
    file = tmp_path / "q.csv"
    file.write_text("30,4294967295,1,0,1000000,4294967295,1,999.99,999.99,255,1,4294967295\n")
    edits = queue_edits(file, "q.csv")
    assert len(edits) == 2
    assert all(edit.startswith("q30") and len(edit) <= MOST < MAX_BODY for edit in edits)
    # The unit goes with its steps: p alone leaves them, and m without p makes them full steps.
    assert edits[0].startswith("q30m-4294967295p")
    assert "p" not in edits[1]


def test_what_is_no_queue_file_is_refused_with_its_place(tmp_path: Path) -> None:
    file = tmp_path / "q.csv"
    file.write_text("1,2,3\n")
    with pytest.raises(WrongRow, match=r"q\.csv line 1"):
        queue_edits(file, "q.csv")
