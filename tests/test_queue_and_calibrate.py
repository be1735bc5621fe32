"""Queue files and calibration from end to end: real processes, real ptys, real time."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from sacbus import open_bus
from sacbus.cli import run
from sacbus.cli.calibrate import result_lines
from sacbus.daemon import Configuration
from sacbus.hosted import HostedBus
from sacbus.kernel import SECOND
from sacbus.language.queue_file import QueueRow, read_rows, write_rows
from sacbus.links.places import PtyAt
from sacbus.mother import Calibration
from sacbus.motion import Drive
from tests.serving import PATIENCE, Sacbus, served

pytestmark = pytest.mark.slow

COMPANION = Path(__file__).with_name("data") / "companion-queue.txt"

Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def sacbus() -> Iterator[Sacbus]:
    with served("--terminals", "--ephemeral", "--speed", "10", "--set", "ppm=400") as made:
        yield made


def terminal(sacbus: Sacbus, node: int) -> str:
    path = sacbus.ready["terminals"][str(node)]
    assert isinstance(path, str)
    return path


def text(rows: list[QueueRow]) -> str:
    return "".join(write_rows(rows))


def rows_of(count: int, line: str) -> str:
    """So many rows, all alike: the companion's first one with other fields."""
    return "".join(f" {position} , {line} \r\n" for position in range(1, count + 1))


#: Forty milliseconds, as a file has it: 8 steps at 60 RPM, without ramps.
STEADY = "8 , 0 , 1 , 60 , 5000 , 0 , 999 , 999 , 0 , 0 , 0"


# ----------------------------------------------------------------------------- queue put


def test_a_file_is_put_and_got_back_as_it_is(
    sacbus: Sacbus, capsys: Captured, tmp_path: Path
) -> None:
    assert run(["queue", "put", sacbus.link, "10", str(COMPANION), "--save"]) == 0
    told = "30 positions written to node 10, and saved to its EEPROM\n"
    assert capsys.readouterr() == (told, "")
    got = tmp_path / "got.csv"
    assert run(["queue", "get", terminal(sacbus, 10), str(got)]) == 0
    assert got.read_bytes() == COMPANION.read_bytes()
    capsys.readouterr()
    assert run(["queue", "compare", terminal(sacbus, 10), str(COMPANION)]) == 0
    assert capsys.readouterr() == (f"30 positions are as in {COMPANION}\n", "")


def test_a_put_is_told_as_json(sacbus: Sacbus, capsys: Captured) -> None:
    assert run(["queue", "put", "--json", sacbus.link, "11", str(COMPANION)]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "link": sacbus.link,
        "node": 11,
        "file": str(COMPANION),
        "rows": 30,
        "streamed": False,
        "saved": False,
    }


def test_what_differs_is_told_a_line_each_and_as_json(
    sacbus: Sacbus, capsys: Captured, tmp_path: Path
) -> None:
    file = tmp_path / "wanted.csv"
    rows = [one.row for one in read_rows(COMPANION.read_text().splitlines())]
    file.write_text(text(rows[:2]))
    assert run(["queue", "put", sacbus.link, "12", str(file)]) == 0
    file.write_text(" 1 , 801 , 1 , 1 , 150 , 2000 , 0 , 1 , 1 , 0 , 0 , 0 \r\n")
    capsys.readouterr()
    assert run(["queue", "compare", terminal(sacbus, 12), str(file)]) == 1
    out, err = capsys.readouterr()
    assert err == ""
    assert "position 1: steps 800, expected 801\n" in out
    assert all(line.startswith("position 1: ") for line in out.splitlines())
    assert run(["queue", "compare", "--json", terminal(sacbus, 12), str(file)]) == 1
    report = json.loads(capsys.readouterr().out)
    assert report["rows"] == 1
    assert report["differences"][0] == {
        "position": 1,
        "field": "steps",
        "got": "800",
        "expected": "801",
    }
    # One position is one position.
    file.write_text(text(rows[:1]))
    assert run(["queue", "compare", terminal(sacbus, 12), str(file)]) == 0
    assert capsys.readouterr() == (f"1 position is as in {file}\n", "")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("", "there is no row, {file}, write one a line as the companion does"),
        (
            f" 1 , {STEADY} \n\n 2 , 12 , 0 , 1 , 60 , fast , 0 , 1 , 1 , 0 , 0 , 0 \n",
            (
                "this is no row of a queue file, {file} line 3 column 24, expected the cycle in "
                "microseconds, 0 to 4294967295, got 'fast'"
            ),
        ),
        (
            f" 1 , {STEADY} \n\n 31 , {STEADY} \n",
            (
                "a node has no queue position 31, only 1 to 30, {file} line 3, give it another, or "
                "stream the rows"
            ),
        ),
        (
            f" 1 , {STEADY} \n 1 , {STEADY} \n",
            "queue position 1 is there twice, {file} line 2, give each row a position of its own",
        ),
        (
            rows_of(30, STEADY) + "\n 7 , 0 , 0 , 1 , 60 , 5000 , 0 , 1 , 1 , 0 , 0 , 0 \n",
            "a continuous command cannot be streamed: it never ends, {file} line 32, give it steps",
        ),
        (
            rows_of(40, STEADY) + " 7 , 9 , 0 , 1 , 60 , 5000 , 0 , 1 , 1 , 0 , 1 , 0 \n",
            (
                "a command that is held for sync cannot be streamed: nobody knows when it is "
                "released, {file} line 41, take its sync out"
            ),
        ),
    ],
)
def test_a_file_that_is_wrong_is_told_by_its_line_and_nothing_moves(
    sacbus: Sacbus, capsys: Captured, tmp_path: Path, content: str, told: str
) -> None:
    file = tmp_path / "queue.csv"
    file.write_text(content, newline="")
    assert run(["queue", "put", sacbus.link, "12", str(file)]) == 2
    assert capsys.readouterr() == ("", f"error: {told.format(file=file)}\n")


def test_what_is_streamed_is_not_saved(sacbus: Sacbus, capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    file.write_text(rows_of(31, STEADY), newline="")
    assert run(["queue", "put", sacbus.link, "12", str(file), "--save"]) == 2
    assert capsys.readouterr().err.startswith("error: --save is for files that are not streamed")


def test_rows_that_are_too_quick_for_a_link_are_told_of(capsys: Captured, tmp_path: Path) -> None:
    file = tmp_path / "quick.csv"
    # 3 ms each; what is sent over a link may take a tenth of a second.
    file.write_text(rows_of(31, "1 , 0 , 1 , 100 , 3000 , 0 , 999 , 999 , 0 , 0 , 0"), newline="")
    with served("--ephemeral") as real:
        assert run(["queue", "put", real.link, "10", str(file)]) == 0
        assert capsys.readouterr() == (
            "node 10 has run 31 rows, 0.093 s\n",
            (
                "warning: node 10 paused once, since rows came too late; longer rows, or a quicker "
                "line, run without a stop\n"
            ),
        )
        assert real.send_signal(signal.SIGTERM) == 0
        (bus,) = real.read_event("stopped")["buses"]
        assert [node["position_steps"] for node in bus["nodes"]] == [31, 0, 0]


def test_a_file_that_is_not_there_is_told(sacbus: Sacbus, capsys: Captured) -> None:
    assert run(["queue", "put", sacbus.link, "12", "/nonexistent.csv"]) == 2
    told = "the queue file cannot be read (No such file or directory), /nonexistent.csv, check the"
    assert capsys.readouterr().err == f"error: {told} path\n"


def test_what_was_not_taken_as_written_is_warned_of(
    sacbus: Sacbus, capsys: Captured, tmp_path: Path
) -> None:
    file = tmp_path / "queue.csv"
    file.write_text(" 1 , 800 , 1 , 1 , 150 , 2001 , 0 , 1 , 1 , 0 , 0 , 0 \n")
    assert run(["queue", "put", sacbus.link, "12", str(file)]) == 0
    assert capsys.readouterr().err == (
        f"warning: {file} line 1 column 20: expected 149, the RPM of a cycle of 2001, got 150, the "
        "cycle counts\n"
    )


def test_nobody_at_that_address_is_status_4(sacbus: Sacbus, capsys: Captured) -> None:
    assert run(["queue", "put", sacbus.link, "99", str(COMPANION)]) == 4
    assert capsys.readouterr().err.startswith("error: node 99: 'q1m800")


# ------------------------------------------------------------------------------ in real time


@asynccontextmanager
async def bus_and_command(
    tmp_path: Path, *arguments: str, errors: int = asyncio.subprocess.PIPE
) -> AsyncIterator[tuple[HostedBus, asyncio.subprocess.Process]]:
    """A bus with node 10 behind a pty, and ``python -m sacbus`` that is told of it."""
    pty = tmp_path / "line"
    async with open_bus(Configuration(nodes=(10,), links=(PtyAt(pty),))) as bus:
        command = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "sacbus",
            *(str(pty) if one == "LINK" else one for one in arguments),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=errors,
        )
        try:
            yield bus, command
        finally:
            if command.returncode is None:
                command.kill()
                await command.wait()


async def reached(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not condition():  # noqa: ASYNC110 (a bus in real time has no event to wait on)
            await asyncio.sleep(0.005)


def test_a_long_file_is_streamed_from_standard_input_over_a_pty(tmp_path: Path) -> None:
    async def scene() -> None:
        async with bus_and_command(tmp_path, "queue", "put", "LINK", "10", "-", "--json") as (
            bus,
            command,
        ):
            async with asyncio.timeout(PATIENCE):
                out, err = await command.communicate(rows_of(38, STEADY).encode())
            assert err == b"" or b"paused" in err
            report = json.loads(out)
            # A machine that is very busy may make it pause; no row is lost by that.
            assert (report["rows"], report["streamed"]) == (38, True)
            assert report["seconds"] == pytest.approx(38 * 0.04)
            seen = bus.snapshot(10)
            assert (seen.position_steps, seen.state) == (38 * 8, "STANDBY")
            assert command.returncode == 0

    asyncio.run(scene())


def test_ctrl_c_stops_the_node_and_says_in_which_row(tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    file.write_text("\n" + rows_of(200, STEADY), newline="")

    async def scene() -> None:
        async with bus_and_command(tmp_path, "queue", "put", "LINK", "10", str(file)) as (
            bus,
            command,
        ):
            await reached(lambda: bus.snapshot(10).position_steps > 400)
            command.send_signal(signal.SIGINT)
            async with asyncio.timeout(PATIENCE):
                _out, err = await command.communicate()
            told, _, interrupted = err.decode().splitlines()  # click ends the line of the ^C
            stood = bus.snapshot(10).position_steps
            row = int(told.split()[-3])
            assert told == (
                f"node 10 was stopped with S at {file} line {row + 1}, row {row} of 200"
            )
            # A row is 8 steps. However busy the machine is, neither the node nor what is reckoned
            # of it is further than the queue has been written.
            assert abs(stood / 8 - row) <= 30
            assert interrupted == "interrupted"
            assert command.returncode == 130
            assert bus.snapshot(10).state == "STANDBY"

    asyncio.run(scene())


def test_ctrl_c_that_the_node_does_not_acknowledge_is_told_as_such(tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    # A quarter of a minute each: with 29 of them written, nothing is on the line.
    file.write_text(rows_of(31, "3000 , 0 , 1 , 60 , 5000 , 0 , 999 , 999 , 0 , 0 , 0"), newline="")

    async def scene() -> None:
        async with bus_and_command(tmp_path, "queue", "put", "LINK", "10", str(file)) as (
            bus,
            command,
        ):
            await reached(lambda: bus.snapshot(10).position_steps > 400)
            bus.panel(10).power(on=False)
            command.send_signal(signal.SIGINT)
            async with asyncio.timeout(PATIENCE):
                _out, err = await command.communicate()
            told, _, interrupted = err.decode().splitlines()
            assert told == (
                "node 10 has not acknowledged S, so it may go on; it was, as far as is known, at "
                f"{file} line 1, row 1 of 31"
            )
            assert (command.returncode, interrupted) == (130, "interrupted")

    asyncio.run(scene())


def test_a_node_that_dies_is_told_with_the_row_it_was_in(tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    file.write_text(rows_of(200, STEADY), newline="")

    async def scene() -> None:
        async with bus_and_command(tmp_path, "queue", "put", "LINK", "10", str(file)) as (
            bus,
            command,
        ):
            await reached(lambda: bus.snapshot(10).position_steps > 80)
            bus.panel(10).power(on=False)
            async with asyncio.timeout(PATIENCE):
                out, err = await command.communicate()
            where, error = err.decode().splitlines()
            assert where.startswith(f"node 10 was, as far as is known, at {file} line ")
            assert where.endswith(" of 200")
            assert error.startswith("error: node 10: 'q")
            assert (command.returncode, out) == (4, b"")

    asyncio.run(scene())


def test_a_terminal_is_shown_how_many_rows_are_done(tmp_path: Path) -> None:
    file = tmp_path / "long.csv"
    file.write_text(rows_of(31, STEADY), newline="")
    master, slave = os.openpty()
    seen = bytearray()

    async def scene() -> None:
        loop = asyncio.get_running_loop()
        loop.add_reader(master, lambda: seen.extend(os.read(master, 4_096)))
        async with bus_and_command(
            tmp_path, "queue", "put", "LINK", "10", str(file), errors=slave
        ) as (_bus, command):
            async with asyncio.timeout(PATIENCE):
                await command.communicate()
            assert command.returncode == 0
            await reached(lambda: b"100%" in seen)
        loop.remove_reader(master)

    try:
        asyncio.run(scene())
    finally:
        os.close(master)
        os.close(slave)
    assert b"running" in seen


# ------------------------------------------------------------------------------- calibrate


def test_a_node_is_timed_and_what_it_needs_is_proposed_as_json(capsys: Captured) -> None:
    with served("--ephemeral", "--nodes", "11") as real:
        command = ["calibrate", real.link, "11", "--rpm", "60", "--seconds", "1"]
        assert run([*command, "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert (report["node"], report["rpm"], report["steps"]) == (11, 60, 200)
        assert report["nominal_us"] == pytest.approx(1_600_521)
        # By this machine's clock: as punctual as it wakes.
        assert 0.8 < report["factor"] < 1.2
        assert report["clock_ppm"] == pytest.approx(1e6 * (1 / report["factor"] - 1))
        assert run(command) == 0
    first, second, *proposed = capsys.readouterr().out.splitlines()
    assert first.startswith("node 11: 200 steps at 60 RPM took ")
    assert second.startswith("factor ")
    assert proposed


def test_a_bus_that_runs_faster_than_its_time_is_no_oscillators_error(
    sacbus: Sacbus, capsys: Captured
) -> None:
    # The bus's time runs ten times as fast as ours.
    assert run(["calibrate", sacbus.link, "11", "--rpm", "60", "--seconds", "10"]) == 1
    written = capsys.readouterr()
    assert written.out == ""
    assert written.err.startswith("error: node 11: 10.601 s of motion took 1.")
    assert written.err.endswith("that its bus runs in real time (serve without --speed)\n")
    assert written.err.count("\n") == 1


@pytest.mark.parametrize(
    ("found", "lines"),
    [
        (
            (Calibration(10, 60, 12_000, 60 * SECOND, 60_018_000_000, -300.0, 11, 0, -0.1)),
            [
                "node 10: 12000 steps at 60 RPM took 60.018000 s of 60.000000 s",
                "factor 1.000300; its clock is off by -300 ppm",
                "proposed: ihd 11, xclk 0, which leaves -0 ppm at 60 RPM",
                "to set them: 10$CH11, 10$R",
            ],
        ),
        (
            (Calibration(10, 60, 12_000, 60 * SECOND, 59_400_000_000, 10_101.0, 0, 93, 9.8)),
            [
                "node 10: 12000 steps at 60 RPM took 59.400000 s of 60.000000 s",
                "factor 0.990000; its clock is off by +10101 ppm",
                "proposed: ihd 0, xclk 93, which leaves +10 ppm at 60 RPM",
                "to set them: 10$CH0, 10$CI93, 10$R",
            ],
        ),
        (
            (Calibration(10, 60, 12_000, 60 * SECOND, 60 * SECOND, 0.0, 8, 0, 0.0)),
            [
                "node 10: 12000 steps at 60 RPM took 60.000000 s of 60.000000 s",
                "factor 1.000000; its clock is off by +0 ppm",
                "ihd 8 and xclk 0 are as good as can be",
            ],
        ),
    ],
)
def test_what_was_found_is_told_with_what_to_do(found: Calibration, lines: list[str]) -> None:
    assert result_lines(found, Drive()) == lines


def test_in_true_time_the_factor_is_1(tmp_path: Path) -> None:
    arguments = ("calibrate", "LINK", "10", "--rpm", "160", "--seconds", "1", "--json")

    async def scene() -> None:
        async with bus_and_command(tmp_path, *arguments) as (_bus, command):
            async with asyncio.timeout(PATIENCE):
                out, err = await command.communicate()
            assert err == b""
            assert command.returncode == 0
            # As far as a busy machine can tell the time.
            assert json.loads(out)["factor"] == pytest.approx(1, abs=0.2)

    asyncio.run(scene())


def test_ctrl_c_stops_the_node_and_switches_soft_ops_off(tmp_path: Path) -> None:
    async def scene() -> None:
        async with bus_and_command(tmp_path, "calibrate", "LINK", "10") as (bus, command):
            await reached(lambda: bus.snapshot(10).position_steps > 20)
            command.send_signal(signal.SIGINT)
            async with asyncio.timeout(PATIENCE):
                _out, err = await command.communicate()
            assert (command.returncode, err.strip()) == (130, b"interrupted")
            seen = bus.snapshot(10)
            assert seen.state == "STANDBY"
            assert seen.position_steps < 12_000

    asyncio.run(scene())


def test_nobody_there_to_calibrate_is_status_4(sacbus: Sacbus, capsys: Captured) -> None:
    assert run(["calibrate", sacbus.link, "99"]) == 4
    assert capsys.readouterr().err.startswith("error: node 99: '$O1' sent 3 times")
