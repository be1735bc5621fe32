"""A recording as a capture: as a capture of the same bus at the same time would have been."""

from __future__ import annotations

import asyncio
import io
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND
from sacbus.bus import Bus, Transmission
from sacbus.daemon import Configuration, HostedBus, open_bus
from sacbus.feed.server import sent_line
from sacbus.host import run_virtual
from sacbus.kernel import MS, SECOND, Kernel, LineRate, Ns
from sacbus.node import KindError
from sacbus.trace import Recorder, read, write_pcapng
from sacbus.trace import exchange as room
from sacbus.trace.capture import Capture
from sacbus.trace.records import Sent
from sacbus.watch import Entry, Watch
from tests.trace.captured import interfaces_of, packets_of, remarks_of, time_ns
from tests.trace.session import EVERYTHING
from tests.watch.rig import M400

Summed = tuple[int, int, bytes, int | None, dict[str, str]]
"""A packet of a capture: interface, time, bytes, what is missing before it, remarks."""

#: A time between two transmissions of a session, s.
STEP: Final = 0.15


def summed(capture: bytes) -> list[Summed]:
    return [
        (
            packet.interface_id,
            time_ns(packet),
            packet.packet_data,
            packet.options.get("epb_dropcount"),
            remarks_of(packet),
        )
        for packet in packets_of(capture)
    ]


def captured(recording: bytes) -> bytes:
    file = io.BytesIO()
    write_pcapng(read(io.BytesIO(recording)), file)
    return file.getvalue()


def test_what_was_recorded_is_captured_as_if_it_had_been_looked_at() -> None:
    sink = io.BytesIO()
    entries: list[Entry] = []

    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10, 11))) as hosted:
            bus = hosted.bus
            watch = Watch(bus.protocol, bus.rate)
            bus.medium.watchers.append(
                lambda sent: entries.extend(watch.sent(sent_line(sent, bus)))
            )
            with Recorder(hosted, sink):
                for data in EVERYTHING:
                    bus.medium.transmit("somebody", data, 0)
                    await asyncio.sleep(STEP)
                await asyncio.sleep(60)
            entries.extend(watch.end(bus.kernel.now))

    run_virtual(Kernel(), scene())
    capture = Capture()
    line = capture.line("bus", "sac", LineRate())
    looked_at = capture.header + line.header + b"".join(map(line.blocks, entries))
    expected = summed(looked_at)
    assert len(expected) > 50
    assert sum("collision with" in one[-1] for one in expected) == 2
    exported = captured(sink.getvalue())
    told = summed(exported)
    for one in told:
        for key, name in one[-1].items():
            one[-1][key] = name.replace("link 1", "somebody")
    assert told == expected
    (interface,) = interfaces_of(exported)
    assert interface.options["if_name"] == "bus"
    assert interface.options["if_description"] == "sac at 38400 baud, bus time since 1970"


def test_every_recorded_bus_is_an_interface_of_its_own() -> None:
    sink = io.BytesIO()

    async def scene() -> None:
        async with (
            open_bus(Configuration(nodes=(10,), name="left")) as left,
            open_bus(Configuration(nodes=(10,), name="right", baud=19_200)) as right,
        ):
            with Recorder([left, right], sink):
                await asyncio.gather(_ask(left), _ask(right))

    run_virtual(Kernel(), scene())
    exported = captured(sink.getvalue())
    assert [one.options["if_name"] for one in interfaces_of(exported)] == ["left", "right"]
    assert [one.options["if_speed"] for one in interfaces_of(exported)] == [38_400, 19_200]
    told = summed(exported)
    assert sorted(one[0] for one in told) == [0, 0, 1, 1]
    assert [one[2] for one in told if one[0] == 0] == [one[2] for one in told if one[0] == 1]


async def _ask(hosted: HostedBus) -> None:
    await hosted.mother().send(10, "v20")


def test_a_recording_without_traffic_is_a_capture_without_packets() -> None:
    sink = io.BytesIO()

    async def scene() -> None:
        async with open_bus(Configuration(nodes=())) as hosted:
            Recorder(hosted, sink).close()

    run_virtual(Kernel(), scene())
    exported = captured(sink.getvalue())
    assert len(interfaces_of(exported)) == 1
    assert packets_of(exported) == []


def test_what_is_unfinished_at_the_end_is_captured_too() -> None:
    sink = io.BytesIO()

    async def scene() -> None:
        async with open_bus(Configuration(nodes=(10,))) as hosted:
            with Recorder(hosted, sink):
                hosted.bus.medium.transmit("somebody", M400[:6], 0)
                await asyncio.sleep(0.1)

    run_virtual(Kernel(), scene())
    ((_, _, data, _, remarks),) = summed(captured(sink.getvalue()))
    assert (data, remarks["garbage"]) == (M400[:6], "unfinished")


def test_a_protocol_that_nobody_here_speaks_is_told_in_a_line() -> None:
    head = (
        '{"sacbus":"recording","format":1,"buses":[{"bus":0,"name":"left","protocol":"tongues",'
        '"baud":38400,"bits":10,"lanes":1,"seed":0,"nodes":[]}]}\n'
    )
    with pytest.raises(KindError) as refused:
        captured(head.encode())
    assert str(refused.value.args[0]) == (
        "no node kind that is installed speaks 'tongues', bus left, "
        "install the package of its nodes"
    )


@given(
    st.lists(st.tuples(st.integers(0, 1), st.integers(0, 10 * MS), st.integers(1, 30)), max_size=12)
)
def test_who_talked_over_whom_follows_from_the_times(said: list[tuple[int, Ns, int]]) -> None:
    kernel = Kernel()
    over: list[Transmission] = []
    bus = Bus(kernel, KIND.protocol, lanes=2)
    bus.medium.watchers.append(over.append)
    for lane, at, size in said:
        kernel.at(at, bus.medium.transmit, object(), b"\x55" * size, lane)
    kernel.run_until(SECOND)
    records = [
        Sent(one.end, 0, one.start, one.end, one.lane, "link 1", one.data, one.data, one.collided)
        for one in over
    ]
    (hits,) = room._hits(records, 1)
    told: dict[int, Any] = {number: sorted(one) for number, one in hits.items()}
    assert told == {
        number: sorted(one.hits) for number, one in enumerate(over) if one.hits is not None
    }
