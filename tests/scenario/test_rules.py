"""Scenarios of plain Python that cannot be played, and what a line alone cannot show."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.bus import Dead
from sacbus.config import ConfigError
from sacbus.configuration import Configuration, check
from sacbus.kernel import SECOND
from sacbus.node import Protocol, SettingError
from sacbus.scenario import (
    Bounds,
    Counted,
    Disturb,
    NodeIs,
    PacketSeen,
    Pause,
    Pin,
    Power,
    Raw,
    Scenario,
    Send,
    Shown,
    Silent,
    Step,
    Straight,
    Turn,
    Type,
    run,
)
from sacbus.scenario.rules import refuse
from sacbus.scenario.values import Deed
from tests.mother.third_party import install

BUS = Configuration(nodes=(10, 11))
MODULES = Configuration(nodes=(30,), kind="ss-mst67")


def refusals(*steps: Step | Deed, line_only: bool = False) -> list[str]:
    made = tuple(one if isinstance(one, Step) else Step(one) for one in steps)
    with pytest.raises(ConfigError) as wrong:
        refuse(Scenario("x", (BUS,), made), line_only=line_only)
    return [str(one) for one in wrong.value.mistakes]


def test_a_scenario_of_python_is_refused_with_its_title_and_the_step() -> None:
    assert refusals(Send(("10m1",)), NodeIs((12,)), Step(Raw(b""), at=-1)) == [
        "steps[1].expect: expected nodes of bus 'bus' (10-11), got 12, 'x', correct it",
        "steps[2].at: expected a time from 0 on, got a negative one, 'x', correct it",
        "steps[2].raw: expected one byte at least, got none, 'x', give some",
    ]


def test_what_stands_in_a_file_is_refused_with_its_line() -> None:
    (told,) = refusals(Step(Turn((12,), 1), place="two.toml:7"))
    assert told == "turn: expected nodes of bus 'bus' (10-11), got 12, two.toml:7, correct it"


def test_it_is_refused_before_anything_is_played() -> None:
    with pytest.raises(ConfigError, match="expected one bus at least, got none"):
        run(Scenario("x", (), ()))
    with pytest.raises(SettingError, match="addresses from 4 to 255"):
        run(Scenario("x", (Configuration(nodes=(1,)),), ()))


@pytest.mark.parametrize(
    ("deed", "what"),
    [
        (Type((10,), "q"), "keys at a terminal"),
        (Pin((10,), {"sync": 0}), "pins"),
        (Turn((10,), 1), "an encoder"),
        (Power((10,), on=False), "a power switch"),
        (Disturb(Dead(10)), "faults of the line"),
        (NodeIs((10,), position=Bounds.exactly(1)), "the position of a node"),
        (NodeIs((10,), state="OFF"), "the state of a node"),
        (NodeIs((10,), pins={"clk": 1}), "pins"),
        (Straight((10, 11), 1), "the motion of nodes"),
        (Shown(10, "x"), "a terminal"),
        (Silent(SECOND, 10), "the silence of one node among others"),
        (Counted({"collisions": Bounds.exactly(0)}), "a count of collisions"),
    ],
    ids=repr,
)
def test_what_takes_more_than_a_line_is_refused_for_a_link(deed: Deed, what: str) -> None:
    assert refusals(Send(("10m1",)), deed, line_only=True) == [
        (
            f"steps[1]: expected what a line can show, got {what}, 'x', "
            "leave it out, or play it without --link"
        )
    ]


def test_what_a_line_can_show_is_taken_for_a_link() -> None:
    steps = (
        Step(Send(("10m1",))),
        Step(Raw(b"x"), after=PacketSeen("ack", source=10, within=SECOND)),
        Step(Silent(SECOND)),
        Step(Counted({"retries": Bounds.exactly(0), "acks": Bounds.exactly(1)})),
    )
    refuse(Scenario("x", (BUS,), steps), line_only=True)


def test_two_buses_are_no_line() -> None:
    two = (BUS, Configuration(name="b"))
    with pytest.raises(ConfigError, match="expected one bus to play on a link, got 2"):
        refuse(Scenario("x", two, ()), line_only=True)


def test_what_names_nothing_is_refused() -> None:
    assert refusals(Send(()), NodeIs(()), Type((10,), "\u20ac")) == [
        "steps[0].send: expected one line at least, got none, 'x', give one",
        "steps[1].expect: expected one node at least, got none, 'x', name one",
        "steps[2].type: expected characters of one byte, got '\u20ac', 'x', correct it",
    ]


def test_two_buses_of_one_name_are_refused() -> None:
    with pytest.raises(ConfigError, match="a name of its own for each, got 'bus' twice"):
        run(Scenario("x", (BUS, Configuration(nodes=(12,))), ()))


def test_a_circle_is_told_of_those_in_it_and_of_nobody_who_waits_for_them() -> None:
    names = [f"s{number}" for number in range(3_000)]
    steps = [
        Step(Pause(), name=name, after=names[(number + 1) % 3_000])
        for number, name in enumerate(names)
    ]
    assert len(refusals(*steps)) == 3_000
    told = refusals(
        Step(Pause(), name="a", after="b"),
        Step(Pause(), name="b", after="a"),
        Step(Pause(), after="a"),
        Step(Pause(), after="none"),
    )
    assert [line.split(":")[0] for line in told] == [f"steps[{index}].after" for index in (0, 1, 3)]


def told_of(line: str) -> list[str]:
    """What is against a line to modules, of which there is one at 30."""
    with pytest.raises(ConfigError) as wrong:
        refuse(Scenario("x", (MODULES,), (Step(Send((line,))),)))
    return [str(one) for one in wrong.value.mistakes]


def test_lines_are_in_the_words_of_the_buss_own_master() -> None:
    for line, kind in (("30 stop", "ss-mst67"), ("30S", "sac")):
        refuse(Scenario("x", (Configuration(nodes=(30,), kind=kind),), (Step(Send((line,))),)))
    (told,) = told_of("30S")
    assert told == (
        "steps[0].send: line '30S': expected an address from 0 to 31 and a command, as in 3 stop, "
        "got '30S', 'x', correct it"
    )


def test_a_module_that_is_not_there_is_missed_unless_another_outcome_is_expected() -> None:
    assert told_of("0 stop") == [
        "steps[0].send: expected nodes of bus 'bus' (30), got 0, 'x', correct it"
    ]
    refuse(Scenario("x", (MODULES,), (Step(Send(("0 stop",), "no answer")),)))


def test_what_a_sac_says_is_not_asked_for() -> None:
    told = refusals(Step(Send(("10", "0y"), says="ACK")))
    assert told == [
        "steps[0].says: expected a protocol whose answers bring words, got sac, 'x', remove it"
    ]
    assert refusals(Step(Send(("10",), "any", says="ACK"))) == [
        "steps[0].says: expected only with outcome ack, got any, 'x', remove it"
    ]


CRIER = """
from sacbus.mother.masters import Addressed
from sacbus.mother.superstepper_master import SuperStepperMasterKind

class Crier(SuperStepperMasterKind):
    def read(self, line):
        return Addressed(0, line[4:], True) if line.startswith("all ") else super().read(line)

MASTER = Crier()
"""


def test_what_nobody_answers_says_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    install(tmp_path, "superstepper = crier:MASTER")
    (tmp_path / "crier.py").write_text(CRIER)
    monkeypatch.syspath_prepend(str(tmp_path))
    refuse(Scenario("x", (MODULES,), (Step(Send(("all stop", "30 stop"))),)))
    with pytest.raises(ConfigError) as wrong:
        refuse(Scenario("x", (MODULES,), (Step(Send(("all stop", "30 stop"), says="ACK")),)))
    assert [str(one) for one in wrong.value.mistakes] == [
        (
            "steps[0].says: expected only with lines that are answered, got 'all stop' to all, "
            "'x', remove it"
        )
    ]


def test_a_bus_is_looked_at_once_for_all_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    looked: list[Configuration] = []

    def look(bus: Configuration) -> Protocol:
        looked.append(bus)
        return check(bus)

    monkeypatch.setattr("sacbus.scenario.rules.check", look)
    refuse(Scenario("x", (BUS,), (Step(Send(("10",))),) * 20))
    assert looked == [BUS]


def test_a_protocol_without_a_master_takes_bytes_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sacbus.mother.masters.GROUP", "sacbus.nobodys")
    (told,) = told_of("30 stop")
    assert told == (
        "steps[0].send: expected a bus whose protocol has a master here, got superstepper, 'x', "
        "install one, or give bytes, as raw"
    )
    steps = (Step(Raw(b"\xf4\x03")), Step(Counted({"acks": Bounds.exactly(0)})))
    assert run(Scenario("x", (MODULES,), steps)).passed


def test_ninth_bits_take_more_than_a_link() -> None:
    raw = Raw(b"\x1c\x03", ninth=b"\x01\x00")
    (told,) = refusals(Step(raw), line_only=True)
    assert "got ninth bits" in told
