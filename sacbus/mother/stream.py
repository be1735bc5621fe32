"""Blocks of a toolpath brought into the nodes while they run: never too late, never too early.

Owns the order of what is sent; what is still to be written is the backlog's. Every axis that takes
part runs an endless loop over its 30 queue positions, which are written over once their commands
are certain to be loaded (``lane.py``). A block's first command is held at sync; one broadcast ``y``
releases all axes of a block at once.

Rules, each for a reason:

- ``y`` only when every axis of the block is held for certain: one that is not forgets it, and is
  out of step for ever after. So not before the last block is over by mother's clock, with a margin
  for the nodes' clocks; and what was told before ``y`` counts only once it is acknowledged.
- ``y`` only when behind every axis's last command of the block another held one stands: the first
  of its next block, or whatever is there, held. Whatever happens to mother then, the machine comes
  to rest at the end of the block, and never runs into old commands.
- An axis that takes no part in a block must not be held, since ``y`` is for all: it leaves its loop
  by ``S``, at rest, and joins it again by ``LS`` and ``LF`` once the block before its own has been
  released.
- ``y`` only on a line that was silent for a while, and once more to each axis by itself: it starts
  one that has not heard the first, late, but not out of step with all that follows.
- When ``y`` took effect is known from the next ACK: a line that lets an ACK come late may have let
  ``y`` be late by as much.

Source: spec, mother ("Groups", "G-code"); manual, "sync", "Loop", "Queue".
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterable
from dataclasses import replace
from math import ceil
from typing import Final

from sacbus.kernel import MS, Ns
from sacbus.mother.backlog import Backlog, Passage
from sacbus.mother.errors import LineLost, MotherError, Stopped
from sacbus.mother.lane import Lane
from sacbus.mother.mother import Mother
from sacbus.mother.pace import round_trip
from sacbus.mother.reckoning import MARGIN, TICK, Reckoning
from sacbus.mother.release import RELEASE, STOP, stand_down
from sacbus.mother.streamed import StreamBroken, Streamed, WrongNode
from sacbus.mother.timeline import DRIFT_PPM
from sacbus.toolpath import Block, Machine

__all__ = ["Stream"]

#: Blocks that are taken from the plan ahead of the one that runs: they are written as far as there
#: is room in the queues, so more would be of no use but for blocks of one or two commands.
AHEAD: Final = 6

#: What planning a block may take of real time: it is not begun when a release is due before.
PLANNING: Final[Ns] = 100 * MS

#: How long the line is silent before a release. A node that has just answered is deaf for up to
#: 0.6 ms, and on a link that has no line time of its own (a pty, a socket) mother has its answer up
#: to 1.1 ms before it is over. A packet that is lost so is sent again; a release cannot be.
QUIET: Final[Ns] = 3 * MS

#: An axis that runs for so long is told a second time that it is released, by itself, and must
#: acknowledge that: longer than three attempts on a slow link.
CONFIRMED: Final[Ns] = 500 * MS

Halt = Callable[[str, bool], Awaitable[object]]


class Stream:
    """Runs blocks on a machine's nodes. :attr:`streamed` says at any time how far it has come.

    ``drift_ppm``: by how much a node's clock may differ from mother's; ``margin``: ns that a block
    may take longer besides. ``progress`` is called after every release. ``halt`` is awaited for
    each halt of a block, with its text and whether it waits for somebody: the stream goes on when
    it comes back. ``told`` is called with every line once it is acknowledged, and its node, 0 for
    all.

    Soft ops are switched off at the nodes, and stay so. GAP must be on, as it is after a boot.
    """

    def __init__(
        self,
        mother: Mother,
        machine: Machine,
        *,
        drift_ppm: int = DRIFT_PPM,
        margin: Ns = MARGIN,
        progress: Callable[[Streamed], object] | None = None,
        halt: Halt | None = None,
        told: Callable[[int, str], object] | None = None,
    ) -> None:
        self.streamed = Streamed()
        self._mother = mother
        self._lanes = [Lane(index, axis) for index, axis in enumerate(machine.axes)]
        self._nodes = [axis.node for axis in machine.axes]
        self._reckoning = Reckoning(drift_ppm, margin)
        self._progress = progress
        self._halt = halt
        self._told = told
        self._backlog = Backlog(self._lanes, ())
        self._stops = 0
        #: A node that has answered what was sent to another one.
        self._wrong: int | None = None
        #: The block that was released last, until what is to follow it has.
        self._after: Block | None = None
        #: How long the next packet will take, as the last one did.
        self._packet: Ns = 10 * MS
        #: When the last one was acknowledged.
        self._acknowledged: Ns = 0

    async def run(self, blocks: Iterable[Block]) -> Streamed:
        """Run all of them; the machine stands still when it returns, its nodes in STANDBY.

        :class:`StreamBroken` when a node does not answer as it should, or what was not for it, or
        the line is gone: the block that was released is then let run to its end, where every axis
        is held, and all are sent ``S``; after an emergency stop, whoever asked for it, without
        waiting. When the call is cancelled all are sent ``S`` at once, wherever they are; so they
        are when ``blocks`` raises, at the end of the block. ValueError for a block with more
        commands of an axis than a queue has room for.
        """
        self._backlog = Backlog(self._lanes, blocks)
        self._stops = self._mother.caller.stops
        watchers = self._mother.caller.stray_watchers
        watchers.append(self._strayed)
        try:
            for lane in self._lanes:
                await self._tell(lane.node, "$O0")
            while await self._step():
                pass
            await self._stand_down()
            self._check()
        except MotherError as cause:
            await self._break(cause)
        except Exception:
            await self._let_run_out()
            await stand_down(self._mother, self._nodes)
            raise
        except BaseException:
            await stand_down(self._mother, self._nodes)
            raise
        finally:
            watchers.remove(self._strayed)
        return self.streamed

    # ---- what is to be done next ----

    async def _step(self) -> bool:
        """Do what is most urgent, or wait until something is; False when all is done."""
        self._check()
        backlog = self._backlog
        while len(backlog.passages) < 2 and backlog.take():
            pass
        now = self._mother.now
        if self._after is not None and now >= self._reckoning.over:
            await self._follow(self._after)
            return True
        if not backlog.passages:
            if self._after is None:
                return False
            await self._mother.until(self._reckoning.over)
            return True
        head = backlog.passages[0]
        if await self._leave(head, now) or await self._join(head):
            return True
        ready = self._is_ready(head)
        if ready and self._after is None and now >= self._reckoning.over:
            await self._release(head)
            return True
        # A packet now would only hold up the release.
        soon = ready and self._reckoning.over - now < self._packet
        if not soon and (await self._bar(head, now) or await self._write(now)):
            return True
        leisure = not ready or self._reckoning.over - now > PLANNING
        if leisure and len(backlog.passages) < AHEAD and backlog.take():
            return True
        await self._mother.until(self._next_at(now, ready=ready))
        return True

    def _is_ready(self, head: Passage) -> bool:
        """Whether ``y`` may come for a block, but for the end of the one before.

        Whoever takes no part in it has left by then.
        """
        return not head.left and all(
            lane.joined and (lane.barred or lane.written > len(run.motions))
            for lane, run in ((self._lanes[index], run) for index, run in head.runs.items())
        )

    def _next_at(self, now: Ns, *, ready: bool) -> Ns:
        """When there may be something to do, if there is nothing now."""
        times = [self._reckoning.over] if ready or self._after is not None else []
        head = self._backlog.passages[0]
        times += [lane.over for lane in self._lanes if lane.joined and lane.index not in head.runs]
        for lane in self._lanes:
            wanted = self._backlog.has(lane) or (lane.index in head.runs and not lane.barred)
            if wanted and (room := lane.room_at(now)) is not None:
                times.append(room)
        later = [when for when in times if when > now]
        # Else the rules of this file have a hole, and waiting would never end.
        assert later, "nothing to do and nothing to wait for"
        return min(later)

    # ---- what can be done ----

    async def _leave(self, head: Passage, now: Ns) -> bool:
        """Take an axis out of its loop that has no part in the next block."""
        for lane in self._lanes:
            if lane.joined and lane.index not in head.runs and lane.over <= now:
                await self._tell(lane.node, STOP)
                lane.joined = False
                return True
        return False

    async def _join(self, head: Passage) -> bool:
        """Have an axis held at the first command of the next block, as soon as that is there."""
        for index, position in head.firsts.items():
            lane = self._lanes[index]
            if not lane.joined:
                for line in lane.loop_from(position):
                    await self._tell(lane.node, line)
                lane.joined = True
                return True
        return False

    async def _write(self, now: Ns) -> bool:
        """Write the command that is due first of those that there is room for."""
        lane = self._backlog.first(now)
        if lane is None:
            return False
        passage, position, lines = self._backlog.write(lane)
        for line in lines:
            await self._tell(lane.node, line)
        passage.written(lane.index, position)
        return True

    async def _bar(self, head: Passage, now: Ns) -> bool:
        """Have an axis held behind the block where its next one cannot be."""
        if head.left:
            return False
        for index, run in head.runs.items():
            lane = self._lanes[index]
            if lane.barred or lane.written > len(run.motions) or lane.room_at(now) != now:
                continue
            if len(self._backlog.passages) > 1 and index in self._backlog.passages[1].runs:
                continue  # its next first command comes here
            await self._tell(lane.node, lane.bar())
            return True
        return False

    async def _release(self, head: Passage) -> None:
        """Release a block, and find out when that was."""
        streamed = self.streamed
        block = head.block
        if head.runs:
            await self._mother.until(self._acknowledged + QUIET)
            self._check()
        self._reckoning.count_wait(self._mother.now, streamed)
        if head.runs:
            await self._mother.broadcast(RELEASE)
            streamed.packets += 1
            if self._told is not None:
                self._told(0, RELEASE)
        self._backlog.passages.popleft()
        self._after = block
        streamed.over = False
        streamed.blocks += 1
        streamed.commands += sum(len(run.motions) for run in block.runs)
        streamed.lines = block.lines
        streamed.moving += block.duration * TICK
        for run in block.runs:
            self._lanes[run.axis].steps += run.steps
        streamed.positions = {lane.axis.name: lane.steps for lane in self._lanes}
        reckoning = self._reckoning
        reckoning.released(self._mother.now, block)
        if head.runs:
            by = await self._released_by(self._mother.now, head)
            for index, run in head.runs.items():
                lane = self._lanes[index]
                lane.release(
                    [by[index] + reckoning.lasts(ticks) for ticks in run.loaded],
                    by[index] + reckoning.lasts(run.end),
                )
                streamed.deepest = max(streamed.deepest, lane.deepest)
            reckoning.over = max(self._lanes[index].over for index in head.runs)
        if self._progress is not None:
            self._progress(replace(streamed))

    async def _released_by(self, sent: Ns, head: Passage) -> dict[int, Ns]:
        """When each axis was released at the latest. ``sent``: when ``y`` was out, by her figures.

        Each is sent a ``y`` of its own, which does nothing to one that runs, and starts one late
        that has not heard the first. But not to those that could be held for their next block by
        the time that comes, were it sent again. They have heard it, or nobody can tell.
        """
        by: dict[int, Ns] = {}
        late: Ns = 0
        for index, run in head.runs.items():
            if run.end * TICK >= CONFIRMED:
                await self._tell(self._lanes[index].node, RELEASE)
                by[index] = self._acknowledged
        if not by:
            # The empty line does nothing, and every node answers it.
            answer = await self._mother.send(self._lanes[next(iter(head.runs))].node, "")
            self.streamed.packets += 1
            late = max(0, answer.round_trip - round_trip(self._mother.rate, 0))
            if answer.attempts > 1:
                sent = self._mother.now
        # Whoever has acknowledged its own has heard it after the one for all.
        of_all = min(by.values(), default=sent + late)
        return {index: by.get(index, of_all) for index in head.runs}

    async def _follow(self, block: Block) -> None:
        """What a block wants when it is over: somebody is told something, or all stand still."""
        self._after = None
        streamed = self.streamed
        streamed.over = True
        began = self._mother.now
        if self._halt is not None:
            for text, waits in block.halts:
                await self._halt(text, waits)
        halted = self._mother.now - began
        streamed.halted += halted
        dwell = ceil(block.dwell * 1e9)
        streamed.dwelling += dwell
        self._reckoning.pause(halted + dwell)

    # ---- the line ----

    async def _tell(self, node: int, line: str) -> None:
        answer = await self._mother.send(node, line)
        self._packet = answer.round_trip + QUIET
        self._acknowledged = self._mother.now
        self.streamed.packets += 1
        if self._told is not None:
            self._told(node, line)

    # ---- the end ----

    async def _stand_down(self) -> None:
        """All is over: every axis leaves its loop."""
        for lane in self._lanes:
            if lane.joined:
                await self._tell(lane.node, STOP)
                lane.joined = False

    async def _let_run_out(self) -> None:
        """Wait for the end of the block that was released."""
        try:
            await self._mother.until(self._reckoning.over)
        except (LineLost, Stopped):
            return
        self.streamed.over = True

    def _check(self) -> None:
        """Go no further after an emergency stop, or when a node has obeyed what was not for it."""
        if self._mother.caller.stops != self._stops:
            raise Stopped(0, "")
        if self._wrong is not None:
            raise WrongNode(self._wrong)

    def _strayed(self, node: int) -> None:
        """An answer has come that nobody waits for: no CRC protects the address of a packet."""
        if node in self._nodes:
            self._wrong = node

    async def _break(self, cause: MotherError) -> None:
        if self._mother.caller.stops == self._stops:
            await self._let_run_out()
        elif not isinstance(cause, Stopped):  # what was on the line then went down with it
            cause = Stopped(0, "")
        unsure = await stand_down(self._mother, self._nodes)
        raise StreamBroken(cause, replace(self.streamed), unsure) from cause
