"""Sessions of the manual, typed at the terminal as it has them: what is shown, and what then runs.

Each test names the section of the manual that its lines are from.
"""

from __future__ import annotations

import pytest

from sacbus.kernel import MS, SECOND, Ns
from sacbus.wire import ack
from tests.nodes.sac.bench import NODE, packet
from tests.nodes.sac.console import Console, lines


class Sitting(Console):
    """A console, and note of what ran."""

    def __init__(self, *addresses: int) -> None:
        #: Each command that has been the current one, in the manual's shortest form.
        self.ran: list[str] = []
        self._current = ""
        super().__init__(*addresses)

    def until(self, at: Ns) -> None:
        kernel = self.bench.kernel
        while (due := kernel.next_at()) is not None and due <= at:
            kernel.run_until(due)
            self._look()
        kernel.run_until(at)
        self._look()

    def _look(self) -> None:
        current = self.bench.node.snapshot(self.bench.kernel.now).current
        if current not in ("", self._current):
            self.ran.append(current)
        self._current = current

    def enters(self, *typed: str) -> str:
        """Lines one after the other; what the last one shows."""
        return [self.types(line + "\r") for line in typed][-1]

    def waits(self, span: Ns) -> None:
        self.until(self.bench.kernel.now + span)

    def rests(self) -> None:
        """Until nothing is due any more."""
        while (due := self.bench.kernel.next_at()) is not None:
            self.until(due)

    @property
    def state(self) -> str:
        return self.bench.snapshot(self.bench.kernel.now).state

    @property
    def rpm(self) -> float:
        return self.bench.snapshot(self.bench.kernel.now).rpm

    @property
    def position(self) -> int:
        return self.bench.position(self.bench.kernel.now)

    def row(self, position: int) -> str:
        """A row of the queue's screen as it is shown."""
        (shown,) = (
            line for line in self.enters("q").split("\r\n") if line.startswith(f"{position}\t")
        )
        return shown

    def session(self) -> dict[str, str]:
        """Session defaults as `cf` shows them."""
        return {line[:15].strip(): line[15:] for line in self.enters("cf").split("\r\n")[2:-1]}


@pytest.fixture
def sitting() -> Sitting:
    return Sitting()


def numbered(steps: int) -> str:
    """A command of so many steps as it is shown while it runs, without ramps at 100 RPM."""
    return f"m{steps}v100a999d999"


def filled() -> Sitting:
    """Somebody at a node whose queue position n has n steps; nothing is pending."""
    sitting = Sitting()
    for position in range(1, 31):
        sitting.enters(f"q{position}m{position}v100a999d999")
    assert sitting.ran == []
    return sitting


# ---- "Continuous" -------------------------------------------------------------------------------


def test_parameters_of_a_continuous_command_are_thrown_away(sitting: Sitting) -> None:
    before = sitting.session()
    queue = sitting.enters("q")
    sitting.enters("mv120a.8d1.2")
    assert sitting.ran == ["mv120a.8d1.2"]
    sitting.waits(10 * SECOND)
    assert sitting.rpm == 120
    sitting.enters("S")
    # "Upon completion system defaults will still be say 100RPM, accel 1.0 and decel 1.0."
    assert sitting.session() == before
    assert (before["RPM"], before["acc"], before["dec"]) == ("100", "1.00", "1.00")
    assert sitting.enters("q") == queue


def test_parameters_that_are_entered_before_a_continuous_command_persist(sitting: Sitting) -> None:
    sitting.enters("v120", "a.8", "d1.2", "m")
    assert sitting.ran == ["mv120a.8d1.2"]
    sitting.waits(10 * SECOND)
    assert sitting.rpm == 120
    sitting.enters("S")
    session = sitting.session()
    assert (session["RPM"], session["acc"], session["dec"]) == ("120", "0.80", "1.20")
    # buff[0] "is not visible" with a normal Qdump; "it is visible under debug".
    assert "\r\n0\t" not in sitting.enters("q")
    sitting.enters("b")
    assert sitting.row(0) == "0\t0\tCW\t120\t2500\t0.80\t1.20\t0\t0"


def test_continuous_motion_that_interrupts_a_loop_returns_to_it_by_x() -> None:
    """Manual, "Continuous" and "Loop": "completion of this will return control to the loop"."""
    sitting = filled()
    sitting.enters("ln1", "ls25", "lf28")
    sitting.enters("mv60")
    sitting.waits(5 * SECOND)
    assert (sitting.ran, sitting.rpm) == ([numbered(25), "mv60a1d1"], 60)
    sitting.enters("x9")
    sitting.rests()
    assert sitting.ran[2:] == [numbered(9), numbered(26), numbered(27), numbered(28)]
    assert sitting.state == "STANDBY"


def test_continuous_motion_that_interrupts_the_queue_returns_to_it_by_x() -> None:
    """Manual, "xRef": "be it a loop or regular command processing"."""
    sitting = filled()
    sitting.enters("m2000", "m30v100a999d999", "m29", "mv60")
    sitting.waits(5 * SECOND)
    sitting.enters("x9")
    sitting.rests()
    ran = ["m2000v100a1d1", "mv60a999d999", numbered(9), numbered(30), numbered(29)]
    assert sitting.ran == ran


def test_x_suspends_a_loop_for_the_duration_of_its_command_alone() -> None:
    """Manual, "Loop"."""
    sitting = filled()
    sitting.enters("ln1", "ls25", "lf27", "x9")
    sitting.rests()
    assert sitting.ran == [numbered(25), numbered(9), numbered(26), numbered(27)]


# ---- "Loop" -------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [("LS29", "LF2"), ("LF2", "LS29")])
def test_a_loop_whose_finish_is_lower_than_its_start_wraps_around(ends: tuple[str, str]) -> None:
    """Manual, "Looping": "will wrap around to one and continue counting up"."""
    sitting = filled()
    sitting.enters("LN2", *ends)
    sitting.rests()
    assert sitting.ran == [numbered(position) for position in (29, 30, 1, 2)] * 2


def test_any_finish_one_below_the_start_loops_over_the_whole_queue() -> None:
    sitting = filled()
    sitting.enters("LN1", "LS9", "LF8")
    sitting.rests()
    assert sitting.ran == [numbered(position) for position in [*range(9, 31), *range(1, 9)]]


# ---- "Throw-away" -------------------------------------------------------------------------------


def test_a_one_shot_inserts_itself_and_alters_no_session_default(sitting: Sitting) -> None:
    before = sitting.session()
    sitting.enters("m2000", "m30v100a999d999", "v100a1", "v100", "a1", "d1", "xm-40v150a2d3")
    sitting.rests()
    assert sitting.ran == ["m2000v100a1d1", "m-40v150a2d3", numbered(30)]
    assert sitting.session() == before
    # It is in no position of the queue, but in the hidden one.
    assert "\t40\t" not in sitting.enters("q")
    sitting.enters("b")
    assert sitting.row(31) == "31\t40\tCCW\t150\t2000\t2.00\t3.00\t0\t0"


# ---- "Communications" ---------------------------------------------------------------------------


def test_a_command_for_another_node_is_obeyed_there_and_a_message_is_shown() -> None:
    sitting = Sitting(NODE, 85)
    bench = sitting.bench
    there = bytearray()
    bench.nodes[85].terminal.show = there.extend
    assert sitting.enters("85m3000a2d1") == lines("85m3000a2d1", "85> m3000a2d1")
    # As the manual's network has it, with its CRC.
    wire = bytes.fromhex("02 55 52 6d 33 30 30 30 61 32 64 31 03 a7 00")
    assert bench.answers == [wire, ack(NODE, 85)]
    assert bench.snapshot(bench.kernel.now, 85).current == "m3000v100a2d1"
    assert sitting.ran == []
    sitting.rests()
    assert bench.position(bench.kernel.now, 85) == 3000
    assert sitting.position == 0
    for line in ("85 hello", "85.hello"):
        bench.heard.clear()
        sitting.enters(line)
        assert bench.answers == [packet(line[2:], 85, NODE), ack(NODE, 85)]
    assert there == b"82:85> hello\r\nSAC>\r\n82:85> .hello\r\nSAC>"
    begin = len(sitting.shown)
    bench.heard.clear()
    bench.nodes[85].terminal.type(b"/ reply\r", bench.kernel.now)
    bench.bus.touch(bench.nodes[85])
    sitting.rests()
    assert bench.answers == [packet(" reply", NODE, 85), ack(85, NODE)]
    assert sitting.shown[begin:] == b"\r\n85:82> reply\r\nSAC>"
    # "/" without a space or a dot is a command. (Right after its ACK the device is deaf.)
    sitting.waits(20 * MS)
    bench.nodes[85].terminal.type(b"/m-30\r", bench.kernel.now)
    bench.bus.touch(bench.nodes[85])
    sitting.rests()
    assert (sitting.ran, sitting.position) == (["m-30v100a1d1"], -30)


# ---- "V" ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("typed", "shown"),
    [("vc42567", "7\t42567"), ("Vc4567", "65\t4567"), ("v65", "65\t4615")],
)
def test_a_cycle_stands_in_the_queue_with_whole_rpm(
    sitting: Sitting, typed: str, shown: str
) -> None:
    sitting.enters(typed, "m200")
    assert sitting.row(1) == f"1\t200\tCW\t{shown}\t1.00\t1.00\t0\t0"


# ---- "Command queue" ----------------------------------------------------------------------------

#: The queue of section "Velocity profile", as far as it is shown: harmonic but for two rows.
PROGRAM = """\
1	800	CW	150	2000	1.00	1.00	0	3000
2	600	CCW	50	6000	1.00	1.00	0	3000
3	2000	CW	150	2000	1.00	1.00	0	0
4	1200	CCW	100	3000	1.00	1.00	0	0
5	200	CW	20	15000	1.00	1.00	0	0
6	2000	CCW	100	3000	1.00	1.00	0	1000000
7	1600	CW	120	2500	1.00	1.00	0	0
8	200	CW	20	15000	1.00	1.00	0	0
9	2000	CCW	200	1500	1.00	1.00	0	0
10	2000	CW	60	5000	1.00	1.00	0	2000000
11	4000	CW	160	1875	*5.00	5.00	0	3000000
12	2000	CCW	100	3000	*10.47	10.47	0	0
13	200	CW	100	3000	1.00	1.00	0	0
14	200	CCW	70	4285	1.00	1.00	0	0
15	200	CCW	100	3000	1.00	1.00	0	0
""".splitlines()

#: The queue of Appendix E, "Incoming", where it differs from that: pulses, linear ramps, sync.
EDITED = """\
2	600	CCW	50	6000	1.00	1.00	0	s 3000
3	2000	+CW	150	2000	*10.47	10.47	0	0
4	1200	CCW	100	3000	*10.47	10.47	0	s 0
6	2000	+CCW	100	3000	1.00	1.00	0	1000000
7	1600	CW	120	2500	1.00	1.00	0	s 0
8	200	CW	20	15000	*10.47	10.47	0	0
16	10	CW	69	4321	1.00	1.00	0	2400000
18	140	CCW	20	15000	1.00	1.00	0	300000
23	200	CW	121	2479	1.00	1.00	0	0
30	2000	CW	200	1500	1.00	1.00	0	0
""".splitlines()


def typed(row: str) -> tuple[str, str, str]:
    """Position, and what is typed to have a row of the screen: its motion, and all else."""
    position, steps, way, _, cycle, acc, dec, extra, wait = row.split("\t")
    sign = "-" if way.endswith("CCW") else ""
    unit = "fp"["+" in way]
    sync = "s" if wait.startswith("s ") else "s0"
    motion = f"m{sign}{steps}{unit}vc{cycle}"
    return (
        position,
        motion,
        f"l{int('*' in acc)}a{acc.strip('*')}d{dec}u{extra}{sync}t{wait.removeprefix('s ')}",
    )


@pytest.mark.parametrize("row", [*PROGRAM, *EDITED])
def test_edits_make_the_manuals_rows_and_they_are_shown_as_there(
    sitting: Sitting, row: str
) -> None:
    position, motion, rest = typed(row)
    sitting.enters(f"q{position}{motion}", f"q{position}{rest}")
    assert sitting.row(int(position)) == row
    # The queue's program mode takes the same, without the Q.
    other = Sitting()
    other.enters("qp", f"{position}{motion}", f"{position}{rest}", "X")
    assert other.row(int(position)) == row


@pytest.mark.parametrize(
    ("before", "inherited"),
    [
        # As the manual has it: position 15 is 100 RPM, and 1.00 both ways.
        ("m-200v100a1d1", "100\t3000\t1.00\t1.00"),
        ("m-200v70a2d3t9u2s", "70\t4285\t2.00\t3.00"),
        ("m200v100l1a5d6", "100\t3000\t*5.00\t6.00"),
    ],
)
def test_what_is_omitted_is_inherited_from_the_previous_command(
    sitting: Sitting, before: str, inherited: str
) -> None:
    sitting.enters(*["m1v200a999d999l0"] * 14, before, "y", "m2000u6t50000")
    assert sitting.row(16) == f"16\t2000\tCW\t{inherited}\t6\t50000"
    assert sitting.enters("q").endswith("Q is at 17  + pulse  * linear  s sync\r\nSAC>")


# ---- "Queue" ------------------------------------------------------------------------------------


def test_appendix_es_edit_is_shown_and_runs_as_it_says(sitting: Sitting) -> None:
    """Manual, Appendix E, "Incoming"."""
    sitting.enters("q9m100v20a2d3l1u5s", "q9m-2000vc1500a1d1l0pu0s0t0")
    assert sitting.row(9) == "9\t2000\t+CCW\t200\t1500\t1.00\t1.00\t0\t0"
    sitting.enters("$CJ2", "$R", "x9")
    sitting.rests()
    # 2000 pulses, which are 500 full steps of four microsteps.
    assert (sitting.ran, sitting.position) == (["m-2000v200a1d1p"], -2000)


def test_steps_of_an_edit_are_full_steps_unless_p_is_added(sitting: Sitting) -> None:
    sitting.enters("$CJ1", "$R", "qp", "8m2000", "X", "x8")
    assert sitting.row(8).startswith("8\t2000\tCW\t")
    sitting.rests()
    assert sitting.position == 4000
    sitting.enters("qp", "8m2000p", "X", "x8")
    assert sitting.row(8).startswith("8\t2000\t+CW\t")
    sitting.rests()
    assert sitting.position == 6000


def test_sync_of_a_position_is_switched_on_and_off(sitting: Sitting) -> None:
    """Manual, "sync": `(Q/q)nn(S/s)` and `(Q/q)nn(S/s)0`."""
    sitting.enters("q2m20v100a999d999", "q2s")
    assert sitting.row(2).endswith("\ts 0")
    sitting.enters("x2")
    sitting.rests()
    assert (sitting.state, sitting.position) == ("SYNC", 0)
    sitting.enters("y")
    sitting.rests()
    assert (sitting.state, sitting.position) == ("STANDBY", 20)
    sitting.enters("q2s0", "x2")
    sitting.rests()
    assert (sitting.state, sitting.position) == ("STANDBY", 40)
    assert sitting.row(2).endswith("\t0")


# ---- "xRef" -------------------------------------------------------------------------------------


def test_the_manuals_array_is_programmed_and_runs_through_its_positions(sitting: Sitting) -> None:
    for row in PROGRAM:
        position, motion, rest = typed(row)
        sitting.enters(f"q{position}{motion}", f"q{position}{rest}")
    sitting.enters("xp", "0,1", "1,3", "2,7", "3,5")
    shown = ["x_ 0 1", "x_ 1 3", "x_ 2 7", "x_ 3 5", "x_ 4 0"]
    assert sitting.enters("4,0") == lines("4,0", *shown)
    sitting.enters("x")
    assert sitting.ran == []
    sitting.enters("l2")
    sitting.rests()
    once = ["m800v150a1d1", "m2000v150a1d1", "m1600v120a1d1", "m200v20a1d1"]
    assert sitting.ran == once * 2
    assert sitting.position == 2 * (800 + 2000 + 1600 + 200)
