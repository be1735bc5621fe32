"""The live table is a function of what nodes show; the screen redraws it in place."""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.kernel import Ns
from sacbus.live import Screen, table
from sacbus.node import Snapshot
from sacbus.spare import at_once


def a_node(
    address: int = 10,
    *,
    state: str = "STANDBY",
    steps: float = 0,
    rpm: float = 0.0,
    current: str = "",
    pending: tuple[str, ...] = (),
    acks: int = 0,
    naks: int = 0,
) -> Snapshot:
    return Snapshot(
        address=address,
        kind="sac",
        state=state,
        position_steps=steps,
        position_pulses=int(steps),
        rpm=rpm,
        current=current,
        pending=pending,
        counters={"packets": acks + naks, "ack": acks, "nak": naks},
    )


class Still:
    """A node that shows the same always, and counts who looks."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self.address = snapshot.address
        self.looked_at: list[Ns] = []
        self.asked = 0

    def state(self, now: Ns) -> str:
        self.asked += 1
        return self._snapshot.state

    def snapshot(self, now: Ns) -> Snapshot:
        self.looked_at.append(now)
        return self._snapshot


def drawn(
    snapshots: Sequence[Snapshot], columns: int, rows: int, *, colour: bool = False
) -> list[str]:
    nodes = [Still(snapshot) for snapshot in snapshots]
    return at_once(table(nodes, lambda: 0, columns, rows, colour=colour))


def test_a_table_shows_node_state_steps_speed_commands_and_counts() -> None:
    busy = a_node(
        state="CRUISE",
        steps=137,
        rpm=120.04,
        current="m400v120",
        pending=("m1", "m2"),
        acks=3,
        naks=1,
    )
    assert drawn([busy, a_node(11, steps=-400)], 100, 10) == [
        "node  state        steps      RPM  current               pending             ACK   NAK",
        "  10  CRUISE         137    120.0  m400v120              2: m1                 3     1",
        "  11  STANDBY       -400      0.0                                              0     0",
    ]


def test_on_80_columns_commands_give_way_and_every_count_is_whole() -> None:
    long = a_node(
        current="m-4000000c3000.5a1.25d1.25", pending=("m123456789v100a1d1",), acks=12345, naks=9876
    )
    heading, row = drawn([long], 79, 10)
    assert len(row) <= 79
    assert heading.split()[-2:] == ["ACK", "NAK"]
    assert row.split()[-2:] == ["12345", "9876"]
    assert "m-4000000c300" in row
    assert "…" in row


def test_a_terminal_that_is_narrower_still_gets_lines_that_fit() -> None:
    for columns in range(1, 100):
        lines = drawn([a_node(current="m400v120")], columns, 10)
        assert all(len(line) <= columns for line in lines)


@pytest.mark.parametrize(
    ("steps", "shown"),
    [(0, "0"), (400, "400"), (-0.5, "-0.5"), (1_234_567.0, "1234567"), (0.0078125, "0.0078125")],
)
def test_positions_are_exact_in_microsteps_too(steps: float, shown: str) -> None:
    row = drawn([a_node(steps=steps)], 100, 10)[1]
    assert row.split()[2] == shown


def test_when_there_are_too_many_nodes_the_busy_ones_are_shown_in_order() -> None:
    nodes = [a_node(address, state="STANDBY") for address in range(10, 30)]
    nodes[7] = a_node(17, state="CRUISE")
    nodes[19] = a_node(29, state="SYNC")
    lines = drawn(nodes, 100, 5)
    assert len(lines) == 5
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["10", "STANDBY"],
        ["17", "CRUISE"],
        ["29", "SYNC"],
    ]
    assert lines[4] == "… and 17 more nodes"


@pytest.mark.parametrize("count", range(9))
def test_a_table_never_has_more_lines_than_there_are_rows(count: int) -> None:
    lines = drawn([a_node(10 + number) for number in range(count)], 100, 5)
    assert len(lines) <= 5
    shown = sum(line.split()[1] == "STANDBY" for line in lines)
    hidden = sum(int(line.split()[2]) for line in lines if line.startswith("…"))
    assert shown + hidden == count


def test_a_number_that_is_longer_than_its_column_is_whole_and_moves_those_behind_it() -> None:
    rows = [line.split() for line in drawn([a_node(acks=1_234_567, naks=8), a_node(11)], 120, 10)]
    assert rows[1][-2:] == ["1234567", "8"]
    lines = drawn([a_node(acks=1_234_567, naks=8), a_node(11)], 120, 10)
    assert len({len(line) for line in lines}) == 1


def test_as_many_nodes_as_lines_are_all_shown() -> None:
    lines = drawn([a_node(address) for address in (10, 11, 12)], 100, 4)
    assert [line.split()[0] for line in lines] == ["node", "10", "11", "12"]


def test_colour_stands_for_motion_and_changes_no_text() -> None:
    nodes = [a_node(10, state="ACCEL"), a_node(11), a_node(12, state="DECEL")]
    plain, coloured = drawn(nodes, 100, 10), drawn(nodes, 100, 10, colour=True)
    assert [re.sub(r"\x1b\[\d*m", "", line) for line in coloured] == plain
    assert ["\x1b[" in line for line in coloured] == [False, True, False, True]


def test_a_table_of_no_nodes_is_its_heading() -> None:
    assert len(drawn([], 100, 10)) == 1


def test_only_nodes_that_are_shown_are_looked_at_in_full_each_at_its_own_time() -> None:
    nodes = [Still(a_node(address)) for address in range(10, 30)]
    nodes += [Still(a_node(100, state="CRUISE"))]
    at_once(table(nodes, iter(range(1_000)).__next__, 100, 5))
    looked = [node.looked_at for node in nodes if node.looked_at]
    assert [node.address for node in nodes if node.looked_at] == [10, 11, 100]
    assert [len(one) for one in looked] == [1, 1, 1]
    assert looked == sorted(looked)
    assert len({one for looks in looked for one in looks}) == 3


@pytest.mark.parametrize("rows", [3, 24, 300])
def test_a_table_is_drawn_in_pieces_however_many_nodes_there_are(rows: int) -> None:
    nodes = [Still(a_node(address)) for address in range(6, 256)]
    done = (0, 0)
    for _ in table(nodes, lambda: 0, 100, rows):
        asked, looks = sum(node.asked for node in nodes), sum(len(n.looked_at) for n in nodes)
        assert asked - done[0] <= 8
        assert looks - done[1] <= 1
        done = (asked, looks)
    assert done[1] == min(rows - 2, 250)


class Terminal:
    """What a terminal shows of the few things that a screen sends; the cursor is at the end."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def write(self, text: str) -> None:
        for up, rest in re.findall(r"(?:\r\x1b\[(\d+)A\x1b\[J)?([^\x1b\r]*)", text):
            if up:
                assert int(up) <= len(self.lines), "the cursor leaves the screen"
                del self.lines[len(self.lines) - int(up) :]
            self.lines += rest.splitlines()


def test_lines_are_drawn_in_place_of_the_last_ones() -> None:
    screen, terminal = Screen(), Terminal()
    terminal.write("connect to /tmp/sacbus\n")
    for lines in (["a", "b"], ["c", "d"], ["e"], ["f", "g", "h"]):
        terminal.write(screen.draw(lines, 80))
        assert terminal.lines == ["connect to /tmp/sacbus", *lines]


def test_nothing_is_written_when_nothing_has_changed() -> None:
    screen = Screen()
    assert screen.draw(["a"], 80) != ""
    assert screen.draw(["a"], 80) == ""
    assert screen.draw(["b"], 80) != ""


@given(
    st.lists(
        st.one_of(st.text("xyz", max_size=3), st.lists(st.text("abc", min_size=1), max_size=4))
    )
)
def test_reports_stay_above_and_the_table_below(happens: list[str | list[str]]) -> None:
    screen, terminal = Screen(), Terminal()
    reports: list[str] = []
    drawn: list[str] = []
    for one in happens:
        if isinstance(one, str):
            terminal.write(screen.above(f"report {one}", 80))
            reports.append(f"report {one}")
        else:
            terminal.write(screen.draw(one, 80))
            drawn = one
    assert terminal.lines == reports + drawn


class Reflowing:
    """A terminal that wraps what is too long, anew whenever its width is changed."""

    def __init__(self, columns: int) -> None:
        self.columns = columns
        self.lines: list[str] = []

    @property
    def rows(self) -> list[str]:
        width = self.columns
        return [
            line[at : at + width]
            for line in self.lines
            for at in range(0, max(len(line), 1), width)
        ]

    def write(self, text: str) -> None:
        plain = re.sub(r"\x1b\[\d*m", "", text)
        for up, rest in re.findall(r"(?:\r\x1b\[(\d+)A\x1b\[J)?([^\x1b\r]*)", plain):
            for _ in range(int(up or 0)):
                # A row is the end of a line that may begin further up.
                line = self.lines.pop()
                if above := (max(len(line), 1) - 1) // self.columns * self.columns:
                    self.lines.append(line[:above])
            self.lines += rest.splitlines()


def test_a_terminal_made_narrower_and_wider_keeps_nothing_of_old_tables() -> None:
    screen, terminal = Screen(), Reflowing(80)
    terminal.write("connect to /tmp/sacbus\n")
    nodes = [a_node(10, state="CRUISE", current="m400v120", acks=3), a_node(11)]
    for columns in (80, 50, 12, 100, 50):
        terminal.columns = columns
        nodes[0] = a_node(10, state="CRUISE", steps=columns, current="m400v120", acks=3)
        lines = drawn(nodes, columns - 1, 8, colour=True)
        terminal.write(screen.draw(lines, columns))
        plain = [re.sub(r"\x1b\[\d*m", "", line) for line in lines]
        assert terminal.lines == ["connect to /tmp/sacbus", *plain]


def test_a_report_on_a_terminal_made_narrower_takes_nothing_with_it() -> None:
    screen, terminal = Screen(), Reflowing(20)
    terminal.write(screen.draw(["a" * 19, "", "b"], 20))
    terminal.columns = 7
    terminal.write(screen.above("first", 7))
    terminal.columns = 30
    terminal.write(screen.above("second", 30))
    assert terminal.lines == ["first", "second", "a" * 19, "", "b"]
