"""Who is on the line: every address asked whether anybody answers.

Owns in which order addresses are asked, how often, and how long each is waited for. What is asked
is the empty line, which no node does anything about.

A sweep asks every address that has not answered yet once, and waits so little that 252 absent nodes
take two seconds. There are three sweeps, as many as attempts of any request that may be repeated,
and more while a sweep still finds somebody, for then the line is bad. Where a link is slower than
that (a USB adapter that keeps bytes for 16 ms, a network, a busy machine), answers come when mother
is at another address. What came so late is a hint, no more: the address may have been damaged on
the way. Who was heard so is asked again, with all the time that the link may need.
Source: spec, mother ("Transactions": address book).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass, replace
from typing import Final

from sacbus.kernel import MS, Ns
from sacbus.mother.caller import TRIES, Caller
from sacbus.mother.errors import NoAnswer, Refused
from sacbus.mother.outcome import Acknowledged, Done
from sacbus.mother.request import checked_address

__all__ = ["EVERY_ADDRESS", "QUICK", "ScanProgress", "scan"]

#: All addresses that a SAC can have.
EVERY_ADDRESS: Final = range(4, 256)

#: How long after the line's own figures an absent node is given up in a sweep.
QUICK: Final[Ns] = 4 * MS

#: Sweeps at the least, and, as long as each finds somebody, at the most.
SWEEPS: Final = TRIES
SWEEPS_MOST: Final = 8

Ask = Callable[[Callable[[Done], None]], Awaitable[Acknowledged]]


@dataclass(frozen=True, slots=True)
class ScanProgress:
    """How far a scan is: in sweep number ``sweep``, ``asked`` ``of`` so many; ``found`` so far."""

    sweep: int
    asked: int
    of: int
    found: tuple[Acknowledged, ...]


async def scan(
    caller: Caller,
    ask: Ask,
    addresses: Iterable[int] = EVERY_ADDRESS,
    progress: Callable[[ScanProgress], object] | None = None,
) -> list[Acknowledged]:
    """Who answers at ``addresses``, in their order. :class:`BadRequest` for one that no node has.

    ``ask`` has a request made and waits for it. ``attempts`` of what is found counts how often the
    node was asked in all.
    """
    wanted = [checked_address(node) for node in dict.fromkeys(addresses)]
    look = _Scan(caller, ask, wanted, progress)
    caller.stray_watchers.append(look.late.add)
    try:
        await look.run()
    finally:
        caller.stray_watchers.remove(look.late.add)
    return [look.found[node] for node in wanted if node in look.found]


class _Scan:
    def __init__(
        self,
        caller: Caller,
        ask: Ask,
        wanted: list[int],
        progress: Callable[[ScanProgress], object] | None,
    ) -> None:
        self._caller = caller
        self._ask = ask
        self._wanted = wanted
        self._progress = progress
        self._asked = dict.fromkeys(wanted, 0)
        self.found: dict[int, Acknowledged] = {}
        #: Who was heard when nobody waited for them any more, or said NAK.
        self.late: set[int] = set()

    async def run(self) -> None:
        """Sweep until nobody new can be hoped for."""
        for sweep in range(1, SWEEPS_MOST + 1):
            before = len(self.found)
            await self._sweep(sweep)
            if sweep >= SWEEPS and len(self.found) == before:
                return

    async def _sweep(self, sweep: int) -> None:
        silent = [node for node in self._wanted if node not in self.found]
        for number, node in enumerate(silent, 1):
            await self._look_at(node, quickly=True)
            self._tell(sweep, number, len(silent))
        for node in silent:
            if node in self.late and node not in self.found:
                await self._look_at(node, quickly=False)
                self._tell(sweep, len(silent), len(silent))

    async def _look_at(self, node: int, *, quickly: bool) -> None:
        caller = self._caller

        def request(done: Done) -> None:
            if quickly:
                caller.probe(node, QUICK, done)
            else:
                caller.call(node, b"", done)

        try:
            answer = await self._ask(request)
        except NoAnswer as silence:
            self._asked[node] += silence.attempts
            if silence.refusals:
                # NAK now and then: somebody is there, on a line that is bad.
                self.late.add(node)
        except Refused as refusal:
            self._asked[node] += refusal.attempts
            self.late.add(node)
        else:
            self._asked[node] += answer.attempts
            self.found[node] = replace(answer, attempts=self._asked[node])

    def _tell(self, sweep: int, asked: int, of: int) -> None:
        if self._progress is not None:
            found = tuple(self.found[node] for node in sorted(self.found))
            self._progress(ScanProgress(sweep, asked, of, found))
