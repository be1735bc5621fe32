"""Boots: the second in which a node is deaf, factory restore, autorun, and what each boot keeps."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from nodes.sac import SacSettings
from nodes.sac.boot import LISTENS
from sacbus.kernel import MS, SECOND, Ns
from sacbus.language import Parameter
from sacbus.node import ReportKind
from sacbus.wire import ack
from tests.nodes.sac.bench import NODE, Bench

AT: Ns = 20 * MS
COLD = SacSettings(boot="cold")


class Panel:
    """A bench with somebody at the terminal and at the switches of its node."""

    def __init__(
        self, settings: SacSettings | None = None, memory: Mapping[str, object] | None = None
    ) -> None:
        self.bench = Bench(settings=settings, memory=memory)
        self.node = self.bench.node
        self.shown = bytearray()
        self.node.terminal.show = self.shown.extend

    @property
    def now(self) -> Ns:
        return self.bench.kernel.now

    def waits(self, span: Ns) -> None:
        self.bench.kernel.run_until(self.now + span)

    def hears(self, *lines: str) -> None:
        for line in lines:
            self.bench.hears(line, at=self.now + AT)
        self.waits(5 * MS)

    def types(self, keys: str) -> str:
        """What is shown from here on."""
        begin = len(self.shown)
        self.node.terminal.type(keys.encode(), self.now)
        self.bench.bus.touch(self.node)
        self.waits(1 * MS)
        return self.shown[begin:].decode()

    def switches(self, *, on: bool) -> None:
        self.node.power(on=on, now=self.now)
        self.bench.bus.touch(self.node)

    def cycles_power(self) -> None:
        self.switches(on=False)
        self.waits(1 * MS)
        self.switches(on=True)

    def obeys(self) -> bool:
        """Whether it answers a packet."""
        self.bench.heard.clear()
        self.hears("v100")
        return self.bench.answers == [ack(1, NODE)]

    def state(self) -> str:
        return self.bench.snapshot(self.now).state


# ---- the second after power came ----------------------------------------------------------------


def test_a_node_starts_booted_unless_it_is_told_to_start_cold() -> None:
    assert Panel().obeys()
    assert not Panel(COLD).obeys()


def test_a_node_that_starts_cold_is_deaf_for_a_second() -> None:
    panel = Panel(COLD)
    assert not panel.obeys()
    assert panel.node.snapshot(panel.now).counters["packets"] == 0
    panel.waits(LISTENS - panel.now - 1)
    assert panel.shown == b""
    panel.waits(1)
    assert panel.shown == b"SAC>"
    assert panel.obeys()


def test_a_packet_that_began_within_the_second_is_lost() -> None:
    bench = Bench(settings=COLD)
    bench.hears("v100", at=LISTENS + 1 * MS)
    bench.hears("v200", at=LISTENS + AT)
    bench.run()
    assert bench.answers == [ack(1, NODE)]
    assert bench.node.board.commands.session.rpm == 200


def test_power_brings_the_version_line_and_a_second_later_the_prompt() -> None:
    panel = Panel()
    panel.cycles_power()
    assert panel.shown == b"SAC v1.0\r\n"
    panel.waits(LISTENS)
    assert panel.shown == b"SAC v1.0\r\nSAC>"


@pytest.mark.parametrize("key", ["x", "\r", " ", "m2000\r"])
def test_a_key_within_the_second_restores_the_factory_s_memory(key: str) -> None:
    panel = Panel(SacSettings(ustep=2))
    born = panel.node.board.eeprom
    panel.hears("$CM99", "$Cb5000", "$CU21", "q3m-500", "qs")
    changes: list[object] = []
    panel.node.memory_changed = lambda: changes.append(panel.node.board.eeprom)
    panel.cycles_power()
    panel.waits(LISTENS // 2)
    assert panel.types(key) == ""
    assert changes == []
    panel.waits(LISTENS)
    assert panel.node.board.eeprom == born
    assert changes == [born]
    assert panel.node.board.commands.queue.row(3).steps == 200
    assert (panel.node.address, panel.node.board.commands.session.cycle_us) == (NODE, 3000)
    # It was no line: nothing of it is left to be executed.
    assert panel.types("vd\r") == "vd\r\n100 RPM  cycle 3000\r\nSAC>"
    assert panel.state() == "STANDBY"


def test_a_key_after_the_second_is_an_ordinary_one() -> None:
    panel = Panel()
    panel.hears("$Cb5000")
    panel.cycles_power()
    panel.waits(LISTENS)
    assert panel.types("v") == "v"
    assert panel.node.board.eeprom.cycle == 5000


def test_the_network_restores_nothing() -> None:
    panel = Panel()
    panel.hears("$Cb5000")
    panel.cycles_power()
    panel.hears("x")
    panel.waits(LISTENS)
    assert panel.node.board.eeprom.cycle == 5000


@pytest.mark.parametrize(("rst", "cycle"), [(0, 3000), (1, 5000)])
def test_rst_restores_when_it_is_low_at_a_cold_boot(rst: int, cycle: int) -> None:
    panel = Panel()
    panel.hears("$Cb5000", "qs")
    panel.node.pins.drive("rst", rst, panel.now)
    panel.hears("$R")
    assert panel.node.board.eeprom.cycle == 5000
    panel.cycles_power()
    panel.waits(LISTENS)
    assert panel.node.board.eeprom.cycle == panel.node.board.commands.session.cycle_us == cycle
    assert (panel.node.board.eeprom.queue is None) is (rst == 0)


def test_what_the_factory_restores_is_found_on_the_bus() -> None:
    panel = Panel()
    panel.hears("$CM99", "$R")
    assert not panel.obeys()
    panel.cycles_power()
    panel.types("x")
    panel.waits(LISTENS)
    assert panel.obeys()


# ---- power --------------------------------------------------------------------------------------


def test_without_power_nothing_moves_and_nothing_is_heard_or_said() -> None:
    panel = Panel(SacSettings(soft_ops=True))
    panel.hears("m2000v100", "m300")
    panel.switches(on=False)
    panel.bench.heard.clear()
    assert panel.state() == "OFF"
    assert (panel.node.wake_at(), panel.node.receiving) == (None, False)
    position = panel.bench.position(panel.now)
    assert not panel.obeys()
    assert panel.types("m200\r") == ""
    panel.hears("m200")
    assert panel.node.board.commands.current is None
    assert panel.bench.position(panel.now + SECOND) == position
    assert panel.bench.answers == []


def test_power_takes_all_but_the_eeprom() -> None:
    panel = Panel()
    panel.hears("$Cb5000", "q1m5", "qs", "v50", "q2m6", "m20", "g", "xp0,1")
    assert panel.bench.position(panel.now) > 0
    panel.cycles_power()
    panel.waits(LISTENS)
    commands = panel.node.board.commands
    assert panel.bench.position(panel.now) == 0
    assert (commands.session.cycle_us, commands.gap, commands.references) == (5000, True, ())
    assert [commands.queue.row(position).steps for position in (1, 2)] == [5, 200]
    assert (commands.pending, panel.state()) == ([], "STANDBY")


def test_switching_on_what_is_on_and_off_what_is_off_does_nothing() -> None:
    panel = Panel()
    panel.switches(on=True)
    assert panel.obeys()
    panel.switches(on=False)
    panel.switches(on=False)
    assert panel.state() == "OFF"
    panel.switches(on=True)
    panel.waits(LISTENS)
    assert panel.obeys()


# ---- the warm boot ------------------------------------------------------------------------------


def test_a_warm_boot_shows_the_prompt_and_keeps_queue_and_position() -> None:
    panel = Panel()
    panel.hears("m10v600a999d999", "q5m-7")
    panel.waits(1 * SECOND)
    panel.hears("$R")
    assert panel.shown == b"SAC>"
    assert panel.bench.position(panel.now) == 10
    assert [panel.node.board.commands.queue.row(position).steps for position in (1, 5)] == [10, 7]
    assert panel.node.board.commands.queue.next_free == 2


def test_a_warm_boot_from_the_terminal_shows_one_prompt_and_the_lines_behind_it_are_obeyed() -> (
    None
):
    panel = Panel()
    assert panel.types("$CM99\r$R\rm300v60\r").count("SAC>") == 3
    assert panel.node.board.commands.current is not None
    assert panel.bench.bus.node(99) is panel.node


def test_a_warm_boot_ends_motion() -> None:
    panel = Panel()
    panel.hears("m2000v60", "m300", "$R")
    snapshot = panel.bench.snapshot(panel.now)
    assert (snapshot.state, snapshot.pending) == ("STANDBY", ())


# ---- autorun ------------------------------------------------------------------------------------


def visits(panel: Panel, count: int) -> list[int | None]:
    """The steps of the commands that run from now on, one after the other."""
    found: list[int | None] = []
    while len(found) < count:
        panel.waits(1 * MS)
        current = panel.node.board.commands.current
        steps = None if current is None else current.steps
        if not found or found[-1] != steps:
            found.append(steps)
    return found


SAVED = ("q1m10v100a999d999", "q2m20v100a999d999", "q3m30v100a999d999", "qs")


def test_autorun_loops_over_the_saved_queue_after_a_cold_boot() -> None:
    panel = Panel()
    panel.hears(*SAVED, "$CA3", "qc")
    assert panel.state() == "STANDBY"
    panel.cycles_power()
    panel.waits(LISTENS - 1)
    assert panel.state() == "BOOT"
    panel.waits(1)
    assert visits(panel, 7) == [10, 20, 30, 10, 20, 30, 10]


def test_autorun_loops_over_the_queue_as_it_is_after_a_warm_boot() -> None:
    panel = Panel()
    panel.hears(*SAVED, "$CA2", "q2m5", "$R")
    assert visits(panel, 4) == [10, 5, 10, 5]


def test_autorun_of_one_loops_over_the_first_position_alone() -> None:
    panel = Panel()
    panel.hears(*SAVED, "$CA1", "$R")
    assert visits(panel, 1) == [10]
    panel.waits(1 * SECOND)
    assert panel.bench.position(panel.now) > 100


def test_autorun_ends_like_any_loop_and_comes_again() -> None:
    panel = Panel()
    panel.hears(*SAVED, "$CA3", "$R", "S")
    assert panel.state() == "STANDBY"
    panel.hears("$R")
    assert visits(panel, 2) == [10, 20]


def test_a_node_that_starts_booted_runs_from_the_start_what_it_has_stored() -> None:
    first = Panel()
    first.hears(*SAVED, "$CA3")
    panel = Panel(memory=first.node.persist())
    assert visits(panel, 4) == [10, 20, 30, 10]


def test_a_restored_node_that_starts_cold_waits_first() -> None:
    panel = Panel(COLD, {"autorun": 1})
    panel.waits(LISTENS - 1)
    assert panel.state() == "BOOT"
    panel.waits(1 * MS)
    assert panel.state() != "STANDBY"


def test_what_was_restored_by_the_factory_runs_nothing() -> None:
    panel = Panel()
    panel.hears(*SAVED, "$CA3")
    panel.cycles_power()
    panel.types(" ")
    panel.waits(2 * LISTENS)
    assert panel.state() == "STANDBY"
    assert panel.node.board.eeprom.value(Parameter.AUTORUN) == 0


def test_a_setting_counts_as_the_factory_s() -> None:
    panel = Panel(SacSettings(autorun=2, cycle=5000))
    panel.waits(1 * MS)
    assert panel.state() != "STANDBY"
    panel.hears("$CA0", "$Cb1000")
    panel.cycles_power()
    panel.types("x")
    panel.waits(LISTENS)
    assert (panel.node.board.eeprom.autorun, panel.node.board.eeprom.cycle) == (2, 5000)


def test_a_factory_restore_is_told() -> None:
    panel = Panel()
    panel.cycles_power()
    panel.types("x")
    panel.waits(LISTENS)
    (report,) = panel.bench.told(ReportKind.WARNING)
    assert report.text.startswith("factory restore")


def test_a_node_that_has_stored_something_warns_once() -> None:
    bench = Bench(settings=SacSettings(ustep=7), memory={"slow": 12})
    assert len(bench.told(ReportKind.WARNING)) == 1
