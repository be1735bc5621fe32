"""The two ports with each other's role: ``$CE1`` and back, and ports at wrong rates."""

from __future__ import annotations

import pytest

from nodes.sac import SacSettings
from nodes.sac.ports import understand
from sacbus.kernel import MS, SECOND, Ns
from sacbus.node import ReportKind
from sacbus.wire import MOTHER, ack
from tests.nodes.sac.bench import NODE, Bench, packet

AT: Ns = 20 * MS


class Exchange:
    """A bench whose node has its network on the hardware port, and who listens there."""

    def __init__(self) -> None:
        self.bench = Bench()
        self.sent: list[bytes] = []
        self.bench.node.terminal.show = self.sent.append
        self.bench.hears("$CE1", at=AT)
        self.bench.hears("$R", at=SECOND)
        self.bench.run()
        # The end of the packet that brought it there was typed already.
        self.line(b"\r", self.bench.kernel.now + AT)
        self.bench.heard.clear()
        self.sent.clear()

    def hardware(self, data: bytes, at: Ns) -> None:
        """Bytes come to the hardware port."""
        self.bench.kernel.run_until(at)
        self.bench.node.terminal.type(data, at)
        self.bench.bus.touch(self.bench.node)

    def line(self, data: bytes, at: Ns) -> bytes:
        """Bytes come over the line; what the node says there then."""
        before = len(self.bench.heard)
        self.bench.sends(data, at=at)
        self.bench.kernel.run_until(at + 200 * MS)
        return b"".join(said.data for said in self.bench.heard[before:])


def test_until_the_reboot_nothing_has_changed() -> None:
    bench = Bench()
    bench.hears("$CE1", at=AT)
    bench.hears("m5v10", at=SECOND)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)] * 2
    assert bench.position(bench.kernel.now) == 5


def test_packets_are_spoken_on_the_hardware_port_then_with_the_devices_times() -> None:
    exchange = Exchange()
    at = 2 * SECOND
    exchange.hardware(packet("m5v10"), at)
    exchange.bench.kernel.run_until(at + 384_000)
    assert exchange.sent == []
    exchange.bench.kernel.run_until(at + 385_000)
    assert exchange.sent == [ack(MOTHER, NODE)]
    exchange.bench.run()
    assert exchange.bench.position(exchange.bench.kernel.now) == 5
    assert exchange.bench.heard == []


def test_the_line_has_a_terminal_on_it_which_echoes_and_answers_queries() -> None:
    exchange = Exchange()
    assert exchange.line(b"v120\r", 2 * SECOND) == b"v120\r\nSAC>"
    assert exchange.line(b"vd\r", 3 * SECOND) == b"vd\r\n120 RPM  cycle 2500\r\nSAC>"
    assert exchange.line(b"m5\r", 4 * SECOND) == b"m5\r\nSAC>"
    exchange.bench.run()
    assert exchange.bench.position(exchange.bench.kernel.now) == 5
    assert exchange.sent == []


def test_packets_on_the_line_are_no_packets_to_it() -> None:
    exchange = Exchange()
    said = exchange.line(packet("m5v10"), 2 * SECOND)
    assert ack(MOTHER, NODE) not in said
    exchange.bench.run()
    assert exchange.bench.position(exchange.bench.kernel.now) == 0


def test_it_is_set_back_by_packets_through_the_hardware_port() -> None:
    exchange = Exchange()
    exchange.hardware(packet("$CE0"), 2 * SECOND)
    exchange.hardware(packet("$R"), 3 * SECOND)
    bench = exchange.bench
    bench.run()
    bench.heard.clear()
    bench.hears("m5v10", at=5 * SECOND)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)]
    exchange.sent.clear()
    exchange.hardware(b"v7\r", 10 * SECOND)
    bench.run()
    assert b"".join(exchange.sent) == b"v7\r\nSAC>"


def test_rst_at_a_cold_boot_sets_it_back() -> None:
    exchange = Exchange()
    bench = exchange.bench
    bench.node.pins.drive("rst", 0, bench.kernel.now)
    for on, at in ((False, 2 * SECOND), (True, 3 * SECOND)):
        bench.kernel.run_until(at)
        bench.node.power(on=on, now=at)
        bench.bus.touch(bench.node)
    bench.run()
    bench.heard.clear()
    bench.hears("m5v10", at=5 * SECOND)
    bench.run()
    assert bench.answers == [ack(MOTHER, NODE)]


def test_the_hardware_port_has_the_rate_of_hw() -> None:
    exchange = Exchange()
    bench = exchange.bench
    exchange.hardware(packet("$Cm9600"), 2 * SECOND)
    exchange.hardware(packet("$R"), 3 * SECOND)
    bench.run()
    exchange.sent.clear()
    exchange.hardware(packet("85m5"), 5 * SECOND)
    bench.run()
    assert exchange.sent == [ack(MOTHER, NODE), packet("m5", 85, NODE)]


def test_a_terminal_on_the_line_at_another_rate_hears_and_says_nothing() -> None:
    exchange = Exchange()
    bench = exchange.bench
    exchange.hardware(packet("$Cn9600"), 2 * SECOND)
    exchange.hardware(packet("$R"), 3 * SECOND)
    bench.run()
    assert "sw is 9600 baud, the line runs at 38400" in bench.told(ReportKind.WARNING)[-1].text
    assert exchange.line(b"v120\r", 5 * SECOND) == b""


@pytest.mark.parametrize(
    ("baud", "other", "both"),
    [(38_400, 38_400, True), (39_360, 38_400, True), (39_361, 38_400, False), (1, 38_400, False)],
)
def test_rates_may_differ_by_two_and_a_half_per_cent(baud: int, other: int, both: bool) -> None:
    assert understand(baud, other) is both


def test_a_terminal_on_the_line_that_has_something_to_say_is_not_quiet() -> None:
    exchange = Exchange()
    bench = exchange.bench
    quiet = [bench.node.quiet]
    bench.sends(b"v120\r", at=2 * SECOND)
    bench.kernel.run_until(2 * SECOND + bench.span(5) - 1)
    quiet.append(bench.node.quiet)
    bench.run()
    quiet.append(bench.node.quiet)
    assert quiet == [True, False, True]


def test_the_echo_of_the_reboot_stays_where_it_was_typed() -> None:
    bench = Bench()
    shown: list[bytes] = []
    bench.node.terminal.show = shown.append
    for number, keys in enumerate((b"$CE1\r", b"$R\r")):
        bench.kernel.run_until((number + 1) * SECOND)
        bench.node.terminal.type(keys, bench.kernel.now)
        bench.bus.touch(bench.node)
    bench.run()
    assert b"".join(shown) == b"$CE1\r\nSAC>$R\r\n"
    # The prompt after the boot stands where the terminal is then.
    assert b"".join(said.data for said in bench.heard) == b"SAC>"


def test_what_it_has_to_say_outlasts_a_reboot_that_leaves_the_ports_as_they_are() -> None:
    exchange = Exchange()
    said = exchange.line(b"vd\r$R\rv7\r", 2 * SECOND)
    assert said == b"vd\r\n100 RPM  cycle 3000\r\nSAC>$R\r\nSAC>v7\r\nSAC>"


def test_a_node_set_back_to_the_lines_rate_hears_again() -> None:
    bench = Bench(settings=SacSettings(sw=9_600))
    bench.node.terminal.show = bytearray().extend
    bench.hears("m5v10", at=AT)
    assert bench.position(SECOND) == 0
    bench.node.terminal.type(b"$Cn38400\r$R\r", SECOND)
    bench.bus.touch(bench.node)
    bench.hears("m5v10", at=2 * SECOND)
    bench.run()
    assert bench.position(bench.kernel.now) == 5


def test_a_rate_that_nobody_understands_is_told_by_the_name_of_the_node() -> None:
    bench = Bench(settings=SacSettings(sw=9_600))
    assert [report.address for report in bench.told()] == [NODE]
