"""What is recorded, when it is written, and what becomes of a sink that takes no more."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import json
import pickle
import re
from contextlib import AsyncExitStack
from io import BytesIO, FileIO
from pathlib import Path

import pytest

from sacbus.bus import BitErrors, Dead, NoiseBursts, WrongBaud
from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.host import run_virtual
from sacbus.kernel import SECOND, Kernel, Ns
from sacbus.mother import Mother, MotherError
from sacbus.trace import Recorder, Recording, RecordingCutOff, read
from sacbus.trace.difference import differences
from sacbus.trace.records import Driven, Ended, FaultSet, Mark, Moved, Sent, Switched, Told, Turned
from tests.trace.rig import recorded, two_axes


def test_two_runs_leave_the_same_bytes() -> None:
    sinks = BytesIO(), BytesIO()
    for sink in sinks:
        recorded(two_axes, sink=sink)
    assert sinks[0].getvalue() == sinks[1].getvalue()


def test_it_holds_bus_time_and_no_place() -> None:
    sink = BytesIO()
    recorded(two_axes, sink=sink)
    text = sink.getvalue().decode()
    assert str(Path.cwd()) not in text
    times = [json.loads(line)["t"] for line in text.splitlines()[1:]]
    assert times == sorted(times)


def test_everything_that_happens_is_in_it() -> None:
    records = list(recorded(two_axes))
    kinds = {type(one) for one in records}
    assert kinds == {Sent, Told, Moved, Driven, Switched, Mark, Ended}
    sent = [one for one in records if isinstance(one, Sent)]
    assert [one.sender for one in sent[:2]] == ["mother", 10]
    assert sent[1].data == bytes.fromhex("02 01 0a 06")
    assert sent[1].end - sent[1].start == 4 * 10 * SECOND // 38_400
    driven = [(one.node, one.pin, one.level) for one in records if isinstance(one, Driven)]
    assert driven == [(11, "sync", 0), (11, "sync", 1)]
    switched = [(one.node, one.on) for one in records if isinstance(one, Switched)]
    assert switched == [(10, False), (10, True)]
    (mark,) = [one for one in records if isinstance(one, Mark)]
    assert (mark.text, mark.details) == ("sync falls", {"axis": 11})


def test_what_a_node_reports_and_a_turned_encoder_are_in_it() -> None:
    async def play(bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await mother.send(10, "zzz")
        bus.panel(11).turn(-2)

    records = list(recorded(play))
    (told,) = [one for one in records if isinstance(one, Told)]
    assert (told.node, told.kind, told.line) == (10, "refused", "zzz")
    (turned,) = [one for one in records if isinstance(one, Turned)]
    assert (turned.node, turned.detents) == (11, -2)


def test_what_two_talkers_spoil_is_told_as_sent_and_as_arrived() -> None:
    async def play(bus: HostedBus, _mother: Mother, _recorder: Recorder) -> None:
        one, other = object(), object()
        bus.bus.medium.transmit(one, b"\x02\x0am\x03", 0)
        await asyncio.sleep(0.0003)
        bus.bus.medium.transmit(other, b"\x02\x0bm\x03", 0)
        await asyncio.sleep(0.1)

    sent = [one for one in recorded(play) if isinstance(one, Sent)]
    assert [(one.sender, one.data) for one in sent] == [
        ("link 1", b"\x02\x0am\x03"),
        ("link 2", b"\x02\x0bm\x03"),
    ]
    assert all(one.collided and one.arrived != one.data for one in sent)
    assert sent[0].arrived[:1] == b"\x02"


def damaged(seed: int) -> tuple[bytes, Recording]:
    async def play(bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        faults = [bus.fault(one) for one in (BitErrors(0.003), NoiseBursts(20, 2))]
        for number in range(40):
            with contextlib.suppress(MotherError):
                await mother.send(10, f"m{number + 1}v100")
        for fault in faults:
            fault.off()

    sink = BytesIO()
    recording = recorded(play, Configuration(nodes=(10, 11), seed=seed), sink)
    return sink.getvalue(), recording


def test_the_same_seed_of_faults_leaves_the_same_bytes_and_another_others() -> None:
    one, again, other = damaged(1), damaged(1), damaged(2)
    assert one[0] == again[0]
    assert one[0] != other[0]
    assert list(differences(one[1], other[1]))


def test_faults_and_what_they_did_are_in_it() -> None:
    records = list(damaged(1)[1])
    faults = [one for one in records if isinstance(one, FaultSet)]
    assert [(one.name, one.on) for one in faults] == [
        ("bit_errors", True),
        ("noise_bursts", True),
        ("bit_errors", False),
        ("noise_bursts", False),
    ]
    assert faults[0].details == {"fault": "BitErrors(rate=0.003)"}
    sent = [one for one in records if isinstance(one, Sent)]
    flipped = sum(
        (before ^ after).bit_count()
        for one in sent
        if one.faults == ("bit_errors",) and not one.collided
        for before, after in zip(one.data, one.arrived, strict=True)
    )
    count = faults[2].details["count"]
    assert isinstance(count, int)
    assert 0 < flipped <= count
    assert "noise_bursts" in {one.sender for one in sent}


def test_who_was_kept_from_hearing_is_told() -> None:
    async def play(bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        bus.fault(Dead(11))
        bus.fault(WrongBaud(10, 19_200))
        for node in (10, 11):
            with contextlib.suppress(MotherError):
                await mother.send(node, "m100")

    first, *_, last = [one for one in recorded(play) if isinstance(one, Sent)]
    assert first.heard.keys() == {10}
    assert first.heard[10] != first.data == first.arrived
    assert last.missed


def test_several_buses_go_into_one_recording() -> None:
    sink = BytesIO()

    async def main() -> None:
        async with (
            open_bus(Configuration(nodes=(10,), name="left")) as left,
            open_bus(Configuration(nodes=(10,), name="right")) as right,
        ):
            mothers = left.mother(), right.mother()
            with Recorder([left, right], sink):
                await mothers[0].send(10, "m100")
                await mothers[1].send(10, "m-100")
                await asyncio.sleep(3)

    run_virtual(Kernel(), main())
    recording = read(sink)
    assert [bus.name for bus in recording.buses] == ["left", "right"]
    assert recording.track(10, 0).position(3 * SECOND) == 100
    assert recording.track(10, 1).position(3 * SECOND) == -100
    said = [[one.said.words for one in recording.packets(bus)] for bus in (0, 1)]
    assert [len(one) for one in said] == [2, 2]


def test_a_node_keeps_the_name_that_it_was_configured_with() -> None:
    async def play(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await mother.send(10, "$F40")
        await mother.send(10, "$R")
        await asyncio.sleep(0.1)

    recording = recorded(play)
    assert {one.node for one in recording if isinstance(one, Moved)} == {10, 11}


class Full(BytesIO):
    """A disk that is full after so many bytes."""

    def __init__(self, room: int) -> None:
        super().__init__()
        self._room = room

    def write(self, data: object, /) -> int:
        if self.tell() > self._room:
            raise OSError(errno.ENOSPC, "No space left on device")
        assert isinstance(data, bytes)
        return super().write(data)


def test_a_full_disk_ends_the_recording_and_not_the_bus() -> None:
    reports: list[str] = []

    async def play(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
        for _ in range(6):
            await mother.send(10, "m10v300")
            await asyncio.sleep(1)
        reports.extend(report.text for report in bus.bus.reports)
        assert recorder.fault is not None
        assert bus.snapshot(10).position_pulses == 60

    sink = Full(3_000)
    recording = recorded(play, sink=sink)
    (told,) = [text for text in reports if text.startswith("the recording")]
    found = re.fullmatch(
        r"the recording ends at (\d\.\d{6}) s: No space left on device, "
        "what came before is kept, record elsewhere",
        told,
    )
    assert found is not None
    assert list(recording)
    assert abs(recording.end - float(found[1]) * SECOND) < 1_000
    assert not recording.whole


def test_whoever_asks_is_told_at_once_that_nothing_more_can_be_written() -> None:
    told: list[tuple[Ns, RecordingCutOff]] = []

    async def main() -> None:
        async with open_bus(Configuration(nodes=(10, 11))) as bus:
            kernel = bus.bus.kernel
            recorder = Recorder(
                bus, Full(0), cut_off=lambda fault: told.append((kernel.now, fault))
            )
            recorder.flush()
            begun = kernel.now
            await asyncio.sleep(0.5)
            recorder.mark("no room for it")
            recorder.flush()
            assert len(told) == 1
            await asyncio.sleep(0.5)
            recorder.mark("nor for this")
            recorder.close()
            ((when, fault),) = told
            assert fault is recorder.fault
            assert fault.kept == begun
            assert when - begun == pytest.approx(SECOND // 2, abs=1)
            assert fault.reason == "No space left on device"

    run_virtual(Kernel(), main())


def test_a_disk_without_any_room_keeps_nothing_even_of_many_nodes() -> None:
    told: list[RecordingCutOff] = []

    async def main() -> None:
        # What these tell at their beginning is more than what is written together.
        nodes = [range(20, 240), range(20, 240), range(20, 240)]
        async with AsyncExitStack() as stack:
            buses = [
                await stack.enter_async_context(
                    open_bus(Configuration(name=str(number), nodes=tuple(some)))
                )
                for number, some in enumerate(nodes)
            ]
            recorder = Recorder(buses, Full(-1), cut_off=told.append)
            assert not any(bus.bus.medium.watchers for bus in buses)
            recorder.close()

    run_virtual(Kernel(), main())
    (fault,) = told
    assert fault.kept is None
    assert str(fault) == (
        "the recording could not be begun: No space left on device, nothing is kept, "
        "record elsewhere"
    )


def test_who_raises_upon_a_cut_off_leaves_nobody_on_the_bus_even_at_the_beginning() -> None:
    def refuse(fault: RecordingCutOff) -> None:
        raise fault

    async def main() -> None:
        # What it tells at its beginning is more than what is written together.
        async with (
            open_bus(Configuration(name="a", nodes=tuple(range(20, 240)))) as first,
            open_bus(Configuration(name="b", nodes=tuple(range(20, 240)))) as second,
            open_bus(Configuration(name="c", nodes=tuple(range(20, 240)))) as third,
        ):
            buses = [first, second, third]
            with pytest.raises(RecordingCutOff):
                Recorder(buses, Full(-1), cut_off=refuse)
            assert not any(bus.bus.medium.watchers for bus in buses)
            assert not any(bus.bus.report_watchers for bus in buses)

    run_virtual(Kernel(), main())


def test_a_cut_off_keeps_nothing_from_another_who_watches() -> None:
    starts: list[Ns] = []

    async def main() -> int:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            Recorder(bus, Full(-1))
            bus.bus.medium.watchers.append(lambda sent: starts.append(sent.start))
            mother = bus.mother()
            for _ in range(300):
                await mother.send(10, "")
            return mother.statistics[10].acks

    answered = run_virtual(Kernel(), main())
    assert len(starts) == 2 * answered == 600


def test_a_sink_that_takes_nothing_ends_the_recording() -> None:
    class Stuck(BytesIO):
        """A pipe that does not block, while it is full."""

        def write(self, _data: object, /) -> int:
            return 0

    async def main() -> RecordingCutOff | None:
        async with open_bus(Configuration(nodes=(10,))) as bus:
            with Recorder(bus, Stuck()) as recorder:
                recorder.flush()
            return recorder.fault

    fault = run_virtual(Kernel(), main())
    assert fault is not None
    assert fault.reason == "it takes nothing at present"
    again = pickle.loads(pickle.dumps(fault))  # noqa: S301 (our own)
    assert (str(again), again.errno) == (str(fault), errno.EAGAIN)


def test_a_sink_without_a_buffer_is_written_whole_and_read_back(tmp_path: Path) -> None:
    class Grudging(FileIO):
        """Takes a few bytes at a time, as a pipe may."""

        def write(self, data: object, /) -> int:
            assert isinstance(data, bytes)
            return super().write(data[:1_000])

    whole = BytesIO()
    recorded(two_axes, sink=whole)
    with Grudging(tmp_path / "run.jsonl", "w+b") as sink:
        recording = recorded(two_axes, sink=sink)
        assert [type(one) for one in recording] == [type(one) for one in read(whole)]
        assert recording.whole
    assert (tmp_path / "run.jsonl").read_bytes() == whole.getvalue()


def test_lines_are_written_within_a_second_of_bus_time() -> None:
    sink = BytesIO()

    async def play(_bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
        await mother.send(10, "m10v10")
        assert not sink.getvalue().count(b'"is":"sent"')
        await asyncio.sleep(1)
        await mother.send(10, "m10v10")
        assert sink.getvalue().count(b'"is":"sent"') == 2
        recorder.flush()
        assert sink.getvalue().count(b'"is":"sent"') == 4
        assert recorder.tail[-1].encode() in sink.getvalue()

    recorded(play, sink=sink)


def test_one_that_is_closed_hears_nothing_any_more() -> None:
    sink = BytesIO()

    async def play(_bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
        await mother.send(10, "m400")
        recorder.close()
        recorder.close()
        before = sink.getvalue()
        await mother.send(10, "m400")
        await asyncio.sleep(2)
        recorder.flush()
        assert sink.getvalue() == before

    assert recorded(play, sink=sink).track(10).position(0) == 0


@pytest.mark.parametrize("settings", [{}, {"ustep": 3}, {"auto_micro": True, "ustep": 4}])
def test_a_recorded_bus_does_what_it_does_unrecorded(settings: dict[str, object]) -> None:
    seen: list[list[object]] = []
    for with_recorder in (False, True):

        async def main(record: bool = with_recorder) -> None:
            configuration = Configuration(nodes=(10, 11), settings=settings)
            async with open_bus(configuration) as bus:
                mother = bus.mother()
                recorder = Recorder(bus, BytesIO()) if record else None
                await mother.send(10, "m400v120")
                await mother.send(11, "m")
                await asyncio.sleep(0.7)
                answer = await mother.send(11, "s")
                await asyncio.sleep(1)
                seen.append([answer.round_trip, *bus.snapshots()])
                if recorder is not None:
                    recorder.close()

        run_virtual(Kernel(), main())
    assert seen[0] == seen[1]
