"""``sacbus run``: verdicts, statuses, and every mistake in one line each."""

from __future__ import annotations

import errno
import json
import os
import re
import shlex
import signal
import subprocess
import sys
from html import unescape
from itertools import pairwise
from pathlib import Path
from tempfile import gettempdir
from xml.etree import ElementTree as ET

import pytest

from sacbus.cli import run
from sacbus.trace import read
from tests.drawing import without_matplotlib
from tests.full_disk import needs_full_device, needs_full_disk
from tests.serving import PATIENCE, served, started

Captured = pytest.CaptureFixture[str]

PASSES = """
title = "a move"
[parameters]
steps = 40
[[bus]]
[[bus.nodes]]
address = 10
[[step]]
send = "10m{steps}v300"
[[step]]
expect = { node = 10, position = 40, state = "STANDBY", within = "2 s" }
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "x.toml"
    path.write_text(PASSES)
    return path


def test_what_passes_is_told_in_a_line(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file)]) == 0
    out, err = capsys.readouterr()
    assert out == f"passed {file}: a move, 0.682769 s\n"
    assert err == ""


def test_what_fails_is_told_with_time_expected_and_got_and_the_last_packets(
    file: Path, capsys: Captured
) -> None:
    assert run(["run", str(file), "--set", "steps=39"]) == 1
    out, err = capsys.readouterr()
    assert out.splitlines() == [
        f"FAILED {file}: a move, 2.004838 s",
        (
            f"  {file}:10: expected node 10: position 40, state STANDBY within 2 s, "
            "got position 39, state STANDBY, at 2.004838 s"
        ),
        "      0.000000 s  mother: to 10 'm39v300', move 39 full steps at 300 RPM",
        "      0.003796 s  10: ACK to 1",
        "      node 10: STANDBY at 39, 0 RPM",
    ]
    assert err == ""


def test_cases_have_results_of_their_own(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--set", "steps=[40,41]"]) == 1
    out, _ = capsys.readouterr()
    verdicts = [line for line in out.splitlines() if not line.startswith(" ")]
    assert [line.split(",")[0] for line in verdicts] == [
        f"passed {file}: a move [steps=40]",
        f"FAILED {file}: a move [steps=41]",
    ]


def test_the_first_that_fails_may_be_the_last(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--set", "steps=[41,40]", "-x"]) == 1
    assert "steps=40" not in capsys.readouterr().out


def test_a_word_chooses(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--set", "steps=[40,41]", "-k", "steps=40"]) == 0
    assert "steps=41" not in capsys.readouterr().out
    assert run(["run", str(file), "-k", "nothing"]) == 2
    assert capsys.readouterr().err == (
        "error: -k: no file, title or case has 'nothing' in it, see sacbus run --help\n"
    )


def test_mistakes_of_all_files_are_told_and_nothing_is_played(
    file: Path, tmp_path: Path, capsys: Captured
) -> None:
    wrong = tmp_path / "wrong.toml"
    wrong.write_text('[[bus]]\n[[step]]\nsend = "10m1"\n')
    missing = tmp_path / "missing.toml"
    assert run(["run", str(file), str(wrong), str(missing)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines() == [
        (
            "error: step[0].send: expected nodes of bus 'bus' (it has none), got 10, "
            f"{wrong}:3, correct it"
        ),
        (
            f"error: cannot read the scenario (No such file or directory), {missing}, "
            "check the path and its permissions"
        ),
    ]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--real", "--link", "x"], "expected --real or --link, got both"),
        (["--speed", "2"], "--speed: expected only with --real"),
        (["--set", "steps"], "Invalid value for '--set': expected NAME=VALUE, got 'steps'"),
        (
            ["--set", "steps=[1,2]", "--record", "x"],
            "--record: expected one scenario of one case, got 2, use -k or --set",
        ),
        (
            ["--link", "x", "--record", "y"],
            "--record: expected a bus in this process, got --link; sacbus monitor records a line",
        ),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    file: Path, capsys: Captured, arguments: list[str], told: str
) -> None:
    assert run(["run", str(file), *arguments]) == 2
    advice = "" if ", see sacbus " in told else ", see sacbus run --help"
    assert capsys.readouterr().err == f"error: {told}{advice}\n"


def test_a_parameter_that_is_not_there_is_a_mistake(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--set", "step=1"]) == 2
    assert capsys.readouterr().err == (
        f"error: parameters: unknown parameter 'step', {file}:3, known here: steps\n"
    )


def test_results_as_json_and_junit(file: Path, tmp_path: Path, capsys: Captured) -> None:
    xml = tmp_path / "r.xml"
    arguments = ["--set", "steps=[40,41]", "--json", "--junit", str(xml)]
    assert run(["run", str(file), *arguments]) == 1
    passed, failed = json.loads(capsys.readouterr().out)["scenarios"]
    assert (passed["passed"], passed["case"], passed["failures"]) == (True, {"steps": 40}, [])
    assert passed["counts"]["bus"]["acks"] == 1
    (failure,) = failed["failures"]
    assert (failure["place"], failure["got"]) == (f"{file}:10", "position 41, state STANDBY")
    root = ET.parse(xml).getroot()  # noqa: S314 (our own)
    assert (root.get("tests"), root.get("failures")) == ("2", "1")


def test_a_recording_is_kept(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "r.jsonl"
    assert run(["run", str(file), "--record", str(path)]) == 0
    assert read(path).track(10).position(10**10) == 40


def test_a_scenario_that_takes_more_than_a_line_is_refused_before_the_link_is_opened(
    file: Path, capsys: Captured
) -> None:
    assert run(["run", str(file), "--link", "/nowhere/at/all"]) == 2
    assert capsys.readouterr().err == (
        f"error: step: expected what a line can show, got the position of a node, {file}:10, "
        "leave it out, or play it without --link\n"
    )


def test_a_capture_is_written_with_or_without_a_recording(file: Path, tmp_path: Path) -> None:
    alone, beside = tmp_path / "a.pcapng", tmp_path / "b.pcapng"
    assert run(["run", str(file), "--pcap", str(alone)]) == 0
    assert run(["run", str(file), "--pcap", str(beside), "--record", str(tmp_path / "r")]) == 0
    assert alone.read_bytes() == beside.read_bytes()
    assert b"\x02\x0a\x01m40v300\x03" in alone.read_bytes()


def test_pins_are_written_as_vcd(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.vcd"
    assert run(["run", str(file), "--vcd", str(path)]) == 0
    assert path.read_text().startswith("$")
    assert " clk $end" in path.read_text()


def test_a_page_that_cannot_be_written_is_one_line(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--record", str(file.parent)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)


OUTPUTS = ["--record", "--vcd", "--pcap", "--plot", "--report", "--junit"]


@pytest.mark.parametrize("option", OUTPUTS)
def test_a_directory_that_is_missing_is_told_before_anything_is_played(
    file: Path, capsys: Captured, option: str
) -> None:
    for directory, what in (
        (file.parent / "no", "does not exist"),
        (file, "is not a directory"),
    ):
        place = directory / "x.svg"
        assert run(["run", str(file), option, str(place)]) == 2
        told = f"error: {option}: cannot write {place}, {directory} {what}\n"
        assert capsys.readouterr() == ("", told)


@pytest.mark.parametrize("option", OUTPUTS)
def test_a_scenario_is_not_written_over(
    file: Path, tmp_path: Path, capsys: Captured, option: str
) -> None:
    link, hard = tmp_path / "link", tmp_path / "hard"
    link.symlink_to(file)
    hard.hardlink_to(file)
    for place in (file, tmp_path / ".." / tmp_path.name / file.name, link, hard):
        assert run(["run", str(file), option, str(place)]) == 2
        assert capsys.readouterr() == (
            "",
            (
                f"error: {option}: expected a file of its own, got {place}, which is read, "
                "see sacbus run --help\n"
            ),
        )
    assert file.read_text() == PASSES


def test_two_outputs_are_not_written_to_one_file(
    file: Path, tmp_path: Path, capsys: Captured
) -> None:
    place = tmp_path / "x.svg"
    for one, other in pairwise(OUTPUTS):
        assert run(["run", str(file), one, str(place), other, str(place)]) == 2
        assert capsys.readouterr() == (
            "",
            (
                f"error: {other}: expected a file of its own, got {place}, which is that of {one}, "
                "see sacbus run --help\n"
            ),
        )
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("option", OUTPUTS[:-1])
def test_what_is_kept_does_not_go_among_the_verdicts(
    file: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch, option: str
) -> None:
    monkeypatch.chdir(file.parent)
    assert run(["run", str(file), option, "-"]) == 2
    assert capsys.readouterr() == (
        "",
        (
            f"error: {option}: expected a file, got -, where its results are told, "
            "see sacbus run --help\n"
        ),
    )
    assert list(file.parent.iterdir()) == [file]


def test_two_results_do_not_go_to_standard_output(file: Path, capsys: Captured) -> None:
    assert run(["run", str(file), "--json", "--junit", "-"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.startswith("error: --json: expected --junit to be a file, got standard output")


def test_devices_and_standard_output_may_be_shared(file: Path, capsys: Captured) -> None:
    shared = ["--vcd", "/dev/null", "--pcap", "/dev/null", "--junit", "-"]
    assert run(["run", str(file), *shared]) == 0
    assert "<testsuite" in capsys.readouterr().out


def test_what_cannot_be_written_to_its_end_leaves_what_was_there(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    vcd, pcap = tmp_path / "x.vcd", tmp_path / "x.pcapng"
    for option, place, name in (
        ("--vcd", vcd, "sacbus.trace.vcd.write_vcd"),
        ("--pcap", pcap, "sacbus.trace.write_pcapng"),
    ):
        place.write_text("before")
        with monkeypatch.context() as patch:
            patch.setattr(name, broken)
            assert run(["run", str(file), option, str(place)]) == 1
    assert [vcd.read_text(), pcap.read_text()] == ["before", "before"]
    assert sorted(tmp_path.iterdir()) == sorted([file, vcd, pcap])


FULL = (
    "error: the recording /dev/full could not be begun: No space left on device, nothing is kept, "
    "record elsewhere\n"
)


@needs_full_device
def test_a_recording_that_cannot_be_written_ends_it_with_status_1(
    file: Path, tmp_path: Path, capsys: Captured
) -> None:
    assert run(["run", str(file), "--record", "/dev/full"]) == 1
    assert capsys.readouterr() == ("", FULL)
    results = tmp_path / "results.xml"
    assert run(["run", str(file), "--record", "/dev/full", "--junit", str(results)]) == 1
    assert not results.exists()


def test_a_recording_into_a_pipe_is_refused_before_anything_is_played(
    file: Path, tmp_path: Path, capsys: Captured
) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        assert run(["run", str(file), "--record", str(pipe)]) == 2
    finally:
        os.close(reader)
    assert capsys.readouterr() == (
        "",
        f"error: --record: expected a file, got {pipe}, which is a pipe\n",
    )


@pytest.mark.slow
@needs_full_device
def test_a_recording_in_real_time_that_cannot_be_written_ends_it_at_once(file: Path) -> None:
    file.write_text(
        '[[bus]]\n[[bus.nodes]]\naddress = 10\n[[step]]\nsend = "10"\nevery = "1 ms"\n'
        'for = "1000 h"\n'
    )
    command = [sys.executable, "-m", "sacbus", "run", str(file), "--real", "--record", "/dev/full"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", FULL)


@pytest.mark.slow
@needs_full_disk
def test_a_disk_that_gets_full_ends_it_at_once_and_keeps_what_came_before(file: Path) -> None:
    file.write_text(
        '[[bus]]\n[[bus.nodes]]\naddress = 10\n[[step]]\nsend = "10"\nevery = "1 ms"\n'
        'for = "1000 h"\n'
    )
    recording = file.with_suffix(".jsonl")
    code = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000)); "
    code += "from sacbus.cli import run; sys.exit(run(sys.argv[1:]))"
    command = [sys.executable, "-c", code, "run", str(file), "--record", str(recording)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert (ended.returncode, ended.stdout) == (1, "")
    found = re.fullmatch(
        rf"error: the recording {recording} ends at (\d+\.\d{{6}}) s: File too large, "
        r"what came before is kept, record elsewhere\n",
        ended.stderr,
    )
    assert found is not None
    kept = read(recording)
    assert list(kept)
    assert abs(kept.end / 1e9 - float(found[1])) < 2
    assert not kept.whole


@pytest.mark.slow
@needs_full_disk
def test_pictures_that_the_disk_has_no_room_for_are_told_of_and_what_had_ended_is_kept(
    file: Path, tmp_path: Path
) -> None:
    bus = "[[bus]]\n[[bus.nodes]]\naddress = 10\n[[step]]\n"
    file.write_text(bus + 'send = "10m40"\n')
    long = tmp_path / "long.toml"
    long.write_text(bus + 'send = "10"\nevery = "1 ms"\nfor = "1000 h"\n')
    results, page = tmp_path / "results.xml", tmp_path / "page.html"
    code = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, 2**20)); "
    code += "from sacbus.cli import run; sys.exit(run(sys.argv[1:]))"
    arguments = ["run", str(file), str(long), "--junit", str(results), "--report", str(page)]
    command = [sys.executable, "-c", code, *arguments]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert ended.returncode == 1
    assert ended.stdout.startswith(f"passed {file}")
    assert ended.stderr == (
        f"error: {gettempdir()}: File too large, what pictures are made of is kept there as long "
        "as it is played, make room or set TMPDIR\n"
    )
    assert 'tests="1"' in results.read_text("utf-8")
    assert str(file) in page.read_text("utf-8")


@pytest.mark.slow
def test_a_picture_is_drawn(file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.svg"
    assert run(["run", str(file), "--plot", str(path)]) == 0
    assert b"1 node, 1 moved, 0.682769 s" in path.read_bytes()


def test_a_picture_that_is_not_drawn_is_told_before_anything_is_played(
    file: Path, capsys: Captured
) -> None:
    assert run(["run", str(file), "--plot", "a.pdf"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: pictures are drawn as PNG or SVG, a.pdf, ")


@pytest.mark.slow
def test_a_page_has_all_cases_with_pictures_and_how_to_repeat_each(
    file: Path, tmp_path: Path
) -> None:
    path = tmp_path / "r.html"
    arguments = ["--set", "steps=[40,41]", "--seed", "3", "--report", str(path)]
    assert run(["run", str(file), *arguments]) == 1
    text = path.read_text("utf-8")
    assert "<h1>1 of 2 cases passed</h1>" in text
    assert text.count("<svg") == 2
    assert text.count("not as expected</text>") == 1
    for steps in (40, 41):
        assert f"<pre>sacbus run {file} --set steps={steps} --seed 3</pre>" in text


def test_a_page_without_matplotlib_has_no_pictures_and_says_why(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_matplotlib(monkeypatch)
    path = tmp_path / "r.html"
    assert run(["run", str(file), "--report", str(path)]) == 0
    text = path.read_text("utf-8")
    assert "<svg" not in text
    assert "it takes matplotlib (python -m pip install &#x27;sacbus[plot]&#x27;)" in text


def test_what_is_repeated_is_the_same_case(file: Path, tmp_path: Path) -> None:
    file.write_text(PASSES.replace("steps = 40", 'steps = 40\nnote = "a b"'))
    path = tmp_path / "r.html"
    assert run(["run", str(file), "--set", "note=it's 1", "--report", str(path), "-k", "x"]) == 0
    (line,) = re.findall("<pre>sacbus (.*?)</pre>", path.read_text("utf-8"))
    words = shlex.split(unescape(line))
    again = tmp_path / "again.html"
    assert run([*words, "--report", str(again)]) == 0
    assert again.read_bytes() == path.read_bytes()


@pytest.mark.slow
def test_standard_input_is_a_scenario_for_a_real_process() -> None:
    command = [sys.executable, "-m", "sacbus", "run", "-"]
    ran = subprocess.run(
        command, input=PASSES, capture_output=True, text=True, check=False, timeout=PATIENCE
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout.startswith("passed standard input: a move, 0.")


@pytest.mark.slow
def test_a_served_bus_is_played_on_over_its_pty(file: Path) -> None:
    file.write_text(PASSES.replace('node = 10, position = 40, state = "STANDBY"', "acks = 1"))
    page = file.with_suffix(".html")
    with (
        served("--ephemeral", "--nodes", "10") as bus,
        started("run", str(file), "--link", bus.link, "--report", str(page)) as player,
    ):
        assert player.wait() == 0
    assert player.text.startswith("passed ")
    text = page.read_text("utf-8")
    assert "what happens behind a link is not recorded" in text
    assert f"--link {bus.link}</pre>" in text


SPOKEN = {
    "sac": ('[[bus]]\n[[bus.nodes]]\naddress = 4\n[[step]]\nsend = "4m400"\n', ["--nodes", "4"]),
    "superstepper": (
        (
            '[[bus]]\n[[bus.nodes]]\naddress = 4\nkind = "ss-mst67"\n'
            '[[step]]\nsend = "4 move-steps 400 --speed 4000"\n'
        ),
        ["--kind", "ss-mst67", "--nodes", "4", "--baud", "9600"],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ours", "theirs", "commands"),
    [
        ("sac", "superstepper", "a SAC's commands"),
        ("superstepper", "sac", "messages of superstepper"),
    ],
)
def test_a_line_of_another_protocol_is_refused_before_a_byte_goes_out(
    file: Path, capsys: Captured, ours: str, theirs: str, commands: str
) -> None:
    file.write_text(SPOKEN[ours][0])
    tape = file.with_name("tape.jsonl")
    with served("--ephemeral", *SPOKEN[theirs][1], "--record", str(tape)) as bus:
        assert run(["run", str(file), "--link", bus.link]) == 1
        out, err = capsys.readouterr()
        assert out == ""
        assert err == (
            f"error: this line speaks {theirs}, to which {commands} mean something else, "
            f"{bus.link}, take a master of that protocol: nothing was sent\n"
        )
        file.write_text(SPOKEN[theirs][0])
        assert run(["run", str(file), "--link", bus.link]) == 0
        bus.send_signal(signal.SIGTERM)  # it writes its recording to the end
    with tape.open(encoding="utf-8") as lines:
        said = [one for one in map(json.loads, lines) if one.get("is") == "sent"]
    assert len(said) == 2, said  # what the one that fits has said, and the node's answer


@pytest.mark.slow
def test_ctrl_c_ends_a_long_one(file: Path) -> None:
    file.write_text(
        '[[bus]]\n[[bus.nodes]]\naddress = 10\n[[step]]\nsend = "10"\nevery = "1 ms"\n'
        'for = "1000 h"\n'
    )
    with started("run", str(file), "--record", str(file.with_suffix(".jsonl"))) as player:
        recording = file.with_suffix(".jsonl")
        # It plays once the first second of it is on disk.
        while not recording.exists() or not recording.stat().st_size:
            assert player.process.poll() is None
        assert player.send_signal(signal.SIGINT) == 130
        assert player.errors().strip() == "interrupted"


@pytest.mark.slow
def test_ctrl_c_keeps_what_had_ended(file: Path, tmp_path: Path) -> None:
    bus = "[[bus]]\n[[bus.nodes]]\naddress = 10\n[[step]]\n"
    file.write_text(bus + 'send = "10m40"\n')
    long = tmp_path / "long.toml"
    long.write_text(bus + 'send = "10"\nevery = "1 ms"\nfor = "1000 h"\n')
    results, page = tmp_path / "results.xml", tmp_path / "page.html"
    command = ("run", str(file), str(long), "--junit", str(results), "--report", str(page))
    with started(*command) as player:
        player.read_until(lambda text: "passed " in text)
        assert player.send_signal(signal.SIGINT) == 130
    assert 'tests="1"' in results.read_text("utf-8")
    assert long.name not in results.read_text("utf-8")
    assert str(file) in page.read_text("utf-8")
