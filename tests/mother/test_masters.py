"""Masters by the names of their protocols, and what becomes of lines in terms that all share."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from sacbus.kernel import MS, Kernel, LineRate
from sacbus.mother import BadRequest
from sacbus.mother.masters import Addressed, Came, find_master
from sacbus.mother.sac_master import SAC_MASTER
from sacbus.mother.superstepper_master import SUPER_STEPPER_MASTER
from sacbus.node import find_kind, protocols_of
from sacbus.wire import ack, nak
from tests.mother.third_party import install


def test_each_protocol_of_ours_has_its_master() -> None:
    for kind in ("sac", "ss-mst67"):
        for protocol in protocols_of(find_kind(kind)):
            assert find_master(protocol.name) is not None
    assert find_master("sac") is SAC_MASTER
    assert find_master("superstepper-9") is SUPER_STEPPER_MASTER
    assert find_master("smoke") is None


def test_what_is_installed_is_looked_through_once(monkeypatch: pytest.MonkeyPatch) -> None:
    looked = 0
    every = importlib.metadata.Distribution.discover

    def discover(**context: Any) -> Iterable[importlib.metadata.Distribution]:  # noqa: ANN401
        nonlocal looked
        looked += 1
        return every(**context)

    monkeypatch.syspath_prepend("")  # a path that has not been looked through yet
    monkeypatch.setattr(importlib.metadata.Distribution, "discover", discover)
    for protocol in ("sac", "superstepper", "sac", "smoke", "smoke"):
        find_master(protocol)
    assert looked == 1


def test_a_third_partys_master_is_found_no_differently_and_a_broken_one_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, "smoke = smokesignals:MASTER", "fog = nowhere:MASTER")
    (tmp_path / "smokesignals.py").write_text("MASTER = object()\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert find_master("smoke") is not None
    with pytest.raises(BadRequest) as broken:
        find_master("fog")
    assert str(broken.value) == (
        "the master of 'fog' (nowhere:MASTER) cannot be loaded: "
        "ModuleNotFoundError(\"No module named 'nowhere'\"); mend or uninstall its package"
    )


def test_a_line_of_mothers_names_its_node_or_everybody() -> None:
    assert SAC_MASTER.read("85m400") == Addressed(85, "m400")
    assert SAC_MASTER.read("0y") == Addressed(0, "y", everybody=True)
    for line in ("m400", "3m400", "256m400", "10\x02", "10é→"):
        with pytest.raises(BadRequest):
            SAC_MASTER.read(line)
        with pytest.raises(BadRequest):
            SAC_MASTER.create(Kernel(), lambda *_: None, LineRate()).ask(line, lambda _: None)


def test_mothers_outcomes_are_told_in_everybodys_terms() -> None:
    kernel, came = Kernel(), list[Came]()
    sent: list[tuple[bytes, bytes | None]] = []
    answers = iter([True, False, False, False])

    def speak(data: bytes, ninth: bytes | None) -> None:
        sent.append((data, ninth))
        if (positive := next(answers, None)) is not None:
            kernel.at(kernel.now + MS, master.hear, ack(1, 10) if positive else nak(1, 10))

    master = SAC_MASTER.create(kernel, speak, LineRate())
    for line in ("10V1", "10V2", "10V3", "10m4", "0y"):
        master.ask(line, came.append)
        kernel.run_until(kernel.now + 1_000 * MS)
    assert [(one.outcome, one.attempts) for one in came] == [
        ("ack", 1),
        ("nak", 3),
        ("no answer", 3),
        ("unknown", 1),
        ("sent", 1),
    ]
    assert [str(one) for one in (came[0], came[4])] == ["ack", "sent"]
    assert str(came[3]).startswith("unknown (node 10: 'm4' sent once, last answer silence: ")
    assert came[4].line.everybody
    assert {ninth for _, ninth in sent} == {None}
    assert master.statistics[10].timeouts == 4
    master.ask("10V5", came.append)
    master.lose("it is gone")
    assert str(came[5]) == "lost (it is gone)"


@pytest.mark.parametrize(("bits", "marks"), [(10, None), (11, b"\x01\x00\x00")])
def test_headers_are_marked_where_bytes_have_a_ninth_bit(bits: int, marks: bytes | None) -> None:
    kernel, came = Kernel(), list[Came]()
    sent: list[tuple[bytes, bytes | None]] = []
    answers = [b"\x83\x00\x00\x42\xc5", *[b"\x83\x00\x00\x00\x84"] * 3]

    def speak(data: bytes, ninth: bytes | None) -> None:
        sent.append((data, ninth))
        kernel.at(kernel.now + MS, master.hear, answers.pop(0))

    master = SUPER_STEPPER_MASTER.create(kernel, speak, LineRate(9_600, bits))
    master.ask("3 read 0x10", came.append)
    kernel.run_until(kernel.now + MS)
    assert sent == [(b"\x1f\x00\x10", marks)]
    assert came == [Came(Addressed(3, "read 0x10"), "ack", 1, "66 (0x42)")]
    master.ask("3 stop", came.append)
    kernel.run_until(kernel.now + 100 * MS)
    assert (came[1].outcome, came[1].attempts) == ("unknown", 3)
    assert "damaged answer" in came[1].words
    master.lose("it is gone")
    master.ask("3 stop", came.append)
    assert str(came[2]) == "lost (it is gone)"
    with pytest.raises(BadRequest, match="expected a command"):
        master.ask("3 halt", came.append)
