"""Loops, references, throw-aways and continuous motion, driven by packets: what runs after what.

Position n of the queue holds n steps at 100 RPM without ramps, 3 ms each, so that what runs can be
told by its steps. A loop over such positions goes seamlessly from one to the next.
"""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from sacbus.kernel import MS, SECOND, Ns
from sacbus.mother import safe_body
from sacbus.node import ReportKind
from tests.nodes.sac.bench import NODE, Bench, packet

AT: Ns = 20 * MS
#: Between two lines: longer than any packet and its answer.
APART: Ns = 20 * MS
FAST: Ns = 3 * MS
"""A full step at 100 RPM."""
FILLED: Ns = 2 * SECOND
"""When the queue has been filled, and more can be said."""


class Line:
    """Mother's side of a bench: one line after the other, and what ran so far."""

    def __init__(self, settings: SacSettings | None = None) -> None:
        self.bench = Bench(settings=settings)
        self.at = AT
        #: When the last command began; when the next one will, and its steps.
        self._begun: Ns | None = None
        self._next: tuple[Ns, int] | None = None
        #: The steps of each command that has begun, 0 for continuous motion.
        self.ran: list[int] = []

    def says(self, *lines: str) -> None:
        """Lines, one after the other, from the time that has been reached."""
        for line in lines:
            data = packet(safe_body(line.encode()))
            heard = self.at + APART
            begun = heard - self.bench.span(len(data) - 1)
            self.until(begun)
            self.bench.sends(data, at=begun)
            self.until(heard)

    def until(self, at: Ns) -> None:
        """Let it run, noting each command that begins."""
        kernel = self.bench.kernel
        while (due := kernel.next_at()) is not None and due <= at:
            kernel.run_until(due)
            self._look()
        kernel.run_until(at)
        self._look()
        self.at = at

    def run(self, *, at_most: Ns = 1_000 * SECOND) -> list[int]:
        """Until nothing is due, or for so long."""
        limit = self.at + at_most
        while (due := self.bench.kernel.next_at()) is not None and due <= limit:
            self.until(due)
        return self.ran

    def _look(self) -> None:
        """Note the command that was to begin, if its time has come; then see what is to begin."""
        engine = self.bench.node.board.engine
        if self._next is not None and self._next[0] <= self.bench.kernel.now:
            self.ran.append(self._next[1])
            self._begun, self._next = self._next[0], None
        if engine.profile is None or engine.started is None or engine.started == self._begun:
            self._next = None
        else:
            self._next = (engine.started, engine.profile.motion.steps or 0)

    @property
    def position(self) -> int:
        return self.bench.position(self.at)

    @property
    def state(self) -> str:
        return self.bench.snapshot(self.at).state

    def ignored(self) -> list[str]:
        return [report.text for report in self.bench.told(ReportKind.IGNORED)]


def filled(*, more: str = "") -> Line:
    """A node whose position n holds n steps; nothing is pending."""
    line = Line()
    for position in range(1, 31):
        line.says(f"q{position}m{position}v100a999d999{more}")
    assert line.position == 0
    line.until(FILLED)
    return line


# ---- editing ------------------------------------------------------------------------------------


def test_the_manuals_edit_sets_every_attribute_of_a_position() -> None:
    line = Line()
    line.says("q9m-2000vc1500a1d1l0pu0s0t0", "x9")
    snapshot = line.bench.snapshot(line.at)
    assert snapshot.current == "m-2000v200a1d1p"
    line.run()
    assert line.position == -2000


def test_an_edit_takes_effect_when_the_position_is_next_loaded() -> None:
    line = Line()
    line.says("m100v100a999d999", "q1m7")
    line.run()
    assert line.position == 100
    line.says("x1")
    line.run()
    assert line.position == 107


def test_an_edit_of_a_pending_command_counts_and_edits_make_nothing_pending() -> None:
    line = Line()
    line.says("m50v100a999d999", "m60", "q2m5", "q3m9")
    line.run()
    assert line.position == 55


def test_a_cleared_queue_holds_the_session_defaults_and_nothing_is_pending() -> None:
    line = Line(SacSettings(sprf=400))
    line.says("v150a2d3", "v150", "a2", "d3", "m9s", "m8", "qc", "y")
    line.run()
    assert line.position == 9  # it was held, not pending
    line.says("x17")
    assert line.bench.snapshot(line.at).current == "m400v150a2d3"


# ---- undo ---------------------------------------------------------------------------------------


def test_undo_takes_back_a_command_that_waits() -> None:
    line = Line()
    line.says("m50v100a999d999", "m60", "z")
    line.run()
    assert line.position == 50
    line.says("m7")
    line.run()
    assert line.position == 57


def test_undo_with_nothing_to_put_back_is_told() -> None:
    line = Line()
    line.says("z")
    assert line.ignored() == ["no queue position has been written that could be put back"]


# ---- loops over the queue -----------------------------------------------------------------------


@pytest.mark.parametrize("ends", [("ls3", "lf5"), ("lf5", "ls3")])
def test_a_loop_runs_from_start_to_finish_and_again_until_it_is_ended(
    ends: tuple[str, str],
) -> None:
    line = filled()
    line.says(*ends)
    line.until(FILLED + SECOND)
    assert line.ran[:7] == [3, 4, 5, 3, 4, 5, 3]
    line.says("l")
    there = line.ran[:]
    line.run()
    # The present command is finished, and that was it.
    assert line.ran == there
    assert (line.state, line.position) == ("STANDBY", sum(line.ran))


def test_a_loop_wraps_from_30_to_1() -> None:
    line = filled()
    line.says("ln1", "ls29", "lf2")
    assert line.run() == [29, 30, 1, 2]


def test_a_counted_loop_ends_by_itself_and_the_count_is_gone() -> None:
    line = filled()
    line.says("ln3", "ls1", "lf2")
    assert line.run() == [1, 2] * 3
    line.says("ls1", "lf2")
    assert len(line.run(at_most=SECOND)) > 12


@pytest.mark.parametrize("count", ["ln", "ln0"])
def test_a_count_of_none_is_for_ever(count: str) -> None:
    line = filled()
    line.says("ln2", count, "ls1", "lf2")
    assert line.run(at_most=SECOND)[:8] == [1, 2] * 4


def test_la_loops_over_the_whole_queue_from_one() -> None:
    line = filled()
    line.says("ln1", "la")
    assert line.run() == list(range(1, 31))


def test_a_loop_goes_seamlessly_from_command_to_command() -> None:
    line = filled()
    line.says("ln4", "ls1", "lf10")
    begun = line.at
    line.run()
    load = 40_000  # of the first one; the others are loaded within the last period
    assert line.at == begun + load + 4 * 55 * FAST


def test_new_ends_count_at_the_end_of_the_present_command() -> None:
    line = filled()
    line.says("ls20", "lf22", "lf21", "ls28")
    line.until(line.at + 500 * MS)
    assert line.ran[:6] == [20, 21, 28, 29, 30, 1]


def test_what_is_pending_waits_until_the_loop_is_over() -> None:
    line = filled()
    line.says("ln2", "ls10", "lf11", "m25v100a999d999")
    assert line.run() == [10, 11, 10, 11, 25]


def test_a_loop_set_while_a_command_runs_waits_for_its_end_and_goes_before_the_queue() -> None:
    line = filled()
    line.says("m50v100a999d999", "m25", "ln1", "ls10", "lf11")
    assert line.run() == [50, 10, 11, 25]


def test_next_in_a_loop_goes_on_with_the_loop() -> None:
    line = filled()
    line.says("ln1", "ls28", "lf30", "N")
    assert line.run() == [28, 29, 30]
    assert line.position < 28 + 29 + 30


def test_a_stop_ends_the_loop() -> None:
    for stop in ("S", "s"):
        line = filled()
        line.says("ls10", "lf20", stop)
        there = line.run()
        assert len(there) == 1
        assert line.state == "STANDBY"


def test_a_loop_holds_at_sync_in_every_iteration() -> None:
    line = filled()
    line.says("q2s", "ln2", "ls1", "lf2")
    line.run()
    assert (line.ran, line.state) == ([1], "SYNC")
    line.says("y")
    line.run()
    assert (line.ran, line.state) == ([1, 2, 1], "SYNC")
    line.says("y")
    assert line.run() == [1, 2, 1, 2]


def test_l_without_anything_to_end_is_told() -> None:
    line = Line()
    line.says("l")
    assert line.ignored() == ["no loop runs, and no continuous motion"]
    line.says("ls4", "l", "lf5")
    line.run()
    # The start was forgotten, so that there is no loop.
    assert (line.ran, len(line.ignored())) == ([], 1)


@pytest.mark.parametrize(("ends", "word"), [(("ls4", "lf4"), "finish"), (("lf4", "ls4"), "start")])
def test_ends_that_are_one_are_told_and_do_nothing(ends: tuple[str, str], word: str) -> None:
    line = filled()
    line.says(*ends)
    line.run()
    assert line.ran == []
    assert len(line.ignored()) == 1
    assert f"must {word} elsewhere" in line.ignored()[0]


def test_bare_l_slows_down_an_endless_position() -> None:
    line = Line()
    line.says("q1m0v100d1", "q2m5", "ls1", "lf2")
    line.until(line.at + 5 * SECOND)
    line.says("l")
    there = line.position
    line.run()
    assert (line.position - there, line.ran) == (90, [0])


# ---- references ---------------------------------------------------------------------------------


def programmed(*lines: str) -> Line:
    """The manual's xRef array: 1, 3, 7, 5, end."""
    line = filled()
    line.says("xp0,1", "xp1,3", "xp2,7", "xp3,5", "xp4,0", *lines)
    return line


def test_the_manuals_array_runs_so_many_times() -> None:
    assert programmed("l2").run() == [1, 3, 7, 5] * 2


@pytest.mark.parametrize("command", ["l0", "xl"])
def test_the_array_runs_for_ever(command: str) -> None:
    line = programmed(command)
    assert line.run(at_most=2 * SECOND)[:9] == [1, 3, 7, 5, 1, 3, 7, 5, 1]
    line.says("l")
    line.run()
    assert line.state == "STANDBY"


def test_an_array_without_an_end_is_refused_out_of_band() -> None:
    line = filled()
    line.says("xp0,1", "xp1,3", "l2")
    assert line.run() == []
    assert line.ignored() == ["the xRef array is empty or has no end: give its end a 0"]


def test_a_one_entry_array_is_continuous_motion_whose_parameters_can_be_edited() -> None:
    # Manual, "Queue": deceleration 999, the only entry of an xRef loop.
    line = Line()
    line.says("q5m200v100a1d999", "xp0,5", "xp1,0", "l0")
    line.until(line.at + 3 * SECOND)
    assert line.bench.snapshot(line.at).rpm == 100
    line.says("q5v150")
    line.until(line.at + 3 * SECOND)
    assert line.bench.snapshot(line.at).rpm == 150
    line.says("q5m-200")
    line.until(line.at + 3 * SECOND)
    assert line.bench.snapshot(line.at).rpm == -150


def test_x_runs_a_position_at_once_and_returns_to_the_next_command_of_the_loop() -> None:
    line = filled()
    line.says("ln1", "ls20", "lf22", "x9")
    assert line.run() == [20, 9, 21, 22]
    assert line.position < 20 + 9 + 21 + 22


def test_x_returns_to_what_is_pending() -> None:
    line = Line()
    line.says("m500v100a999d999", "m60", "q9m7v100a999d999", "x9")
    assert line.run() == [500, 7, 60]


def test_x_cuts_x() -> None:
    line = filled()
    line.says("ln1", "ls20", "lf21", "x29", "x30")
    assert line.run() == [20, 29, 30, 21]


def test_of_several_x_before_the_present_pulse_is_over_the_newest_runs() -> None:
    line = Line()
    line.says("q7m7v100a999d999", "q8m8v100a999d999", "m50v1")
    # At 1 RPM a step lasts 300 ms.
    line.says("x7", "x8")
    assert line.run() == [50, 8]


def test_what_x_finds_held_is_held_again_afterwards() -> None:
    line = filled()
    line.says("m25v100a999d999s", "x9")
    line.run()
    assert (line.ran, line.state) == ([9], "SYNC")
    line.says("y")
    assert line.run() == [9, 25]


def test_what_x_finds_held_in_a_loop_is_held_again_afterwards() -> None:
    line = filled()
    line.says("q2s", "ln1", "ls1", "lf3")
    line.run()
    assert (line.ran, line.state) == ([1], "SYNC")
    line.says("x9")
    line.run()
    assert (line.ran, line.state) == ([1, 9], "SYNC")
    line.says("y")
    assert line.run() == [1, 9, 2, 3]


def test_next_ends_x_and_goes_on_as_x_would() -> None:
    line = filled()
    line.says("ln1", "ls20", "lf21", "x30", "N")
    assert line.run() == [20, 30, 21]


# ---- throw-aways --------------------------------------------------------------------------------


def test_a_throw_away_runs_at_once_and_leaves_session_and_queue_alone() -> None:
    line = Line()
    line.says("m500v100a999d999", "m60", "xm-40v150a2d3")
    line.until(line.at + FAST)
    assert line.bench.snapshot(line.at).current == "m-40v150a2d3"
    assert line.run() == [500, 40, 60]
    line.says("m9")
    assert line.bench.snapshot(line.at).current == "m9v100a999d999"


def test_a_throw_away_keeps_the_velocity_of_what_it_cuts() -> None:
    line = Line()
    line.says("m5000v100a1d1")
    line.until(line.at + 3 * SECOND)
    line.says("xm50v100a1d1")
    assert line.bench.snapshot(line.at).rpm == 100


def test_a_throw_away_without_steps_is_continuous_motion() -> None:
    line = filled()
    line.says("ls20", "lf21", "xmv100a999d999")
    line.until(line.at + 10 * SECOND)
    assert line.ran == [20, 0]
    line.says("S")
    line.run()
    assert (line.ran, line.state) == ([20, 0], "STANDBY")


# ---- continuous motion --------------------------------------------------------------------------


def turning(*before: str) -> Line:
    """Continuous motion at 100 RPM that has interrupted what went before."""
    line = filled()
    line.says(*before, "mv100a999d1")
    line.until(line.at + SECOND)
    assert line.ran[-1] == 0
    return line


@pytest.mark.parametrize("stop", ["S", "s"])
def test_a_stop_of_continuous_motion_ends_the_loop_it_interrupted(stop: str) -> None:
    line = turning("ls20", "lf21", "m25")
    line.says(stop)
    assert line.run() == [20, 0]
    assert line.state == "STANDBY"


@pytest.mark.parametrize("following", ["N", "n"])
def test_next_commits_an_interrupted_loop_to_one_more_command(following: str) -> None:
    line = turning("ls20", "lf23")
    line.says(following)
    assert line.run() == [20, 0, 21]
    assert line.state == "STANDBY"


def test_next_goes_on_through_the_queue() -> None:
    line = turning("m25v100a999d999", "m26", "m27")
    line.says("N")
    assert line.run() == [25, 0, 26, 27]


def test_next_runs_one_more_of_the_loop_and_then_the_queue() -> None:
    line = turning("ls20", "lf23", "m25v100a999d999")
    line.says("N")
    assert line.run() == [20, 0, 21, 25]


def test_x_ends_continuous_motion_and_resumes_the_loop_that_it_interrupted() -> None:
    line = turning("ln1", "ls20", "lf22")
    line.says("x9")
    assert line.run() == [20, 0, 9, 21, 22]


def test_bare_l_slows_continuous_motion_down_and_all_is_over() -> None:
    line = turning("ls20", "lf23", "m25v100a999d999")
    line.says("l")
    there = line.position
    line.run()
    # By its own deceleration, from 100 to 10 RPM at 1.0.
    assert (line.position - there, line.ran, line.state) == (90, [20, 0], "STANDBY")
    line.says("m7v100a999d999")
    assert line.run() == [20, 0, 7]


def test_a_loop_set_during_continuous_motion_waits_for_its_end() -> None:
    line = turning()
    line.says("ln1", "ls20", "lf21", "x9")
    assert line.run() == [0, 9, 20, 21]


# ---- GAP ----------------------------------------------------------------------------------------


def test_without_gap_testing_a_kept_velocity_stays() -> None:
    for toggles, first in (([], 10), (["g"], 100), (["g", "G"], 10)):
        line = Line()
        line.says(*toggles, "m100v100a999d999")
        line.run()
        line.until(line.at + 10 * SECOND)
        line.says("m100v100a1d1")
        line.until(line.at + 35 * MS)
        assert line.bench.snapshot(line.at).rpm == pytest.approx(first, abs=3)


def test_a_stop_takes_the_velocity_also_without_gap_testing() -> None:
    line = Line()
    line.says("g", "m100v100a999d999")
    line.run()
    line.says("S", "m100v100a1d1")
    line.until(line.at + 10 * MS)
    assert line.bench.snapshot(line.at).rpm == 10


def test_without_gap_testing_the_velocity_outlasts_soft_ops() -> None:
    line = Line(SacSettings(soft_ops=True))
    line.says("g", "m40v100a999d999", "m100v100a1d1")
    line.run()
    assert line.ran == [40, 100]
    # All of the second one's ramp is down, which takes 0.704 s, after 10 steps at 3 ms. Had it
    # begun at 10 RPM, it would have taken 1.03 s.
    heard = [said.at for said in line.bench.heard if said.data[3:4] == b"\x11"]
    ends = [said.at for said in line.bench.heard if said.data[3:4] == b"\x12"]
    assert len(heard) == len(ends) == 2
    assert (ends[1] - heard[1]) / SECOND == pytest.approx(0.734, abs=0.001)


def test_all_of_it_is_acknowledged_and_nothing_else_is_said() -> None:
    line = programmed("l2", "x9", "mv100", "l")
    line.run()
    assert {len(said.data) for said in line.bench.heard} == {4}
    assert {said.data[2] for said in line.bench.heard} == {NODE}


# ---- what has not begun -------------------------------------------------------------------------


@pytest.mark.parametrize("then", [["xm10v100a999d999"], ["mv100a999d999", "N"]])
def test_what_waits_for_its_start_comes_after_what_goes_before_it(then: list[str]) -> None:
    line = Line()
    line.says("m400v100a999d999t3000000", *then)
    assert line.run()[1:] == [400]
    assert line.bench.told(ReportKind.OVERRUN) == []


def test_what_waits_for_its_start_in_a_loop_counts_no_iteration() -> None:
    line = filled()
    line.says("q1t3000000", "ln1", "la", "x9")
    assert line.run()[:4] == [9, 1, 2, 3]


def test_a_held_first_command_of_a_loop_counts_no_iteration() -> None:
    line = filled()
    line.says("q2s", "ln1", "ls2", "lf3", "x9")
    line.run()
    line.says("y")
    assert line.run() == [9, 2, 3]


def test_s_before_the_first_pulse_leaves_nothing_that_others_wait_for() -> None:
    line = Line()
    line.says("m400v100t3000000", "s", "mv100a999d999")
    line.until(line.at + 100 * MS)
    assert line.bench.snapshot(line.at).rpm == 100


def test_a_loop_warns_of_its_commands_once() -> None:
    line = Line()
    line.says("q1m20v300", "q2m-20v300", "ls1", "lf2")
    line.until(line.at + 20 * SECOND)
    warned = [report.line for report in line.bench.told(ReportKind.WARNING)]
    assert sorted(warned) == ["m-20v300a1d1", "m20v300a1d1"]
    # An edit is another command, and another loop another chance.
    line.says("q1m19")
    line.until(line.at + 20 * SECOND)
    line.says("S", "ls1", "lf2")
    line.until(line.at + 20 * SECOND)
    warned = [report.line for report in line.bench.told(ReportKind.WARNING)]
    assert warned.count("m19v300a1d1") == 2
    assert warned.count("m-20v300a1d1") == 2


# ---- jumps of velocity --------------------------------------------------------------------------


def warned(line: Line) -> list[tuple[str, str]]:
    return [(report.line, report.text) for report in line.bench.told(ReportKind.WARNING)]


def test_a_turn_at_speed_is_warned_of() -> None:
    line = Line()
    line.says("m300v200a1d999", "m-300v100d1")
    line.run()
    text = "turns at once from 200 RPM: nothing slows it down"
    assert warned(line) == [("m-300v100a1d1", text)]


def test_a_jump_to_a_velocity_that_was_never_reached_is_warned_of() -> None:
    line = Line()
    line.says("m100v300a1d999", "m200")
    line.run()
    assert warned(line)[1:] == [
        ("m200v300a1d999", "goes on from 300 RPM, though the motor was only at 109.01")
    ]


def test_what_begins_from_rest_is_not_warned_of_what_was_before() -> None:
    line = Line()
    line.says("m300v200a1d999")
    line.run()
    line.until(line.at + SECOND)
    line.says("m-300v100d1")
    line.run()
    assert warned(line) == []
