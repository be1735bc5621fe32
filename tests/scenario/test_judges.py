"""Each kind of expectation: one that is met, and one that is not, with all that is said of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.kernel import MS, SECOND
from tests.scenario.stage import failures, played

MOVES = '[[step]]\nsend = "10m400v120"\n'


# ---- nodes --------------------------------------------------------------------------------------


def test_a_position_and_a_state_are_waited_for(file: Path) -> None:
    text = '[[step]]\nexpect = { node = 10, position = 400, state = "STANDBY", within = "3 s" }\n'
    result = played(file, MOVES + text)
    assert result.passed
    # The end of the command is seen at its very instant, not at the next look.
    assert result.ended % 1_000_000


def test_a_position_that_does_not_come_is_told_with_what_there_is(file: Path) -> None:
    text = '[[step]]\nexpect = { node = 10, position = 401, within = "3 s" }\n'
    assert failures(file, MOVES + text) == [
        (
            "line 6: expected node 10: position 401 within 3 s, got position 400, state STANDBY, "
            "at 3.005111 s"
        )
    ]


def test_without_a_time_it_must_be_so_at_once(file: Path) -> None:
    assert failures(
        file, '[[step]]\nexpect = { node = "all", state = "CRUISE", velocity = 10 }\n'
    ) == [
        (
            "line 4: expected nodes 10-11: velocity 10, state CRUISE, got node 10: velocity 0, "
            "state STANDBY; node 11: velocity 0, state STANDBY, at 0.000000 s"
        )
    ]


def test_one_velocity_is_met_within_half_an_rpm_and_bounds_exactly(file: Path) -> None:
    text = """
        [[step]]
        send = "10m0v130"
        [[step]]
        expect = { node = 10, velocity = 130, state = "CRUISE", within = "2 s" }
        [[step]]
        expect = { node = 10, velocity = [129, 129.5], within = "10 ms" }
        """
    (failure,) = failures(file, text)
    assert "velocity 129 to 129.5 within 10 ms, got velocity 130.039, state CRUISE" in failure


def test_what_must_last_fails_as_soon_as_it_does_not(file: Path) -> None:
    text = '[[step]]\nexpect = { node = 10, state = "STANDBY", for = "1 s" }\n'
    assert played(file, text).ended == 1_000_000_000
    (failure,) = failures(file, MOVES + text)
    assert failure.startswith(
        "line 6: expected node 10: state STANDBY for 1 s, got state ACCEL, at 0.0"
    )


def test_pins_are_looked_at_by_their_names(file: Path) -> None:
    text = """
        [[step]]
        pin = { node = 10, sync = 0 }
        [[step]]
        expect = { node = 10, pin = { sync = 0, estop = 1 } }
        [[step]]
        expect = { node = 11, pin = { sync = 0 }, within = "1 ms" }
        """
    assert failures(file, text) == [
        "line 9: expected node 11: sync 0 within 1 ms, got sync 1, state STANDBY, at 0.001000 s"
    ]


# ---- terminals ----------------------------------------------------------------------------------


def test_what_a_terminal_shows_counts_from_the_last_expectation_on(file: Path) -> None:
    text = """
        [[step]]
        type = { node = 10, keys = "$H\\r" }
        [[step]]
        expect = { node = 10, shown = "$H" }
        [[step]]
        expect = { node = 10, shown = "$H", within = "5 ms" }
        """
    (failure,) = failures(file, text)
    assert failure.startswith("line 9: expected terminal of node 10 shows '$H' within 5 ms, got '")
    assert failure.endswith("at 0.005000 s")


# ---- the line -----------------------------------------------------------------------------------


def test_packets_are_seen_by_body_pattern_and_addresses(file: Path) -> None:
    text = """
        [[step]]
        name = "spy"
        at = "0 s"
        expect = { packet = "m400", from = 1, to = 10, within = "10 ms" }
        [[step]]
        at = "0 s"
        expect = { pattern = "m[0-9]+", within = "10 ms" }
        [[step]]
        at = "0 s"
        expect = { answer = "ack", from = 10, count = 2, within = "20 ms" }
        [[step]]
        at = "0 s"
        expect = { pattern = "m", within = "10 ms" }
        [[step]]
        at = "0 s"
        send = ["10m400", "10m1"]
        """
    assert failures(file, text) == [
        "line 15: expected packet like 'm' within 10 ms, got none and 4 others, at 0.010000 s"
    ]


def test_a_packet_to_another_one_is_not_it(file: Path) -> None:
    text = """
        [[step]]
        at = "0 s"
        expect = { packet = "m400", to = 11, within = "10 ms" }
        [[step]]
        at = "0 s"
        send = "10m400"
        """
    assert failures(file, text) == [
        "line 5: expected packet 'm400' to 11 within 10 ms, got none and 2 others, at 0.010000 s"
    ]


def test_who_is_dead_breaks_no_silence(file: Path) -> None:
    head = "[[bus]]\n[[bus.nodes]]\naddress = 10\nsoft_ops = true\n"
    text = """
        [[step]]
        send = "10m4"
        [[step]]
        FAULT
        [[step]]
        expect = { silence = "1 s" }
        """
    assert failures(file, text.replace("FAULT", "fault = { dead = 10 }"), head) == []
    assert len(failures(file, text.replace("FAULT", 'mark = "x"'), head)) == 1


def test_soft_ops_are_packets_to_all(file: Path) -> None:
    head = "[[bus]]\n[[bus.nodes]]\naddress = 10\nsoft_ops = true\n"
    text = """
        [[step]]
        send = "10m4"
        [[step]]
        expect = { soft_op = "start", from = 10, within = "10 ms" }
        [[step]]
        expect = { soft_op = "end", from = 10, within = "1 s" }
        [[step]]
        expect = { soft_op = "end", from = 10, within = "1 s" }
        """
    (failure,) = failures(file, text, head)
    assert failure.startswith("line 12: expected packet '\\x12' from 10 to 0 within 1 s, got none")


def test_silence_is_broken_by_what_begins_or_goes_on(file: Path) -> None:
    text = """
        [[step]]
        expect = { silence = "1 s" }
        [[step]]
        at = "0 s"
        expect = { silence = "10 ms", from = 11 }
        [[step]]
        at = "1001 ms"
        expect = { silence = "1 ms" }
        [[step]]
        at = "1 s"
        send = "10m400"
        """
    assert failures(file, text) == [
        "line 10: expected silence for 1 ms, got 10 bytes of mother, at 1.002604 s"
    ]


# ---- counts -------------------------------------------------------------------------------------


def test_counts_are_mothers_and_the_lines(file: Path) -> None:
    text = """
        [[step]]
        send = "99V10"
        outcome = "no answer"
        [[step]]
        expect = { retries = 2, timeouts = 3, collisions = 0, naks = 0, warnings = 0 }
        [[step]]
        expect = { node = 10, retries = ">= 1", acks = 0 }
        """
    (failure,) = failures(file, text)
    assert failure.startswith(
        "line 10: expected node 10: retries at least 1, acks 0, got retries 0, acks 0"
    )


def test_collisions_are_counted(file: Path) -> None:
    text = """
        [[step]]
        fault = { babble = { pattern = "55", every = "1 ms" } }
        [[step]]
        send = "10V10"
        outcome = "any"
        [[step]]
        expect = { collisions = 0 }
        """
    (failure,) = failures(file, text)
    assert "expected collisions 0, got collisions " in failure


def test_warnings_are_counted_and_the_last_are_shown(file: Path) -> None:
    text = """
        [[step]]
        send = "10m1000v3000a1d1"
        [[step]]
        expect = { warnings = 0 }
        """
    (failure,) = played(file, text).failures
    assert failure.got == "warnings 2"
    assert "node 10: warning" in failure.states[0]


@pytest.mark.parametrize("line", ["10hello", "10m400q9z"])
def test_a_line_that_a_node_refuses_counts_as_a_warning(file: Path, line: str) -> None:
    text = f"""
        [[step]]
        send = "{line}"
        [[step]]
        expect = {{ warnings = 0, within = "1 s" }}
        """
    (failure,) = played(file, text).failures
    assert "node 10: refused" in failure.states[0]


# ---- motion -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("steps", "deviates"), [(400, False), (100, True)])
def test_the_path_of_axes_is_held_against_a_straight_line(
    file: Path, steps: int, deviates: bool
) -> None:
    text = f"""
        [[step]]
        send = ["10m400v120s", "11m{steps}v120s", "0y"]
        [[step]]
        expect = {{ node = "all", state = "STANDBY", within = "5 s" }}
        [[step]]
        expect = {{ node = "all", start_skew = "0 s" }}
        [[step]]
        expect = {{ node = "all", deviation = 1 }}
        """
    found = failures(file, text)
    if deviates:
        assert len(found) == 1
        assert found[0].startswith(
            "line 11: expected nodes 10-11: deviation at most 1 steps, got 51."
        )
    else:
        assert found == []


def test_a_start_skew_is_told_with_who_was_late(file: Path) -> None:
    text = """
        [[step]]
        send = ["10m400", "11m400"]
        [[step]]
        expect = { node = "all", state = "CRUISE", within = "5 s" }
        [[step]]
        expect = { node = "all", start_skew = "1 ms" }
        """
    (failure,) = failures(file, text)
    assert "start skew at most 1 ms, got 5.030832 ms (10 +0 s, 11 +5.030832 ms)" in failure


def test_axes_that_never_moved_have_no_skew_and_no_path(file: Path) -> None:
    text = """
        [[step]]
        expect = { node = "all", start_skew = "1 ms" }
        [[step]]
        expect = { node = "all", deviation = 1 }
        """
    assert failures(file, text) == [
        (
            "line 5: expected nodes 10-11: start skew at most 1 ms, got one that has not moved, "
            "at 0.000000 s"
        ),
        "line 7: expected nodes 10-11: deviation at most 1 steps, got no motion, at 0.000000 s",
    ]


# ---- looks --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "deed",
    [
        'send = "10m400"',
        'type = { node = 10, keys = "m400\\r" }',
        'fault = { babble = { pattern = "02 0a 01 6d 31 30 30 03 00 00", every = "1 s" } }',
    ],
)
def test_a_node_that_rests_is_seen_to_move_as_soon_as_it_does(file: Path, deed: str) -> None:
    text = f"""
        [[step]]
        at = "10 s"
        {deed}
        [[step]]
        at = "0 s"
        expect = {{ node = 10, state = "ACCEL", within = "20 s" }}
        """
    result = played(file, text)
    assert result.passed
    assert 10 * SECOND < result.ended < 10 * SECOND + 10 * MS


def test_a_power_cycle_is_seen_to_its_end(file: Path) -> None:
    text = """
        [[step]]
        at = "10 s"
        power = { node = 10, on = false }
        [[step]]
        power = { node = 10, on = true }
        [[step]]
        at = "0 s"
        expect = { node = 10, state = "BOOT", within = "20 s" }
        [[step]]
        expect = { node = 10, state = "STANDBY", within = "2 s" }
        """
    assert played(file, text).ended == 11 * SECOND
