"""Recordings at the command line: ``serve --record``, ``export``, ``diff``; one that is killed."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from itertools import pairwise
from pathlib import Path

import click
import pytest

from sacbus.cli import run
from sacbus.cli.recordings import span
from sacbus.mother import safe_body
from sacbus.trace import read
from sacbus.trace.records import Moved, Sent
from sacbus.wire import encode
from tests.drawing import without_matplotlib
from tests.full_disk import needs_full_device, needs_full_disk
from tests.serving import PATIENCE, client, served, until
from tests.trace.rig import Dump, recorded, two_axes

Captured = pytest.CaptureFixture[str]

ACK_10 = bytes.fromhex("02 01 0a 06")


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    sink = BytesIO()
    recorded(two_axes, sink=sink)
    path = tmp_path / "run.jsonl"
    path.write_bytes(sink.getvalue())
    return path


@pytest.mark.slow
@pytest.mark.parametrize("killed", [True, False])
def test_what_a_bus_that_is_served_did_is_in_the_file(tmp_path: Path, *, killed: bool) -> None:
    path = tmp_path / "run.jsonl"
    with served("--ephemeral", "--record", str(path)) as sacbus:
        with client(sacbus.link) as port:
            port.write(encode(10, 1, b"m400v120"))
            assert port.read(4) == ACK_10
        # It is there soon after, although nothing more happens.
        until(lambda: any(isinstance(one, Sent) and one.sender == 10 for one in read(path)))
        status = sacbus.send_signal(signal.SIGKILL if killed else signal.SIGTERM)
        assert status == (-signal.SIGKILL if killed else 0)
    recording = read(path)
    sent = [one for one in recording if isinstance(one, Sent)]
    assert [one.sender for one in sent] == ["link 1", 10]
    assert recording.whole is not killed
    track = recording.track(10)
    assert track.command(sent[-1].end) == "m400v120a1d1"
    # Where it would have come to: the segment tells to its end.
    assert track.position(10**15) == 400 or not killed


@pytest.mark.slow
def test_killed_while_it_records_much_it_leaves_a_file_that_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "run.jsonl"
    with (
        served("--ephemeral", "--no-pace", "--record", str(path)) as sacbus,
        client(sacbus.link) as port,
    ):
        number = 0
        while path.stat().st_size < 100_000:
            port.write(encode(10, 1, safe_body(b"xm%dv400" % (100 + number % 300))))
            assert port.read(4) == ACK_10
            number += 1
        port.write(encode(10, 1, safe_body(b"xm100v400")) * 20)
        sacbus.send_signal(signal.SIGKILL)
    recording = read(path)
    records = list(recording)
    assert len([one for one in records if isinstance(one, Moved)]) > 50
    assert not recording.whole


@pytest.mark.slow
@needs_full_disk
def test_serve_tells_at_once_of_a_disk_that_is_full_goes_on_and_ends_with_status_1(
    tmp_path: Path,
) -> None:
    path = tmp_path / "run.jsonl"
    with served("--ephemeral", "--record", str(path)) as sacbus, client(sacbus.link) as port:
        until(lambda: path.stat().st_size)
        room = path.stat().st_size + 300
        resource.prlimit(sacbus.process.pid, resource.RLIMIT_FSIZE, (room, room))
        for _ in range(3):
            port.write(encode(10, 1, b""))
            assert port.read(4) == ACK_10
        told = sacbus.read_event("report")
        port.write(encode(10, 1, b"S"))  # the bus goes on
        assert port.read(4) == ACK_10
        assert sacbus.send_signal(signal.SIGTERM) == 1
        assert sacbus.read_event("stopped")
        errors = sacbus.errors()
    assert re.fullmatch(
        rf"the recording {path} ends at \d+\.\d{{6}} s: File too large, "
        "what came before is kept, record elsewhere",
        told["text"],
    )
    assert errors == f"error: {told['text']}\n"
    recording = read(path)
    assert list(recording)
    assert not recording.whole


@pytest.mark.slow
@needs_full_device
def test_serve_says_when_a_recording_could_not_be_begun() -> None:
    with served("--ephemeral", "--record", "/dev/full") as sacbus:
        told = sacbus.read_event("report")
        assert sacbus.send_signal(signal.SIGINT) == 1
        assert sacbus.errors() == f"error: {told['text']}\n"
    assert told["text"] == (
        "the recording /dev/full could not be begun: No space left on device, nothing is kept, "
        "record elsewhere"
    )


def test_export_writes_what_it_is_asked_for(
    recording: Path, tmp_path: Path, capsys: Captured
) -> None:
    vcd, csv, positions = (tmp_path / name for name in ("run.vcd", "run.csv", "where.csv"))
    asked = ["--vcd", str(vcd), "--csv", str(csv), "--positions", str(positions), "--every", "1s"]
    assert run(["export", str(recording), *asked]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[0] for line in said] == [str(vcd), str(csv), str(positions)]
    assert len(Dump(vcd.read_text()).rises("bus.node_10.clk")) == 450
    assert csv.read_text().startswith("time_ns,bus,node,event,value,text\n")
    assert len(positions.read_text().splitlines()) == 1 + 2 * 5


def test_export_says_when_a_recording_was_cut_off(
    recording: Path, tmp_path: Path, capsys: Captured
) -> None:
    recording.write_bytes(recording.read_bytes()[:-60])
    assert run(["export", str(recording), "--csv", str(tmp_path / "run.csv")]) == 0
    assert re.fullmatch(
        rf"note: {recording} was cut off at \d\.\d+ s: it was not closed\n",
        capsys.readouterr().err,
    )


EXPORTS = ["--vcd", "--csv", "--positions", "--pcap", "--plot"]


@pytest.mark.parametrize("option", EXPORTS)
def test_a_recording_is_not_written_over(
    recording: Path, tmp_path: Path, capsys: Captured, option: str
) -> None:
    before = recording.read_bytes()
    link, hard = tmp_path / "link", tmp_path / "hard"
    link.symlink_to(recording)
    hard.hardlink_to(recording)
    for place in (recording, link, hard):
        assert run(["export", str(recording), option, str(place)]) == 2
        assert capsys.readouterr() == (
            "",
            (
                f"error: {option}: expected a file of its own, got {place}, which is read, "
                "see sacbus export --help\n"
            ),
        )
    assert recording.read_bytes() == before


def test_two_exports_are_not_written_to_one_file(
    recording: Path, tmp_path: Path, capsys: Captured
) -> None:
    place = tmp_path / "x.svg"
    for one, other in pairwise(EXPORTS):
        assert run(["export", str(recording), one, str(place), other, str(place)]) == 2
        assert f"got {place}, which is that of {one}, see" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [recording]


@pytest.mark.parametrize("option", EXPORTS[:4])
def test_an_export_that_fails_leaves_what_was_there(
    recording: Path, tmp_path: Path, option: str
) -> None:
    recording.write_bytes(recording.read_bytes() + b"x\n")
    place = tmp_path / "out"
    assert run(["export", str(recording), option, str(place)]) == 2
    assert list(tmp_path.iterdir()) == [recording]
    place.write_text("before")
    assert run(["export", str(recording), option, str(place)]) == 2
    assert place.read_text() == "before"


@pytest.mark.parametrize("option", EXPORTS[:4])
def test_an_export_goes_through_a_pipe(recording: Path, tmp_path: Path, option: str) -> None:
    pipe, place = tmp_path / "pipe", tmp_path / "out"
    os.mkfifo(pipe)
    with ThreadPoolExecutor(1) as reader:
        got = reader.submit(pipe.read_bytes)
        assert run(["export", str(recording), option, str(pipe)]) == 0
        assert run(["export", str(recording), option, str(place)]) == 0
        assert got.result(10) == place.read_bytes() != b""
    assert pipe.is_fifo()


@pytest.mark.parametrize("option", EXPORTS[:4])
def test_an_export_goes_to_standard_output(
    recording: Path, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes], option: str
) -> None:
    place, beside = tmp_path / "out", tmp_path / "beside"
    assert run(["export", str(recording), option, str(place)]) == 0
    capfdbinary.readouterr()
    other = "--csv" if option != "--csv" else "--vcd"
    assert run(["export", str(recording), option, "-", other, str(beside)]) == 0
    out, err = capfdbinary.readouterr()
    assert out == place.read_bytes() != b""
    assert err.startswith(f"{beside}: ".encode())
    assert err.count(b"\n") == 1
    assert sorted(tmp_path.iterdir()) == sorted([recording, place, beside])


@needs_full_device
@pytest.mark.parametrize("option", EXPORTS[:4])
def test_standard_output_without_room_is_named(recording: Path, option: str) -> None:
    command = [sys.executable, "-m", "sacbus", "export", str(recording), option, "-"]
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE, check=False
        )
    assert (ended.returncode, ended.stderr) == (
        1,
        (
            "error: standard output: No space left on device, what was written is not whole, "
            "make room there\n"
        ),
    )


def test_two_exports_do_not_go_to_standard_output(recording: Path, capsys: Captured) -> None:
    for one, other in pairwise(EXPORTS):
        assert run(["export", str(recording), one, "-", other, "-"]) == 2
        assert capsys.readouterr() == (
            "",
            (
                f"error: expected one on standard output, got {one} and {other}, "
                "give others a file, see sacbus export --help\n"
            ),
        )


def test_a_picture_takes_a_file_and_a_capture_no_terminal(
    recording: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run(["export", str(recording), "--plot", "-"]) == 2
    assert "-, give a name that ends in .png or .svg" in capsys.readouterr().err
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert run(["export", str(recording), "--pcap", "-"]) == 2
    assert "--pcap - writes bytes that are not for a terminal" in capsys.readouterr().err


def test_what_is_served_is_recorded_into_a_file_of_its_own(
    tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    config = tmp_path / "bus.toml"
    config.write_text("[[bus]]\n")
    for place in ("-", str(config)):
        assert run(["serve", str(config), "--record", place]) == 2
        assert "error: --record: expected a file" in capsys.readouterr().err
    assert config.read_text() == "[[bus]]\n"
    assert list(tmp_path.iterdir()) == [config]


def test_exports_to_devices_go_on_working(recording: Path) -> None:
    asked = [word for option in EXPORTS[:4] for word in (option, "/dev/null")]
    assert run(["export", str(recording), *asked]) == 0


def test_diff_says_which_was_cut_off(recording: Path, tmp_path: Path, capsys: Captured) -> None:
    cut, others = tmp_path / "cut.jsonl", tmp_path / "others.jsonl"
    lines = recording.read_bytes().splitlines(keepends=True)
    cut.write_bytes(b"".join(lines[:-1]))
    others.write_bytes(b"".join([lines[0].replace(b'"name":"bus"', b'"name":"x"'), *lines[1:]]))
    assert others.read_bytes() != recording.read_bytes()
    note = rf"note: {cut} was cut off at \d\.\d{{6}} s: it was not closed\n"
    run(["diff", str(recording), str(cut)])
    assert re.fullmatch(note, capsys.readouterr().err)
    run(["diff", str(cut), str(cut), "--json"])
    assert re.fullmatch(note * 2, capsys.readouterr().err)
    # The buses tell them apart before a record is read.
    assert run(["diff", str(others), str(cut)]) == 1
    assert re.fullmatch(note, capsys.readouterr().err)
    assert run(["diff", str(others), str(recording)]) == 1
    assert capsys.readouterr().err == ""


def test_diff_of_the_same_is_silent_and_status_0(recording: Path, capsys: Captured) -> None:
    assert run(["diff", str(recording), str(recording)]) == 0
    assert capsys.readouterr().out == ""


def test_diff_of_others_tells_the_first_and_is_status_1(
    recording: Path, tmp_path: Path, capsys: Captured
) -> None:
    other = tmp_path / "other.jsonl"
    other.write_bytes(recording.read_bytes().replace(b'"02010a06"', b'"02010a15"'))
    assert run(["diff", str(recording), str(other)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert re.fullmatch(r"0\.\d{9} s, bus: packet: expected 10>1 'ACK', got 10>1 'NAK'", lines[0])
    assert run(["diff", str(recording), str(other), "--json", "--most", "1"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert (told["bus"], told["node"], told["what"]) == ("bus", None, "packet")
    assert (told["expected"], told["got"]) == ("10>1 'ACK'", "10>1 'NAK'")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["diff", "{run}", "{none}"], "{none}: No such file or directory, name a recording"),
        (["diff", "{queue}", "{run}"], "{queue}, line 1: expected a recording of sacbus, got "),
        (["diff", "{run}", "{broken}"], "{broken}, line 2: expected a record, got 'x'"),
        (["diff", "{run}", "{run}", "--time", "1 year"], 'expected a time such as "250 ms" (ns'),
        (["export", "{run}"], "nothing to write: give --vcd, --csv, --positions, --pcap or "),
        (["export", "{run}", "--csv", "x", "--every", "0"], "expected a time above 0, got '0'"),
        (["export", "{broken}", "--csv", "{out}"], "{broken}, line 2: expected a record, got 'x'"),
    ],
)
def test_what_is_wrong_is_one_line_and_status_2(
    arguments: list[str], text: str, recording: Path, tmp_path: Path, capsys: Captured
) -> None:
    queue, broken = tmp_path / "queue.txt", tmp_path / "broken.jsonl"
    queue.write_text(" 1 , 800 , 0\n")
    broken.write_bytes(recording.read_bytes().splitlines(keepends=True)[0] + b"x\n")
    names = {"run": recording, "none": tmp_path / "none", "queue": queue, "broken": broken}
    names["out"] = tmp_path / "out"
    assert run([one.format(**names) for one in arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    assert text.format(**names) in line


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_a_recording_is_drawn(
    recording: Path, tmp_path: Path, capsys: Captured, ending: str
) -> None:
    axes, path = tmp_path / f"axes.{ending}", tmp_path / f"path.{ending}"
    assert run(["export", str(recording), "--plot", str(axes)]) == 0
    assert run(["export", str(recording), "--plot", str(path), "--xy", "10,11"]) == 0
    assert capsys.readouterr().out == f"{axes}: drawn\n{path}: drawn\n"
    head = b"\x89PNG" if ending == "png" else b"<?xml"
    assert axes.read_bytes().startswith(head)
    assert path.read_bytes().startswith(head)
    assert axes.read_bytes() != path.read_bytes()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--plot", "x.pdf"], "pictures are drawn as PNG or SVG, x.pdf, give a name that ends in"),
        (["--plot", "x.png", "--xy", "10"], "expected two nodes such as 10,11, got '10'"),
        (["--plot", "x.png", "--xy", "10,10"], "expected two nodes such as 10,11, got '10,10'"),
        (["--plot", "x.png", "--xy", "10,12"], "expected nodes 10 and 12 on one bus of it, got"),
        (["--csv", "x.csv", "--xy", "10,11"], "--xy: expected only with --plot"),
        (["--csv", "x.csv", "--nodes", "10"], "--nodes: expected only with --plot"),
        (["--plot", "x.png", "--nodes", "10", "--xy", "10,11"], "--nodes or --xy, got both"),
        (["--plot", "x.png", "--nodes", "10-12"], "expected nodes that are in it, got 12"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(
    recording: Path,
    tmp_path: Path,
    capsys: Captured,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["export", str(recording), *arguments]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert told in err
    assert list(tmp_path.iterdir()) == [recording]


def test_without_matplotlib_one_line_says_what_to_install(
    recording: Path, tmp_path: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_matplotlib(monkeypatch)
    assert run(["export", str(recording), "--plot", str(tmp_path / "x.png")]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert err.endswith("install it: python -m pip install 'sacbus[plot]'\n")


@pytest.mark.parametrize(("given", "ns"), [("1.5us", 1_500), ("0.000000001 s", 1), ("0", 0)])
def test_a_time_is_whole_ns(given: str, ns: int) -> None:
    option = click.Option(["--time"])
    context = click.Context(click.Command("diff"))
    assert span(context, option, given) == ns
    with pytest.raises(click.BadParameter, match=r"expected a whole number of ns, got '0\.5ns'"):
        span(context, option, "0.5ns")
