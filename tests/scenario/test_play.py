"""The order of steps, and what becomes of each."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pytest

from sacbus.configuration import Configuration
from sacbus.kernel import MS, SECOND
from sacbus.scenario import (
    Mark,
    NodeIs,
    Pause,
    Poll,
    Raw,
    Result,
    Scenario,
    Send,
    Step,
    run,
)
from sacbus.trace.records import Mark as Marked
from sacbus.trace.records import Outcome as Told
from tests.scenario.stage import failures, played, scenario


def marks(result: Result) -> list[tuple[str, float]]:
    """Marks in a recording with their times in ms."""
    assert result.recording is not None
    found = [record for record in result.recording if isinstance(record, Marked)]
    return [(record.text, record.when / MS) for record in found]


def order(file: Path, text: str) -> list[tuple[str, float]]:
    return marks(run(scenario(file, text), record=BytesIO()))


def test_a_step_begins_when_the_one_above_it_is_over(file: Path) -> None:
    text = """
        [[step]]
        wait = "5 ms"
        [[step]]
        mark = "a"
        [[step]]
        mark = "b"
        wait = "2 ms"
        """
    assert order(file, text) == [("a", 5), ("b", 7)]


def test_a_step_at_a_time_keeps_waiting_only_those_below_it(file: Path) -> None:
    text = """
        [[step]]
        at = "10 ms"
        mark = "a"
        [[step]]
        mark = "b"
        [[step]]
        at = "3 ms"
        mark = "c"
        [[step]]
        mark = "d"
        wait = "1 ms"
        """
    assert order(file, text) == [("c", 3), ("d", 4), ("a", 10), ("b", 10)]


def test_a_step_after_another_by_its_name_or_after_an_event(file: Path) -> None:
    text = """
        [[step]]
        name = "go"
        send = "10m4v600"
        [[step]]
        wait = "1 s"
        [[step]]
        after = "go"
        mark = "sent"
        [[step]]
        after = { node = 10, state = "STANDBY", within = "1 s" }
        mark = "done"
        """
    (sent, done) = order(file, text)
    assert (sent[0], done[0]) == ("sent", "done")
    assert sent[1] == pytest.approx(4.565, abs=0.001)
    assert done[1] > sent[1] + 1


def test_what_an_event_is_waited_for_in_vain_is_told_and_the_step_not_done(file: Path) -> None:
    text = """
        [[step]]
        after = { node = 10, state = "CRUISE", within = "5 ms" }
        send = "10m400"
        [[step]]
        expect = { acks = 0 }
        """
    assert failures(file, text) == [
        "line 5: expected node 10: state CRUISE within 5 ms, got state STANDBY, at 0.005000 s"
    ]


def test_groups_are_repeated_and_done_for_each_node(file: Path) -> None:
    text = """
        [[step]]
        repeat = 2
        each = "10,11"
          [[step.step]]
          wait = "1 ms"
          [[step.step]]
          mark = "{round}-{node}"
        """
    assert order(file, text) == [("1-10", 1), ("1-11", 2), ("2-10", 3), ("2-11", 4)]


def test_a_group_is_over_with_its_last_step(file: Path) -> None:
    text = """
        [[step]]
        name = "both"
        at = "1 ms"
          [[step.step]]
          wait = "1 ms"
          [[step.step]]
          wait = "1 ms"
        [[step]]
        at = "0 s"
        mark = "first"
        [[step]]
        after = "both"
        mark = "last"
        """
    assert order(file, text) == [("first", 0), ("last", 3)]


def test_a_line_must_come_to_its_outcome_and_the_rest_is_not_sent(file: Path) -> None:
    text = """
        [[step]]
        send = ["10V10", "99V10", "10V20"]
        outcome = "ack"
        """
    # Who sends to nobody is told before anything is played, unless that is what is expected.
    with pytest.raises(ValueError, match=r"expected nodes of bus 'bus' \(10-11\), got 99"):
        played(file, text)
    result = played(file, text.replace('"ack"', '"no answer"'))
    (failure,) = result.failures
    assert (failure.expected, failure.got) == ("'10V10' to end in no answer", "ack")
    assert result.counts["bus"]["acks"] == 1


def test_polling_goes_on_beside_other_steps_until_the_end(file: Path) -> None:
    text = """
        [[step]]
        send = ["10", "11"]
        every = "20 ms"
        [[step]]
        wait = "1 s"
        [[step]]
        expect = { acks = 50 }
        """
    assert failures(file, text) == []


def test_polling_for_a_time_is_waited_for(file: Path) -> None:
    text = """
        [[step]]
        send = ["10", "11"]
        every = "20 ms"
        for = "1 s"
        [[step]]
        expect = { acks = 50 }
        """
    assert failures(file, text) == []
    assert played(file, text).ended == SECOND


def test_polling_is_over_with_the_answer_to_its_last_line(file: Path) -> None:
    text = """
        [[step]]
        send = "10"
        every = "10 ms"
        for = "12 ms"
        [[step]]
        expect = { acks = 2 }
        [[step]]
        expect = { silence = "50 ms" }
        """
    assert failures(file, text) == []


@pytest.mark.parametrize(("lasting", "lines"), [(1, 1), (19, 2), (20, 2), (21, 3)])
def test_polling_sends_the_lines_that_are_due_before_its_time_is_over(
    lasting: int, lines: int
) -> None:
    poll = Poll(("10",), 10 * MS, lasting * MS)
    result = run(Scenario("poll", (Configuration(nodes=(10,)),), (Step(poll),)))
    assert result.counts["bus"]["acks"] == lines


def test_polling_faster_than_the_line_waits_for_each_answer() -> None:
    poll = Poll(("10", "11"), MS, SECOND)
    result = run(Scenario("fast", (Configuration(nodes=(10, 11)),), (Step(poll),)))
    assert result.passed
    assert 150 < result.counts["bus"]["acks"] < 300


def test_what_polling_fails_of_is_told_some_times_only() -> None:
    poll = Poll(("99",), 100 * MS, 2 * SECOND, "nak")
    result = run(Scenario("nobody", (Configuration(nodes=(10,)),), (Step(poll),)))
    assert [one.expected for one in result.failures] == ["poll '99' to end in nak"] * 3
    assert result.failures[-1].got.endswith("and is not told of again")


def test_what_is_not_over_by_the_end_has_failed(file: Path) -> None:
    head = 'end = "1 s"\n[[bus]]\n[[bus.nodes]]\naddress = 10\n'
    text = (
        '[[step]]\nexpect = { node = 10, position = 1, within = "2 s" }\n[[step]]\nwait = "1 s"\n'
    )
    assert failures(file, text, head) == [
        (
            "line 5: expected node 10: position 1 within 2 s to be over by the end, "
            "got that it was not, at 1.000000 s"
        ),
        "line 7: expected the pause to be over by the end, got that it was not, at 1.000000 s",
    ]


def test_it_plays_to_its_end_even_if_all_steps_are_over(file: Path) -> None:
    head = 'end = "1 s"\n[[bus]]\n[[bus.nodes]]\naddress = 10\n'
    assert played(file, '[[step]]\nmark = "x"\n', head).ended == SECOND


def test_raw_bytes_are_over_when_they_are_out() -> None:
    bytes_ = bytes.fromhex("02 0a 01 6d 31 03 00 00")
    steps = (Step(Raw(bytes_)), Step(Pause()))
    result = run(Scenario("raw", (Configuration(nodes=(10,)),), steps))
    assert result.ended == 8 * 10 * SECOND // 38_400


def test_power_turns_and_pins_reach_the_nodes(file: Path) -> None:
    text = """
        [[step]]
        power = { node = 10, on = false }
        [[step]]
        expect = { node = 10, state = "OFF" }
        [[step]]
        power = { node = 10, on = true }
        [[step]]
        expect = { node = 10, state = "STANDBY", within = "2 s" }
        [[step]]
        send = "11EnF"
        [[step]]
        turn = { node = 11, detents = -3 }
        [[step]]
        expect = { node = 11, position = -3, within = "1 s" }
        [[step]]
        send = "11m10s"
        [[step]]
        pin = { node = 11, sync = 0 }
        [[step]]
        expect = { node = 11, position = 7, within = "1 s" }
        """
    assert failures(file, text) == []


def test_faults_are_put_on_and_lifted_by_the_names_of_steps(file: Path) -> None:
    text = """
        [[step]]
        name = "gone"
        fault = { dead = 11 }
        [[step]]
        send = "11V10"
        outcome = "no answer"
        [[step]]
        lift = "gone"
        [[step]]
        send = "11V10"
        """
    assert failures(file, text) == []
    assert len(failures(file, text.replace("lift", "mark"))) == 1


def test_an_expectation_that_failed_is_marked_in_the_recording(file: Path) -> None:
    text = """
        [[step]]
        mark = "here"
        [[step]]
        name = "there"
        expect = { node = 10, position = 40, within = "5 ms" }
        [[step]]
        expect = { node = 11, position = 0 }
        """
    result = run(scenario(file, text), record=BytesIO())
    assert result.recording is not None
    found = [record for record in result.recording if isinstance(record, Marked)]
    assert [(one.when // MS, one.text, one.details) for one in found] == [
        (0, "here", {}),
        (
            5,
            "expected node 10: position 40 within 5 ms, got position 0, state STANDBY",
            {"step": "there"},
        ),
    ]


def test_what_became_of_each_line_is_in_the_recording_in_a_word(file: Path) -> None:
    text = """
        [[step]]
        send = ["10V10", "0V10"]
        [[step]]
        fault = { dead = 11 }
        [[step]]
        send = "11V10"
        outcome = "no answer"
        """
    result = run(scenario(file, text), record=BytesIO())
    assert result.recording is not None
    found = [record for record in result.recording if isinstance(record, Told)]
    assert [(one.node, one.body, one.result) for one in found] == [
        (10, b"V10", "ack"),
        (0, b"V10", "sent"),
        (11, b"V10", "no answer"),
    ]
    assert found[-1].attempts > 1


def test_a_queue_file_comes_into_the_queue(file: Path) -> None:
    rows = Path(__file__).parents[1] / "data" / "companion-queue.txt"
    (file.parent / "q.csv").write_bytes(rows.read_bytes())
    text = """
        [[step]]
        queue = { node = 10, file = "q.csv" }
        [[step]]
        send = "10X5"
        [[step]]
        expect = { node = 10, position = 200, state = "STANDBY", within = "1 min" }
        """
    assert failures(file, text) == []


def test_two_buses_are_played_on_one_clock(file: Path) -> None:
    node = "nodes = [{ address = 10 }]"
    head = f'[[bus]]\nname = "left"\n{node}\n[[bus]]\nname = "right"\n{node}\n'
    text = """
        [[step]]
        send = "10m4"
        [[step]]
        bus = "right"
          [[step.step]]
          send = "10m8"
          [[step.step]]
          expect = { node = 10, position = 8, within = "1 s" }
        [[step]]
        expect = { node = 10, position = 4 }
        [[step]]
        bus = "right"
        expect = { node = 10, position = 4 }
        """
    (failure,) = failures(file, text, head)
    assert "position 4, got position 8" in failure


def test_a_failure_shows_the_last_packets_and_the_nodes(file: Path) -> None:
    text = '[[step]]\nsend = "10m400v120"\n[[step]]\nexpect = { node = 10, position = 7 }\n'
    (failure,) = played(file, text).failures
    assert failure.packets == (
        "0.000000 s  mother: to 10 'm400v120', move 400 full steps at 120 RPM",
        "0.004345 s  10: ACK to 1",
    ) or failure.packets[0].startswith("0.000000 s  mother: to 10 'm400v120', move 400 full")
    assert failure.states[0].startswith("node 10: ")


def test_a_scenario_without_steps_is_over_at_once() -> None:
    assert run(Scenario("nothing", (Configuration(),), ())).ended == 0


def test_the_values_of_python_are_those_of_toml(file: Path) -> None:
    read = scenario(
        file, '[[step]]\nsend = "10m400"\n[[step]]\nexpect = { node = 10, state = "OFF" }\n'
    )
    assert [step.does for step in read.steps] == [Send(("10m400",)), NodeIs((10,), state="OFF")]
    assert Mark("x") == Mark("x")
