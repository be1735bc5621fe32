"""The same scenario in virtual time, in real time over a pty, and on a line behind a link."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import pytest

from sacbus.kernel import SECOND
from sacbus.links import LinkError
from sacbus.scenario import Scenario, read, run, run_on_link, run_real
from tests.scenario.stage import HEAD, scenario
from tests.serving import served

MOVE = """
    [[step]]
    send = ["10m40v300s", "11m40v300s", "0y"]
    [[step]]
    name = "there"
    expect = { node = "all", position = 40, state = "STANDBY", within = "5 s" }
    [[step]]
    expect = { retries = 0, naks = 0, acks = 2, collisions = 0 }
    """

POLL = '[[step]]\nat = "0 s"\nsend = "10"\nevery = "5 ms"\n'

POLL_FOR = """
    [[step]]
    send = "10"
    every = "100 ms"
    for = "1 s"
    [[step]]
    expect = { silence = "300 ms" }
    [[step]]
    expect = { acks = 10 }
    """

LINE = """
    [[step]]
    send = ["10m40v300s", "11m40v300s", "0y"]
    [[step]]
    at = "0 s"
    expect = { answer = "ack", from = 11, within = "5 s" }
    [[step]]
    send = "99V10"
    outcome = "no answer"
    [[step]]
    expect = { retries = 2, timeouts = 3, acks = 2 }
    [[step]]
    raw = "02 0a 01 03 00 00"
    [[step]]
    expect = { answer = "ack", from = 10, within = "5 s" }
    """


def recorded(one: Scenario) -> bytes:
    sink = BytesIO()
    assert run(one, record=sink).passed
    return sink.getvalue()


def test_two_runs_give_the_same_recording_byte_for_byte(file: Path) -> None:
    text = (
        MOVE
        + '[[step]]\nname = "x"\nfault = { bit_errors = 0.001 }\n'
        + """
    [[step]]
    send = ["10", "11"]
    outcome = "any"
    every = "20 ms"
    for = "2 s"
    """
    )
    one = scenario(file, text)
    first = recorded(one)
    assert first == recorded(one)
    (other,) = read(file, seed=1)
    assert first != recorded(other)


def test_a_recording_is_there_for_who_asks_and_where_it_is_needed(file: Path) -> None:
    one = scenario(file, MOVE)
    assert run(one).recording is None
    sink = BytesIO()
    recording = run(one, record=sink).recording
    assert recording is not None
    assert recording.track(10).position(5 * SECOND) == 40
    assert sink.getvalue().startswith(b'{"sacbus":"recording"')


def test_progress_is_told_in_virtual_time(file: Path) -> None:
    told: list[int] = []
    run(scenario(file, '[[step]]\nwait = "10 s"\n'), progress=told.append)
    assert told == sorted(told)


@pytest.mark.slow
def test_in_real_time_mother_is_a_program_at_a_pty(file: Path) -> None:
    sink = BytesIO()
    result = run_real(scenario(file, MOVE), record=sink)
    assert result.failures == []
    assert b'"from":"link 1"' in sink.getvalue()


@pytest.mark.slow
def test_in_real_time_all_buses_have_one_clock(file: Path) -> None:
    text = """
        [[bus]]
        name = "other"
        pace = false
        [[bus.nodes]]
        addresses = "10"
        [[step]]
        bus = "other"
        send = ["10V1", "10m20v300s"]
        [[step]]
        send = "10m20v300"
        [[step]]
        bus = "other"
        expect = { node = 10, state = "SYNC" }
        [[step]]
        expect = { node = 10, position = 20, state = "STANDBY", within = "5 s" }
        [[step]]
        bus = "other"
        send = ["0y", "99"]
        outcome = "any"
        [[step]]
        bus = "other"
        expect = { node = 10, position = 20, within = "5 s" }
        [[step]]
        bus = "other"
        power = { node = 10, on = false }
        [[step]]
        bus = "other"
        expect = { node = 10, state = "OFF" }
        """
    # Without that clock it would never be over by itself.
    head = 'end = "10 s"\n' + HEAD.replace("[[bus]]", "[[bus]]\nname = 'one'")
    result = run_real(scenario(file, text, head), speed=5)
    assert [str(one) for one in result.failures] == []


@pytest.mark.slow
def test_real_time_may_be_scaled_and_failures_are_the_same(file: Path) -> None:
    result = run_real(scenario(file, MOVE.replace("position = 40", "position = 41")), speed=5)
    (failure,) = result.failures
    assert (failure.step, failure.got) == (
        "there",
        "node 10: position 40, state STANDBY; node 11: position 40, state STANDBY",
    )


@pytest.mark.slow
def test_what_goes_wrong_while_it_is_played_comes_out(file: Path) -> None:
    sink = BytesIO()
    one = scenario(file, '[[step]]\nmark = "x"\n[[step]]\nwait = "1 h"\n' + POLL)
    with pytest.raises(ValueError, match="closed file"):
        run_real(one, record=sink, progress=lambda _now: sink.close())


@pytest.mark.slow
def test_on_a_link_the_line_is_all_there_is(file: Path) -> None:
    with served("--ephemeral", "--nodes", "10,11") as sacbus:
        result = run_on_link(scenario(file, LINE), sacbus.link)
    assert [str(one) for one in result.failures] == []
    assert result.counts["bus"]["retries"] == 2


@pytest.mark.slow
def test_on_a_link_polling_sends_as_many_lines_as_in_virtual_time(file: Path) -> None:
    one = scenario(file, POLL_FOR)
    assert run(one).failures == []
    with served("--ephemeral", "--nodes", "10,11") as sacbus:
        result = run_on_link(one, sacbus.link)
    assert [str(failure) for failure in result.failures] == []


@pytest.mark.slow
def test_a_link_that_cannot_be_had_is_an_error(file: Path) -> None:
    with pytest.raises(LinkError):
        run_on_link(scenario(file, LINE), str(file.parent / "nothing"))
