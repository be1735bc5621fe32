"""Scenarios on lines that speak something else than SAC: words and bytes out, what is said in."""

from __future__ import annotations

import json
from io import BytesIO
from pathlib import Path
from textwrap import dedent

import pytest

from sacbus.configuration import check
from sacbus.kernel import Kernel, LineRate
from sacbus.links import Line, LinkError
from sacbus.mother.masters import Came
from sacbus.mother.superstepper_words import COMMANDS
from sacbus.scenario import run, run_on_link, run_real
from sacbus.scenario.bench import far_bench
from tests.mother.third_party import install
from tests.scenario.stage import failures, mistakes, played, scenario
from tests.serving import served

HEAD = '[[bus]]\n[[bus.nodes]]\naddresses = "0,3"\nkind = "ss-mst67"\n'
SAC = '[[bus]]\n[[bus.nodes]]\naddresses = "10"\n'
NINE = HEAD + 'jmp2 = "closed"\n'


def test_bytes_move_a_module_and_its_answer_is_seen(tmp_path: Path) -> None:
    text = """
        [[step]]
        raw = "19 04 0f a0 00 0a"
        [[step]]
        expect = { answer = "ack", from = 3, within = "20 ms" }
        [[step]]
        expect = { node = 3, position = 10, state = "STANDBY", within = "2 s" }
        [[step]]
        expect = { node = 0, position = 0 }
    """
    assert failures(tmp_path / "a.toml", text, HEAD) == []


def test_what_a_module_has_given_up_is_given_up_by_who_watches(tmp_path: Path) -> None:
    text = """
        [[step]]
        raw = "1f 00"
        [[step]]
        expect = { answer = "nak", from = 3, within = "40 ms" }
        [[step]]
        name = "look"
        wait = "20 ms"
        [[step]]
        after = "look"
        expect = { pattern = "00 06", to = 3, within = "200 ms" }
        [[step]]
        at = "100 ms"
        raw = "1f 00"
        [[step]]
        at = "150 ms"
        raw = "1f 00 06"
    """
    assert failures(tmp_path / "a.toml", text, HEAD) == []


@pytest.mark.parametrize(("raw", "moves"), [("^04 ^18 00 0f a0", True), ("1c 18 00 0f", False)])
def test_ninth_bits_begin_messages(tmp_path: Path, raw: str, *, moves: bool) -> None:
    text = f"""
        [[step]]
        raw = "{raw}"
        [[step]]
        expect = {{ node = 3, velocity = {-150 if moves else 0}, within = "60 ms" }}
    """
    result = played(tmp_path / "a.toml", text, NINE)
    assert result.passed, result.failures


WORDS = """
    [[step]]
    send = ["3 write 0x10 66", "3 microsteps 8", "3 move-steps 80 --speed 4000 --ccw"]
    [[step]]
    at = "0 s"
    name = "third"
    expect = { answer = "ack", from = 3, count = 3, within = "5 s" }
    [[step]]
    after = "third"
    send = "3 read 0x10"
    says = "66 (0x42)"
    [[step]]
    send = "9 status"
    outcome = "no answer"
    [[step]]
    send = "9 move-steps 1 --speed 9"
    outcome = "no answer"
    [[step]]
    expect = { acks = 4, naks = 0, timeouts = 4, retries = 2 }
    [[step]]
    expect = { node = 3, acks = 4 }
    """

THERE = """
    [[step]]
    expect = { node = 3, position = -10, state = "STANDBY", within = "5 s" }
    [[step]]
    send = ["3 status", "3 status"]
    says = "at rest"
    """

MODES = pytest.mark.parametrize("head", [HEAD, NINE], ids=["8-bit", "9-bit"])


@MODES
def test_modules_are_spoken_to_in_words(tmp_path: Path, head: str) -> None:
    assert failures(tmp_path / "a.toml", WORDS + THERE, head) == []


@MODES
@pytest.mark.slow
def test_words_are_the_same_in_real_time(tmp_path: Path, head: str) -> None:
    result = run_real(scenario(tmp_path / "a.toml", WORDS + THERE, head))
    assert [str(one) for one in result.failures] == []


@pytest.mark.slow
def test_words_go_over_a_link(tmp_path: Path) -> None:
    one = scenario(tmp_path / "a.toml", WORDS, HEAD)
    with served("--ephemeral", "--kind", "ss-mst67", "--nodes", "0,3", "--baud", "9600") as sacbus:
        result = run_on_link(one, sacbus.link)
    assert [str(failure) for failure in result.failures] == []


@pytest.mark.slow
def test_words_of_9_bits_take_a_link_that_can_mark_them(tmp_path: Path) -> None:
    one = scenario(tmp_path / "a.toml", WORDS, NINE)
    model = ("--kind", "ss-mst67", "--set", "jmp2=closed", "--nodes", "0,3", "--baud", "9600")
    port = str(tmp_path / "port")
    with served("--ephemeral", *model, "--pty", port, "--rfc2217", "0") as sacbus:
        result = run_on_link(one, sacbus.ready["links"][1]["url"])
        with pytest.raises(LinkError, match="no ninth bits there"):
            run_on_link(one, port)
    assert [str(failure) for failure in result.failures] == []


UNMARKED = """
    [[step]]
    raw = "1f 00"
    [[step]]
    expect = { silence = "100 ms" }
    [[step]]
    send = "3 status"
    says = "at rest"
    """


def test_bytes_are_not_marked_unless_they_are_said_to_be(tmp_path: Path) -> None:
    assert failures(tmp_path / "a.toml", UNMARKED, NINE) == []
    (told,) = failures(tmp_path / "a.toml", UNMARKED.replace("1f", "^1f"), NINE)
    assert "expected silence" in told


@pytest.mark.slow
def test_nor_are_they_in_real_time_or_on_a_link(tmp_path: Path) -> None:
    one = scenario(tmp_path / "a.toml", UNMARKED, NINE)
    assert [str(failure) for failure in run_real(one).failures] == []
    model = ("--kind", "ss-mst67", "--set", "jmp2=closed", "--nodes", "0,3", "--baud", "9600")
    with served("--ephemeral", *model, "--rfc2217", "0") as sacbus:
        result = run_on_link(one, sacbus.ready["links"][0]["url"])
    assert [str(failure) for failure in result.failures] == []


@pytest.mark.slow
def test_bytes_alone_take_a_link_that_marks_them_too(tmp_path: Path) -> None:
    one = scenario(tmp_path / "a.toml", '[[step]]\nraw = "1f 00"\n', NINE)
    model = ("--kind", "ss-mst67", "--set", "jmp2=closed", "--nodes", "0,3", "--baud", "9600")
    port = str(tmp_path / "port")
    with (
        served("--ephemeral", *model, "--pty", port),
        pytest.raises(LinkError, match="no ninth bits there"),
    ):
        run_on_link(one, port)


def test_lines_of_each_are_polled_in_turn(tmp_path: Path) -> None:
    text = """
        [[step]]
        each = "all"
        send = "{node} status"
        every = "40 ms"
        for = "1 s"
        [[step]]
        expect = { acks = 25, timeouts = 0 }
        [[step]]
        expect = { node = 3, acks = 12 }
        """
    assert failures(tmp_path / "a.toml", text, HEAD) == []


def test_what_an_answer_brings_is_told_and_must_be_as_expected(tmp_path: Path) -> None:
    text = """
        [[step]]
        name = "look"
        send = "3 read 0x03 --word"
        says = "31999 (0x7cff)"
        [[step]]
        send = "3 stop"
        outcome = "nak"
        """
    result = played(tmp_path / "a.toml", text, HEAD)
    look, stop = result.failures
    assert look.expected == "'3 read 0x03 --word' to be answered '31999 (0x7cff)'"
    assert (look.got, stop.got) == ("ack (32000 (0x7d00))", "ack")
    assert look.packets == (
        "0.000000 s  mother: to 3 '02 03', read the word at RAM 0x03",
        "0.003225 s  3: ACK 32000 to master",
    )


def test_a_mere_acknowledge_says_ack_as_it_is_printed_with_what_the_module_has_seen(
    tmp_path: Path,
) -> None:
    text = """
        [[step]]
        send = ["3 stop", "3 write 0x10 1"]
        says = "ACK"
        [[step]]
        send = "3 stop"
        says = "at rest"
        [[step]]
        raw = "19 04 0f a0 00 0a ff ff ff ff ff"
        [[step]]
        wait = "100 ms"
        send = "3 stop"
        says = "ACK (it has seen: overrun)"
        """
    (told,) = failures(tmp_path / "a.toml", text, HEAD)
    assert "expected '3 stop' to be answered 'at rest', got ack, at" in told


def test_a_polled_answer_is_told_with_what_it_brings(tmp_path: Path) -> None:
    text = '[[step]]\nsend = "3 status"\nevery = "1 s"\nfor = "10 ms"\noutcome = "nak"\n'
    (told,) = failures(tmp_path / "a.toml", text, HEAD)
    assert "expected poll '3 status' to end in nak, got ack (at rest)" in told


def test_a_message_is_repeated_after_a_nak_but_not_a_number_of_steps_after_silence(
    tmp_path: Path,
) -> None:
    lost = """
        [[step]]
        name = "gone"
        fault = { dead = 3 }
        [[step]]
        send = "3 move-steps 10 --speed 4000"
        outcome = "no answer"
        [[step]]
        expect = { timeouts = 1, retries = 0 }
        [[step]]
        send = "3 move-steps 10 --speed 4000"
        outcome = "no answer"
        accept_duplicates = true
        [[step]]
        expect = { timeouts = 4, retries = 2 }
        """
    assert failures(tmp_path / "a.toml", lost, HEAD) == []


def test_what_became_of_lines_is_in_the_recording(tmp_path: Path) -> None:
    sink = BytesIO()
    text = '[[step]]\nsend = ["3  status", "9 stop"]\noutcome = "any"\n'
    assert run(scenario(tmp_path / "a.toml", text, HEAD), record=sink).passed
    stored = [json.loads(line) for line in sink.getvalue().splitlines()]
    told = [one for one in stored if one.get("is") == "outcome"]
    assert [(one["node"], one["body"], one["result"], one["attempts"]) for one in told] == [
        (3, "status", "ack", 1),
        (9, "stop", "no answer", 3),
    ]


def test_bytes_are_played_where_the_master_is_broken_and_lines_are_refused_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, "sac = nowhere:MASTER")
    monkeypatch.syspath_prepend(str(tmp_path))
    raw = '[[step]]\nraw = "02"\n[[step]]\nexpect = { acks = 0 }\n'
    assert failures(tmp_path / "a.toml", raw, SAC) == []
    assert mistakes(tmp_path / "a.toml", SAC + '[[step]]\nsend = "10"\n') == [
        (
            "step[0].send: the master of 'sac' (nowhere:MASTER) cannot be loaded: "
            "ModuleNotFoundError(\"No module named 'nowhere'\"); mend or uninstall its package, "
            "line 5, or give bytes, as raw"
        )
    ]


def test_a_line_that_was_gone_before_the_first_line_is_gone_for_that_too(tmp_path: Path) -> None:
    one = scenario(tmp_path / "a.toml", '[[step]]\nraw = "02"\n', SAC)
    bench = far_bench("bus", Kernel(), check(one.buses[0]), Line("far"), LineRate(), 0)
    bench.lose("it is gone")
    came: list[Came] = []
    bench.master.ask("10", came.append)
    assert [str(one) for one in came] == ["lost (it is gone)"]


def test_wrong_words_are_named_before_anything_is_played(tmp_path: Path) -> None:
    text = """
        [[step]]
        send = ["3 stop", "3 halt", "3 home --speed fast"]
        [[step]]
        send = "3 stop"
        says = "ACK"
        outcome = "any"
        [[step]]
        send = "3 stop"
        says = "at rest"
        every = "1 s"
        [[step]]
        queue = { node = 3, file = "queue.csv" }
        """
    assert mistakes(tmp_path / "a.toml", HEAD + dedent(text)) == [
        (
            f"step[0].send: line '3 halt': expected a command ({', '.join(COMMANDS)}), "
            "got 'halt', line 7, correct it"
        ),
        (
            "step[0].send: line '3 home --speed fast': --speed: expected a number from 0 to 65535, "
            "got 'fast', line 7, correct it"
        ),
        "step[1].says: expected only with outcome ack, got any, line 10, remove it",
        "step[2].says: expected only without every, line 14, remove it",
        (
            "step[3].queue: expected a bus that speaks sac, as queue files do, got superstepper, "
            "line 17, leave it out"
        ),
    ]
