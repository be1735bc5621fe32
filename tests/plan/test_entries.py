"""Where commands come from: named, walked again, and of any length."""

from __future__ import annotations

import gc
import io
import tracemalloc
from pathlib import Path

import pytest

from sacbus.language import Defaults
from sacbus.plan import Commands, ListFile, PlanError, QueueFile, Spool
from sacbus.plan.entries import IN_MEMORY, LONGEST_LINE, Entry, Source

DATA = Path(__file__).parents[1] / "data"


def spool(content: bytes, name: str = "list.txt") -> Spool:
    return Spool(io.BytesIO(content), name)


def read(source: Source) -> list[tuple[str, str]]:
    return [(entry.where, entry.text) for entry in source]


def test_commands_are_counted_and_lists_among_them_have_their_own_lines() -> None:
    with spool(b"\nm2\n") as kept:
        source = Commands(["m1", ListFile(kept), "m3"])
        expected = [("command 1", "m1"), ("list.txt line 2", "m2"), ("command 3", "m3")]
        assert read(source) == expected
        assert read(source) == expected


def test_a_list_passes_over_empty_lines_and_blanks_around_commands() -> None:
    with spool(b"\xef\xbb\xbfm1\r\n\r\n  m2 \t\r\n \nm3") as kept:
        entries = list(ListFile(kept))
    assert [(entry.where, entry.text, entry.skipped) for entry in entries] == [
        ("list.txt line 1", "m1", 0),
        ("list.txt line 3", "m2", 2),
        ("list.txt line 5", "m3", 0),
    ]


def test_a_list_passes_over_comments() -> None:
    with spool(b"# warm up\nm1\n  #m2\n#\nm3\n") as kept:
        assert read(ListFile(kept)) == [("list.txt line 2", "m1"), ("list.txt line 5", "m3")]


def test_the_companions_list_is_read_whole() -> None:
    with (DATA / "companion-one-shot.txt").open("rb") as file, Spool(file, "one-shot") as kept:
        entries = list(ListFile(kept))
        assert kept.lines == 100
    assert len(entries) == 33
    assert entries[0] == Entry("xm1200v160ad", "one-shot line 1")
    assert entries[-1].text == "xm400v200"


def test_a_queue_file_gives_motions_and_the_commands_that_mean_them() -> None:
    with (DATA / "companion-queue.txt").open("rb") as file, Spool(file, "queue.txt") as kept:
        entries = list(QueueFile(kept, Defaults()))
    assert len(entries) == 30
    assert (entries[1].where, entries[1].text) == ("queue.txt line 2", "m-600v50a1d1l0t3000f")
    assert entries[1].motion is not None
    assert entries[1].motion.wait_us == 3_000


def test_a_wrong_row_is_named_by_file_line_and_column() -> None:
    row = b"1,200,0,1,100,3000,0,1,1,0,0,0\n"
    with spool(row + row.replace(b"3000", b"fast"), "queue.csv") as kept:
        entries = iter(QueueFile(kept, Defaults()))
        assert next(entries).where == "queue.csv line 1"
        with pytest.raises(PlanError) as told:
            next(entries)
    assert str(told.value) == (
        "this is no row of a queue file, queue.csv line 2 column 15, "
        "expected the cycle in microseconds, 0 to 4294967295, got 'fast'"
    )


def test_a_line_that_is_far_too_long_is_refused_and_not_read() -> None:
    with spool(b"\n" + b"1" * 2 * LONGEST_LINE + b"\n") as kept:
        sources: tuple[Source, ...] = (ListFile(kept), QueueFile(kept, Defaults()))
        for source in sources:
            with pytest.raises(PlanError, match=r"too long, list\.txt line 2, expected at most"):
                list(source)


def test_a_line_of_the_longest_length_is_read_with_and_without_an_end() -> None:
    line = b"m" * LONGEST_LINE
    with spool(line + b"\n" + line) as kept:
        assert [len(text) for text in kept] == [LONGEST_LINE] * 2


def test_an_input_can_be_read_again_also_when_it_lies_on_disk() -> None:
    lines = IN_MEMORY // 4 + 1
    with spool(b"m10\n" * lines) as kept:
        assert kept.lines == lines
        assert sum(1 for _ in kept) == lines
        # Left in the middle, the next walk begins at the beginning all the same.
        assert next(iter(kept)) == "m10"
        assert sum(1 for _ in kept) == lines


def test_a_walk_that_was_left_is_cleared_away_after_its_input_is_closed() -> None:
    with spool(b"m10\nm20\n") as kept:
        walk = iter(kept)
        assert next(walk) == "m10"
    # An exception in here would be one that nobody can catch, which fails the test as a warning.
    del walk
    gc.collect()


@pytest.mark.slow
def test_memory_does_not_grow_with_the_input() -> None:
    row = b" 1 , 800 , 0 , 1 , 150 , 2000 , 0 , 1 , 1 , 0 , 0 , 3000 \r\n"

    class Rows(io.RawIOBase):
        """So many rows, made as they are read."""

        left = 5_000

        def read(self, size: int = -1) -> bytes:
            if not self.left:
                return b""
            self.left -= 1_000
            return row * 1_000

    with Rows() as rows, Spool(rows, "queue.csv") as kept:  # type: ignore[arg-type]  # it reads
        tracemalloc.start()
        try:
            assert sum(1 for _ in QueueFile(kept, Defaults())) == 5_000
            _now, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
    assert peak < 1 << 20
