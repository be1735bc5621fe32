"""VCD: an independent reader finds exactly the pulses that the positions say."""

from __future__ import annotations

import asyncio
import shutil
import subprocess
from io import BytesIO, StringIO
from pathlib import Path

import numpy as np
import pytest

from sacbus.daemon import Configuration, HostedBus
from sacbus.kernel import MS, SECOND
from sacbus.mother import Mother
from sacbus.trace import Recorder, Recording, read
from sacbus.trace import vcd as vcd_file
from sacbus.trace.records import Sent
from sacbus.trace.vcd import Signal, write_vcd
from tests.trace.rig import Dump, recorded, two_axes


def dumped(recording: Recording) -> Dump:
    out = StringIO()
    write_vcd(recording, out)
    return Dump(out.getvalue())


async def busy(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
    """Seamless commands, microsteps, a stop in mid-move, endless motion, another velocity."""
    await mother.send(10, "m300v200d999")
    await mother.send(10, "m300v200a999d999")
    await mother.send(10, "m-100v300")
    await mother.send(11, "mv100")
    for rpm in (120, 80, 300):
        await asyncio.sleep(0.3)
        await mother.send(11, f"v{rpm}")
    await asyncio.sleep(0.4)
    await mother.send(11, "s")
    await asyncio.sleep(1.2)
    await mother.send(11, "+-++")
    await two_axes(bus, mother, recorder)


PLAYS = pytest.mark.parametrize(
    ("play", "settings"),
    [
        (two_axes, {}),
        (busy, {}),
        (busy, {"ustep": 4, "pulse": 20}),
        (busy, {"ppm": 77, "ops": 0, "cw": True}),
        (busy, {"auto_micro": True, "ustep": 3}),
    ],
)


@PLAYS
def test_its_pulses_are_those_that_the_positions_say(
    play: object, settings: dict[str, object]
) -> None:
    recording = recorded(play, Configuration(nodes=(10, 11), settings=settings))  # type: ignore[arg-type]
    dump = dumped(recording)
    assert dump.timescale == "1 ns"
    assert dump.end == recording.end
    for node in (10, 11):
        track = recording.track(node)
        rises = np.array(dump.rises(f"bus.node_{node}.clk"))
        pulses = track.pulses(0, recording.end + 1)
        assert rises.size == pulses.size > 0
        # Single pulses of one instant are shown one after the other; all others at their time.
        alone = np.append(True, np.diff(pulses) > 0) & np.append(np.diff(pulses) > 0, True)
        assert np.array_equal(rises[alone], pulses[alone])
        # Counted with the level of dir at each, they lead where the node was.
        directions = dump.edges[f"bus.node_{node}.dir"]
        clockwise = "1" if settings.get("cw") else "0"
        began = 0
        restarts = [one.since for one in track.segments if one.anew][1:]
        for until in (*restarts, recording.end + 1):
            position = 0
            for rise in rises[(rises >= began) & (rises < until)].tolist():
                level = [level for when, level in directions if when <= rise][-1]
                position += 1 if level == clockwise else -1
            assert position == track.position(until - 1)
            began = until


@PLAYS
def test_its_other_signals_are_those_of_the_pins(play: object, settings: dict[str, object]) -> None:
    recording = recorded(play, Configuration(nodes=(10, 11), settings=settings))  # type: ignore[arg-type]
    dump = dumped(recording)
    for node in (10, 11):
        track = recording.track(node)
        for name in ("dir", "op_sa", "op_sb", "ms1", "ms2", "ms3"):
            edges = dump.edges[f"bus.node_{node}.{name}"]
            for when, level in edges:
                assert str(track.levels(when)[name]) == level
            for at in range(0, recording.end, recording.end // 97):
                level = [level for when, level in edges if when <= at][-1]
                assert str(track.levels(at)[name]) == level
    sent = [one for one in recording if isinstance(one, Sent) and one.sender == 11]
    edges = dump.edges["bus.node_11.tx_en"][1:]
    assert edges == [edge for one in sent for edge in ((one.start, "1"), (one.end, "0"))]
    assert [level for _, level in dump.edges["bus.node_11.sync"]] == ["1", "0", "1"]


def test_single_pulses_are_shown_one_after_the_other() -> None:
    async def play(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await mother.send(10, "+++++")
        await mother.send(10, "m3")
        await asyncio.sleep(1)

    recording = recorded(play)
    dump = dumped(recording)
    rises = dump.rises("bus.node_10.clk")
    assert len(rises) == 8
    assert np.diff(rises[:5]).tolist() == [2_000] * 4


@pytest.mark.parametrize("page", [MS, 50 * MS, SECOND, 3_600 * SECOND])
def test_pages_leave_no_trace(page: int, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = recorded(busy)
    whole = StringIO()
    write_vcd(recording, whole)
    monkeypatch.setattr(vcd_file, "LONGEST", page)
    paged = StringIO()
    write_vcd(recording, paged)
    assert paged.getvalue() == whole.getvalue()


def test_many_edges_make_pages_shorter(monkeypatch: pytest.MonkeyPatch) -> None:
    recording = recorded(busy)
    whole = StringIO()
    write_vcd(recording, whole)
    monkeypatch.setattr(vcd_file, "MANY", 40)
    paged = StringIO()
    write_vcd(recording, paged)
    assert paged.getvalue() == whole.getvalue()


def test_only_the_nodes_that_are_asked_for() -> None:
    out = StringIO()
    write_vcd(recorded(two_axes), out, nodes=[(0, 11)])
    assert {name.split(".")[1] for name in Dump(out.getvalue()).edges} == {"node_11"}


def test_signals_that_are_no_nodes_are_written_among_theirs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    recording = recorded(two_axes)
    later = [*recording][-1].when + SECOND
    times = np.array([5, 1_000_000_000, 1_000_000_000, later], dtype=np.int64)
    signals = [
        Signal("others", "one", 1, times[:3:2], np.array([0, 1], dtype=np.uint8)),
        Signal("others", "a b", 0, times[1::2], np.array([1, 0], dtype=np.uint8)),
        Signal("others", "none", 1, times[:0], times[:0]),
    ]
    out = StringIO()
    written = write_vcd(recording, out, signals=signals)
    dump = Dump(out.getvalue())
    begin = next(iter(recording)).when
    assert dump.edges["others.one"] == [(begin, "1"), (5, "0"), (1_000_000_000, "1")]
    assert dump.edges["others.a_b"] == [(begin, "0"), (1_000_000_000, "1"), (later, "0")]
    assert dump.edges["others.none"] == [(begin, "1")]
    # It goes on until they are over; of the nodes it tells what it would without them.
    assert dump.end == later
    alone = dumped(recording)
    assert {name: dump.edges[name] for name in alone.edges} == alone.edges
    assert written == write_vcd(recording, StringIO()) + 4
    # One after the other as they were given, where both change at one instant.
    body = out.getvalue().partition("#1000000000\n")[2].splitlines()
    assert [line[0] for line in body[:2]] == ["1", "1"]
    monkeypatch.setattr(vcd_file, "LONGEST", 50 * MS)
    paged = StringIO()
    write_vcd(recording, paged, signals=signals)
    assert paged.getvalue() == out.getvalue()


def test_one_that_was_killed_at_once_is_empty_and_well_formed() -> None:
    sink = BytesIO()
    recorded(two_axes, sink=sink)
    head = sink.getvalue().splitlines(keepends=True)[0]
    out = StringIO()
    assert write_vcd(read(BytesIO(head)), out) == 0
    assert Dump(out.getvalue()).timescale == "1 ns"


@pytest.mark.skipif(shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed")
def test_sigrok_finds_the_same_pulses(tmp_path: Path) -> None:
    async def play(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await mother.send(10, "m40v300")
        await asyncio.sleep(1)
        await mother.send(10, "+++")

    recording = recorded(play, Configuration(nodes=(10,), settings={"pulse": 200}))
    path = tmp_path / "run.vcd"
    with path.open("w") as out:
        write_vcd(recording, out)
    pulses = recording.track(10).pulses(0, recording.end + 1)
    # A sample a microsecond: one a ns would be too many, and no level of clk is shorter.
    done = subprocess.run(
        [
            *("sigrok-cli", "-I", "vcd:downsample=1000", "-i", str(path)),
            *("-O", "csv:header=false", "-C", "clk"),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    clk = np.array([int(line) for line in done.stdout.split() if line in ("0", "1")])
    assert int((np.diff(clk) == 1).sum()) == pulses.size == 43
