"""How fast the kernel is: events per second, beside a bare heapq loop that does the same."""

from __future__ import annotations

from heapq import heappop, heappush

from benchmarks.figure import Figure, alternate
from sacbus.kernel import Kernel

EVENTS = 100_000
#: Appointments that stand at any time: about one a node on a full bus.
STANDING = 250


def kernel_events() -> int:
    """Each event makes the next appointment, as a node does."""
    kernel = Kernel()
    left = EVENTS

    def happen() -> None:
        nonlocal left
        left -= 1
        if left > 0:
            kernel.at(kernel.now + STANDING, happen)

    for when in range(STANDING):
        kernel.at(when, happen)
    return kernel.run_until(10**12)


def bare_heap() -> int:
    """The least that an event queue must do: pop, call, push."""
    heap: list[tuple[int, int, object]] = []
    left = EVENTS
    order = 0
    now = 0

    def happen() -> None:
        nonlocal left, order
        left -= 1
        if left > 0:
            order += 1
            heappush(heap, (now + STANDING, order, happen))

    for order in range(STANDING):
        heappush(heap, (order, order, happen))
    while heap:
        now, _, call = heappop(heap)
        call()  # type: ignore[operator]  # it is what was pushed
    return now


def figures(rounds: int) -> list[Figure]:
    """Events per second."""
    took, baseline = alternate(kernel_events, bare_heap, rounds)
    return [
        Figure("kernel events", EVENTS / took, "events/s", baseline / took, "a bare heapq loop")
    ]
