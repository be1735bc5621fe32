"""The daemon: builds a bus with its nodes and links from one configuration, and takes it down.

Owns the order of starting and stopping. Nothing is opened before everything has been checked, and
what was opened is closed again in every case: a port is released, memory is saved.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from functools import partial
from typing import assert_never

from sacbus.bus import Bus
from sacbus.configuration import FASTEST, SLOWEST, Configuration, NodeAt, check
from sacbus.host import Host, RealHost, VirtualHost, VirtualLoop
from sacbus.hosted import HostedBus
from sacbus.kernel import US, Kernel, LineRate
from sacbus.links.places import AdapterAt, Place, PtyAt, Rfc2217At, TcpAt, terminal_path
from sacbus.node import Report, ReportKind, find_kind, settings_from
from sacbus.state import StateDirectory

__all__ = ["FASTEST", "SLOWEST", "Configuration", "HostedBus", "NodeAt", "check", "open_bus"]


@asynccontextmanager
async def open_bus(
    configuration: Configuration | None = None, *, beside: HostedBus | None = None
) -> AsyncIterator[HostedBus]:
    """Host a bus in the running loop, for an ``async with`` block.

    In a :class:`~sacbus.host.VirtualLoop` bus time is that loop's time; in any other it follows the
    loop's clock, as precisely as that loop wakes. ``beside`` another bus, which must stay open for
    as long, it has that one's time there, with its speed and pace. Raises KindError, SettingError,
    StateError or LinkError, each a line that a user can act on, with nothing left open.
    """
    configuration = configuration or Configuration()
    protocol = check(configuration)
    loop = asyncio.get_running_loop()
    if isinstance(loop, VirtualLoop):
        kernel, beside = loop.kernel, None
    else:
        kernel = Kernel() if beside is None else beside.host.kernel
    rate = LineRate(configuration.baud or protocol.rate.baud, protocol.rate.bits)
    bus = Bus(
        kernel,
        protocol,
        name=configuration.name,
        rate=rate,
        lanes=configuration.lanes,
        seed=configuration.seed,
    )
    with ExitStack() as stack:
        state = None
        if configuration.state is not None:
            state = StateDirectory(configuration.state, configuration.name)
            state.claim()
            stack.callback(state.release)
        nodes = configuration.every_node
        kinds = {name: find_kind(name) for name in {one.kind for one in nodes}}
        for wanted in nodes:
            kind = kinds[wanted.kind]
            settings = settings_from(kind.settings, wanted.settings)
            memory = None
            if state is not None:
                memory, remark = state.load(wanted.address, kind.name)
                if remark is not None:
                    bus.tell(Report(kernel.now, wanted.address, ReportKind.WARNING, remark))
            bus.add(kind.create(wanted.address, settings, rate, bus.tell, memory))
        if beside is None:
            hosted = HostedBus(configuration, bus, _host(configuration, bus, loop))
        else:
            hosted = HostedBus(configuration, bus, beside.host, guest=True)
        stack.callback(hosted.close)
        for place in configuration.links:
            await _open_link(hosted, place)
        if configuration.terminals:
            _open_terminals(hosted)
        if state is not None:
            # Last, so that a bus that never ran overwrites nobody's memory; and at once, so that
            # what is killed has left as much as what is ended.
            hosted.save(state)
            stack.callback(hosted.save, state)
            stack.callback(hosted.keep(state))
        yield hosted


def _host(configuration: Configuration, bus: Bus, loop: asyncio.AbstractEventLoop) -> Host:
    if isinstance(loop, VirtualLoop):
        return VirtualHost(bus.kernel)
    free_at = partial(bus.medium.free_at, bus.medium.master_lane)
    return RealHost(
        bus.kernel,
        loop,
        speed=configuration.speed,
        line_free_at=None if configuration.pace else free_at,
    )


async def _open_link(bus: HostedBus, place: Place) -> None:
    """Open what a place names. Each kind of link is loaded only where one is asked for."""
    # ruff: noqa: PLC0415 (no bus waits for, or fails over, what another one needs)
    baud = bus.bus.rate.baud
    match place:
        case PtyAt(path, echo, latency_us):
            from sacbus.links import PtyLink

            bus.attach(PtyLink(path, baud=baud), echo=echo, latency=latency_us * US)
        case TcpAt(host, port, echo, latency_us):
            from sacbus.links.tcp import TcpServer

            await bus.let_in(TcpServer(host, port), echo=echo, latency=latency_us * US)
        case Rfc2217At(host, port, echo, latency_us):
            from sacbus.links.rfc2217 import Rfc2217Server

            server = Rfc2217Server(host, port, baud=baud)
            await bus.let_in(server, echo=echo, latency=latency_us * US)
        case AdapterAt(path, rts, echo):
            from sacbus.links.adapter import AdapterLink

            bus.attach_live(AdapterLink(path, baud, rts=rts, echo=echo, tell=bus.tell))
        case _:
            assert_never(place)


def _open_terminals(bus: HostedBus) -> None:
    """A pty for the terminal of every node that has one."""
    from sacbus.links import PtyLink
    from sacbus.links.presence import Presence

    # One for all: a user may have 128 of what it takes, and a bus 250 nodes.
    presence = Presence()
    for wanted, node in zip(bus.configuration.every_node, bus.bus.nodes, strict=True):
        if node.terminal is None:
            what = f"a node of kind {wanted.kind} has no terminal port, so none is served"
            bus.bus.tell(Report(bus.now(), wanted.address, ReportKind.WARNING, what))
            continue
        path = terminal_path(bus.configuration.links, wanted.address)
        link = PtyLink(path, baud=bus.bus.rate.baud, presence=presence)
        bus.attach_terminal(wanted.address, link)
