"""Blocks of a toolpath brought into the nodes while they run: never too late, never too early.

Owns the order of what is sent. Every axis that takes part runs an endless loop over its 30 queue
positions, which are written over once their commands are certain to be loaded (``lane.py``). A
block's first command is held at sync; one broadcast ``y`` releases all axes of a block at once.

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

from collections import deque
from collections.abc import Awaitable, Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Final

from sacbus.kernel import MS, Ns
from sacbus.language import QUEUE_LENGTH, Motion
from sacbus.mother.errors import LineLost, MotherError, Stopped
from sacbus.mother.lane import Lane
from sacbus.mother.mother import Mother
from sacbus.mother.pace import round_trip
from sacbus.mother.release import RELEASE, STOP, stand_down
from sacbus.mother.streamed import StreamBroken, Streamed, WrongNode
from sacbus.toolpath import AxisRun, Block, Machine

__all__ = ["DRIFT", "MARGIN", "MOST_COMMANDS", "Stream"]

#: By how much a node's clock may differ from mother's.
DRIFT: Final = 500e-6

#: What a block may be longer than its plan, besides.
MARGIN: Final[Ns] = 2 * MS

#: Commands of one axis in a block: one position is left for what holds it at its end.
MOST_COMMANDS: Final = QUEUE_LENGTH - 1

#: Blocks that are taken from the plan ahead of the one that runs: they are written as far as there
#: is room in the queues, so more would be of no use but for blocks of one or two commands.
AHEAD: Final = 6

#: What planning a block may take of real time: it is not begun when a release is due before.
PLANNING: Final[Ns] = 100 * MS

#: ns of a tick of a node's clock.
_TICK: Final = 500

#: How long the line is silent before a release. A node that has just answered is deaf for up to
#: 0.6 ms, and on a link that has no line time of its own (a pty, a socket) mother has its answer up
#: to 1.1 ms before it is over. A packet that is lost so is sent again; a release cannot be.
QUIET: Final[Ns] = 3 * MS

#: An axis that runs for so long is told a second time that it is released, by itself, and must
#: acknowledge that: longer than three attempts on a slow link.
CONFIRMED: Final[Ns] = 500 * MS

#: What has only just become due is no sign of a slow line.
_PROMPT: Final[Ns] = QUIET + 1 * MS

Halt = Callable[[str, bool], Awaitable[object]]


@dataclass(slots=True, eq=False)
class _Passage:
    """A block that has not been released yet.

    left: commands that are still to be written. firsts: where each axis's first one is.
    """

    block: Block
    runs: dict[int, AxisRun]
    left: int
    firsts: dict[int, int] = field(default_factory=dict)


class Stream:
    """Runs blocks on a machine's nodes. :attr:`streamed` says at any time how far it has come.

    ``drift``: by what part a node's clock may differ from mother's; ``margin``: ns that a block may
    take longer besides. ``progress`` is called after every release. ``halt`` is awaited for each
    halt of a block, with its text and whether it waits for somebody: the stream goes on when it
    comes back. ``told`` is called with every line once it is acknowledged, and its node, 0 for all.

    Soft ops are switched off at the nodes, and stay so. GAP must be on, as it is after a boot.
    """

    def __init__(
        self,
        mother: Mother,
        machine: Machine,
        *,
        drift: float = DRIFT,
        margin: Ns = MARGIN,
        progress: Callable[[Streamed], object] | None = None,
        halt: Halt | None = None,
        told: Callable[[int, str], object] | None = None,
    ) -> None:
        self.streamed = Streamed()
        self._mother = mother
        self._lanes = [Lane(index, axis) for index, axis in enumerate(machine.axes)]
        self._nodes = [axis.node for axis in machine.axes]
        #: What each lane has to write, in order: whose it is, which command of it, and when it is
        #: due in its block.
        self._to_write: list[deque[tuple[_Passage, int, int, Motion]]] = [
            deque() for _ in self._lanes
        ]
        self._slower = 1 + drift
        self._margin = margin
        self._progress = progress
        self._halt = halt
        self._told = told
        self._blocks: Iterator[Block] = iter(())
        self._ended = False
        self._stops = 0
        #: A node that has answered what was sent to another one.
        self._wrong: int | None = None
        self._passages: deque[_Passage] = deque()
        #: When the block that was released last is over for certain, and what is to follow it.
        self._over: Ns = 0
        #: When it would be over if nobody were late, and what follows it with it.
        self._planned: Ns = 0
        self._after: Block | None = None
        #: How long the next packet will take, as the last one did.
        self._packet: Ns = 10 * MS
        #: When the last one was acknowledged.
        self._acknowledged: Ns = 0

    async def run(self, blocks: Iterable[Block]) -> Streamed:
        """Run all of them; the machine stands still when it returns, its nodes in STANDBY.

        :class:`StreamBroken` when a node does not answer as it should, or what was not for it, or
        the line is gone: the
        block that was released is then let run to its end, where every axis is held, and all are
        sent ``S``; after an emergency stop, whoever asked for it, without waiting. When the call is
        cancelled all are sent ``S`` at once, wherever they are; so they are when ``blocks`` raises,
        at the end of the block. ValueError for a block with more commands of an axis than a queue
        has room for.
        """
        self._blocks = iter(blocks)
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
        while len(self._passages) < 2 and self._take():
            pass
        now = self._mother.now
        if self._after is not None and now >= self._over:
            await self._follow(self._after)
            return True
        if not self._passages:
            if self._after is None:
                return False
            await self._mother.until(self._over)
            return True
        head = self._passages[0]
        if await self._leave(head, now) or await self._join(head):
            return True
        ready = self._is_ready(head)
        if ready and self._after is None and now >= self._over:
            await self._release(head)
            return True
        # A packet now would only hold up the release.
        soon = ready and self._over - now < self._packet
        if not soon and (await self._bar(head, now) or await self._write(now)):
            return True
        leisure = not ready or self._over - now > PLANNING
        if leisure and len(self._passages) < AHEAD and self._take():
            return True
        await self._mother.until(self._next_at(now, ready=ready))
        return True

    def _take(self) -> bool:
        """Take the next block from the plan; False when there is none."""
        if self._ended:
            return False
        block = next(self._blocks, None)
        if block is None:
            self._ended = True
            return False
        longest = max((len(run.motions) for run in block.runs), default=0)
        if longest > MOST_COMMANDS:
            raise ValueError(
                f"block of lines {block.lines}: expected at most {MOST_COMMANDS} commands for an "
                f"axis, got {longest}"
            )
        passage = _Passage(
            block,
            {run.axis: run for run in block.runs},
            sum(len(run.motions) for run in block.runs),
        )
        self._passages.append(passage)
        for run in block.runs:
            self._to_write[run.axis].extend(
                (passage, number, start, motion)
                for number, (start, motion) in enumerate(zip(run.starts, run.motions, strict=True))
            )
        return True

    def _is_ready(self, head: _Passage) -> bool:
        """Whether ``y`` may come for a block, but for the end of the one before.

        Whoever takes no part in it has left by then.
        """
        return not head.left and all(
            lane.joined and (lane.barred or lane.written > len(run.motions))
            for lane, run in ((self._lanes[index], run) for index, run in head.runs.items())
        )

    def _next_at(self, now: Ns, *, ready: bool) -> Ns:
        """When there may be something to do, if there is nothing now."""
        times = [self._over] if ready or self._after is not None else []
        head = self._passages[0]
        times += [lane.over for lane in self._lanes if lane.joined and lane.index not in head.runs]
        for lane, waiting in zip(self._lanes, self._to_write, strict=True):
            wanted = waiting or (lane.index in head.runs and not lane.barred)
            if wanted and (room := lane.room_at(now)) is not None:
                times.append(room)
        later = [when for when in times if when > now]
        # Else the rules of this file have a hole, and waiting would never end.
        assert later, "nothing to do and nothing to wait for"
        return min(later)

    # ---- what can be done ----

    async def _leave(self, head: _Passage, now: Ns) -> bool:
        """Take an axis out of its loop that has no part in the next block."""
        for lane in self._lanes:
            if lane.joined and lane.index not in head.runs and lane.over <= now:
                await self._tell(lane.node, STOP)
                lane.joined = False
                return True
        return False

    async def _join(self, head: _Passage) -> bool:
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
        best: Lane | None = None
        key: tuple[int, bool, int] = (0, False, 0)
        for lane, waiting in zip(self._lanes, self._to_write, strict=True):
            if not waiting or (room := lane.room_at(now)) is None or room > now:
                continue
            passage, number, start, _ = waiting[0]
            # First commands first: without them nobody can be held.
            candidate = (self._passages.index(passage), number > 0, start)
            if best is None or candidate < key:
                best, key = lane, candidate
        if best is None:
            return False
        passage, number, _, motion = self._to_write[best.index].popleft()
        position, lines = best.write(motion)
        for line in lines:
            await self._tell(best.node, line)
        passage.left -= 1
        if number == 0:
            passage.firsts[best.index] = position
        return True

    async def _bar(self, head: _Passage, now: Ns) -> bool:
        """Have an axis held behind the block where its next one cannot be."""
        if head.left:
            return False
        for index, run in head.runs.items():
            lane = self._lanes[index]
            if lane.barred or lane.written > len(run.motions) or lane.room_at(now) != now:
                continue
            if len(self._passages) > 1 and index in self._passages[1].runs:
                continue  # its next first command comes here
            await self._tell(lane.node, lane.bar())
            return True
        return False

    async def _release(self, head: _Passage) -> None:
        """Release a block, and find out when that was."""
        streamed = self.streamed
        block = head.block
        if head.runs:
            await self._mother.until(self._acknowledged + QUIET)
            self._check()
        self._count_wait()
        if head.runs:
            await self._mother.broadcast(RELEASE)
            streamed.packets += 1
            if self._told is not None:
                self._told(0, RELEASE)
        self._passages.popleft()
        self._after = block
        streamed.over = False
        streamed.blocks += 1
        streamed.commands += sum(len(run.motions) for run in block.runs)
        streamed.lines = block.lines
        streamed.moving += block.duration * _TICK
        self._planned = self._mother.now + block.duration * _TICK
        for run in block.runs:
            self._lanes[run.axis].steps += run.steps
        streamed.positions = {lane.axis.name: lane.steps for lane in self._lanes}
        self._over = self._mother.now
        if head.runs:
            # Until it is known, in case there is no next word from the line.
            self._over += self._at(block.duration)
            by = await self._released_by(self._mother.now, head)
            for index, run in head.runs.items():
                lane = self._lanes[index]
                lane.release(
                    [by[index] + self._at(ticks) for ticks in run.loaded],
                    by[index] + self._at(run.end),
                )
                streamed.deepest = max(streamed.deepest, lane.deepest)
            self._over = max(self._lanes[index].over for index in head.runs)
        if self._progress is not None:
            self._progress(replace(streamed))

    async def _released_by(self, sent: Ns, head: _Passage) -> dict[int, Ns]:
        """When each axis was released at the latest. ``sent``: when ``y`` was out, by her figures.

        Each is sent a ``y`` of its own, which does nothing to one that runs, and starts one late
        that has not heard the first. But not to those that could be held for their next block by
        the time that comes, were it sent again. They have heard it, or nobody can tell.
        """
        by: dict[int, Ns] = {}
        late: Ns = 0
        for index, run in head.runs.items():
            if run.end * _TICK >= CONFIRMED:
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
        self._over += halted + dwell
        self._planned += halted + dwell

    def _count_wait(self) -> None:
        """Take note of how long all have stood still before this release."""
        if not self.streamed.blocks:
            return
        now = self._mother.now
        self.streamed.barriers += max(0, now - self._planned)
        waited = now - self._over
        if waited > _PROMPT:
            self.streamed.late += 1
            self.streamed.late_by += waited

    def _at(self, ticks: int) -> Ns:
        """How long after a release so many ticks of a node's are certain to be over."""
        return ceil(ticks * _TICK * self._slower) + self._margin

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
            await self._mother.until(self._over)
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
