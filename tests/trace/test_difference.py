"""Two recordings compared: what counts, and what tolerances forgive."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from io import BytesIO

import pytest

from sacbus.daemon import Configuration, HostedBus
from sacbus.kernel import MS, US
from sacbus.mother import Mother
from sacbus.trace import Recorder, Recording, read
from sacbus.trace.difference import Difference, differences
from tests.trace.rig import Play, recorded, two_axes


def moving(*lines: str, after: float = 0.1, node: int = 10) -> Play:
    async def play(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await asyncio.sleep(after)
        for line in lines:
            await mother.send(node, line)
        await asyncio.sleep(2)

    return play


def of(*lines: str, after: float = 0.1, **settings: object) -> Recording:
    return recorded(moving(*lines, after=after), Configuration(nodes=(10, 11), settings=settings))


def test_what_is_the_same_has_none() -> None:
    assert not differences(recorded(two_axes), recorded(two_axes))


def test_another_command_is_told_with_time_node_and_what_came_of_it() -> None:
    found = differences(of("m400v120"), of("m400v121"))
    assert [one.what for one in found[:1]] == ["packet"]
    assert (found[0].expected, found[0].got) == ("1>10 'm400v120'", "1>10 'm400v121'")
    assert {one.what for one in found} == {"packet", "state", "position"}
    assert all(one.node == 10 for one in found if one.what != "packet")
    whens = [one.when for one in found]
    assert whens == sorted(whens)
    (position,) = [one for one in found if one.what == "position"]
    assert abs(float(position.expected.split()[0]) - float(position.got.split()[0])) == 1


@pytest.mark.parametrize("late", [3 * MS, 11 * MS])
def test_what_ends_as_much_later_as_is_allowed_is_no_difference(late: int) -> None:
    def ending(after: float) -> Recording:
        """Over with the last change of state, as a scenario is that waits for it."""

        async def play(bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
            await asyncio.sleep(after)
            await mother.send(10, "m100v120")
            while bus.snapshot(10).state != "STANDBY":  # noqa: ASYNC110 (virtual time)
                await asyncio.sleep(0.000_1)

        return recorded(play, Configuration(nodes=(10,)))

    one, other = ending(0.1), ending(0.1 + late / 1e9)
    for first, second in ((one, other), (other, one)):
        found = differences(first, second, within=10 * MS)
        assert bool(found) is (late > 10 * MS)


def test_a_packet_that_is_missing_is_told_once() -> None:
    fewer, more = of("m100", " "), of("m100", "v50", " ")
    packets = [one for one in differences(fewer, more, within=100 * MS) if one.what == "packet"]
    assert packets[0].expected == "nothing"
    assert packets[0].got == "1>10 'v50'"
    assert len(packets) == 2  # it, and its ACK
    back = [one for one in differences(more, fewer, within=100 * MS) if one.what == "packet"]
    assert (back[0].expected, back[0].got) == ("1>10 'v50'", "nothing")
    assert len(back) == 2


def test_a_line_more_in_the_middle_is_told_and_not_all_that_it_delays() -> None:
    lines = [f"v{rpm}" for rpm in range(50, 80)]
    fewer, more = of(*lines), of(*lines[:15], "l3", *lines[15:])
    packets = [one for one in differences(fewer, more) if one.what == "packet"]
    extra, late, answer = packets
    assert (extra.expected, extra.got) == ("nothing", "1>10 'l3'")
    assert (answer.expected, answer.got) == ("nothing", "10>1 'ACK'")
    assert (late.expected, late.got.partition(" +")[0]) == ("1>10 'v65'", "1>10 'v65'")


def test_a_motion_more_is_told_by_its_states_and_not_all_that_follow() -> None:
    async def play(mother: Mother, *, more: bool) -> None:
        for number in range(8):
            await mother.send(10, "m100v120")
            await asyncio.sleep(3)
            if more and number == 3:
                await mother.send(10, "m-50v120")
                await asyncio.sleep(0.004)
            await asyncio.sleep(2)

    async def fewer(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await play(mother, more=False)

    async def longer(_bus: HostedBus, mother: Mother, _recorder: Recorder) -> None:
        await play(mother, more=True)

    nodes = Configuration(nodes=(10, 11))
    found = differences(recorded(fewer, nodes), recorded(longer, nodes), within=1 * US)
    states = [(one.expected, one.got.split()[0]) for one in found if one.what == "state"]
    assert [got for expected, got in states if expected == "nothing"] == [
        *("STOP", "ACCEL", "DECEL", "STANDBY"),
    ]
    assert len(states) == 4 + 1


@pytest.mark.parametrize(("within", "same"), [(0, False), (900 * US, False), (1_100 * US, True)])
def test_time_may_differ_by_the_tolerance(within: int, same: bool) -> None:
    assert (not differences(of("m400"), of("m400", after=0.101), within=within)) is same


@pytest.mark.parametrize(("steps", "same"), [(0.0, False), (1.0, False), (2.0, True)])
def test_positions_may_differ_by_the_tolerance(steps: float, same: bool) -> None:
    one, other = of("+", " ", " "), of("+", "+", "+")
    found = differences(one, other, within=3_000 * MS, steps=steps)
    assert (not [each for each in found if each.what == "position"]) is same


def test_a_slower_clock_shows_in_positions_and_states() -> None:
    found = differences(of("m400v120"), of("m400v120", ppm=-50_000))
    assert {one.what for one in found} == {"state", "position"}


@pytest.mark.parametrize(
    ("configuration", "what", "got"),
    [
        (lambda: Configuration(nodes=(10,)), "nodes", "bus.10 (sac)"),
        (lambda: Configuration(nodes=(10, 11), name="other"), "buses", "other"),
    ],
)
def test_other_nodes_or_buses_are_all_that_is_told(
    configuration: Callable[[], Configuration], what: str, got: str
) -> None:
    (found,) = differences(of("m100"), recorded(moving("m100"), configuration()))
    assert (found.what, found.got) == (what, got)


@pytest.mark.parametrize("lines", [0, -1, -20])
def test_one_that_was_cut_off_is_not_the_same_as_a_whole_one(lines: int) -> None:
    sink = BytesIO()
    whole = recorded(two_axes, sink=sink)
    written = sink.getvalue().splitlines(keepends=True)
    less = b"".join(written[:lines]) if lines else sink.getvalue()[:-5]
    for pair in ((whole, read(BytesIO(less))), (read(BytesIO(less)), whole)):
        found = [one for one in differences(*pair) if one.what == "its end"]
        assert {found[0].expected, found[0].got} == {"closed", "cut off"}
        assert len(found) == 1


def test_a_node_that_tells_nothing_is_not_the_same_as_one_that_does() -> None:
    sink = BytesIO()
    whole = recorded(two_axes, sink=sink)
    kept = [line for line in sink.getvalue().splitlines(keepends=True) if b'"moves"' not in line]
    found = differences(whole, read(BytesIO(b"".join(kept))))
    assert [(one.node, one.what, one.got) for one in found if one.what == "motion"] == [
        (10, "motion", "nothing"),
        (11, "motion", "nothing"),
    ]


def test_one_that_goes_on_longer_is_told_where_all_else_is_the_same() -> None:
    async def longer(bus: HostedBus, mother: Mother, recorder: Recorder) -> None:
        await moving("m100")(bus, mother, recorder)
        await asyncio.sleep(1)

    configuration = Configuration(nodes=(10, 11))
    shorter, other = of("m100"), recorded(longer, configuration)
    (found,) = differences(shorter, other)
    assert found.what == "its end"
    assert not differences(shorter, other, within=1_001 * MS)


def test_a_difference_reads_as_a_line() -> None:
    one = Difference(1_500_000_001, "bus", 10, "state", "CRUISE", "DECEL")
    assert str(one) == "1.500000001 s, bus, node 10: state: expected CRUISE, got DECEL"
