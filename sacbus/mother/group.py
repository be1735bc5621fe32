"""Groups: several axes that start in the same instant, or not at all.

Owns what a group is told, what is planned of it, and when it is over. How nodes are loaded, held
and let go together is in release.py.

Nodes that were released together would tell of their starts together, and their packets would
collide; so a group is over when its planned time has passed, and soft ops play no part.
Source: manual, "SAC in a multi-axis environment"; spec, mother ("Groups").
"""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from sacbus.kernel import US, Ns
from sacbus.language import QUEUE_LENGTH, Defaults, Motion, Move, RunPosition, Session, parse
from sacbus.language.line import quoted
from sacbus.mother.edits import edit_lines
from sacbus.mother.errors import BadRequest, MotherError, Stopped
from sacbus.mother.mother import Mother
from sacbus.mother.release import STOP, Release, Share, stand_down, start_together
from sacbus.mother.request import checked_address
from sacbus.mother.timeline import DRIFT_PPM, Departure
from sacbus.motion import TICKS_PER_US, Drive, Profile, plan

__all__ = ["Command", "Group", "GroupMotion", "GroupRun", "Member"]

#: What an axis is to do: a line such as ``"m400v120"``, steps (negative: against the node's default
#: direction), or a motion with every value in it.
Command = str | int | Motion


@dataclass(frozen=True, slots=True)
class Member:
    """An axis of a group: its node, and the settings by which its commands are planned.

    drive: ustep, sprf, slow, ihd and xclk as the node has them; the factory's by default.
    defaults: what stands for what a command leaves out, and the direction of one without a sign;
    the factory's with the drive's sprf by default. They are sent with every command, so the node's
    own do not matter, but for the direction.
    """

    node: int
    drive: Drive = field(default_factory=Drive)
    defaults: Defaults | None = None

    @property
    def filling(self) -> Defaults:
        """The defaults that count."""
        return self.defaults or Defaults(sprf=self.drive.steps_per_rev)


@dataclass(frozen=True, slots=True)
class GroupMotion:
    """What one axis does, planned. Times in ns of the node's own time, from the release.

    start: of the first pulse, after its wait. end: when the last period has run out.
    """

    motion: Motion
    profile: Profile
    start: Ns
    end: Ns


class GroupRun:
    """A group that has been started. ``motions``: what each axis does."""

    def __init__(
        self, mother: Mother, motions: Mapping[str, GroupMotion], release: Release, drift_ppm: int
    ) -> None:
        self._mother = mother
        self._stops = mother.caller.stops
        self.motions: Final = motions
        #: When they were released, by mother's clock.
        self.release: Final = release
        departure = Departure(release.earliest, release.latest, drift_ppm)
        #: When all of them are over for certain, ns by mother's clock.
        self.over_at: Final[Ns] = departure.surely_by(max(one.end for one in motions.values()))

    @property
    def done(self) -> bool:
        """Whether the planned time has passed."""
        return self._mother.now >= self.over_at

    async def wait(self) -> None:
        """Wait until the planned time has passed; who is cancelled meanwhile stops nothing.

        :class:`Stopped` when an emergency stop has come since the start, be it after the end.
        """
        if self._mother.caller.stops != self._stops:
            raise Stopped(0, "")
        await self._mother.until(self.over_at)


class Group:
    """Axes by name, and the nodes that move them.

    ::

        group = mother.group(x=10, y=11)
        await group.move(x="m400v120", y="m-200v60")    # returns when both stand
        run = await group.start(x=400, y="m200t250000") # y a quarter of a second after x
        ...
        await run.wait()

    An axis that is not named in a command stays as it is. The others should stand still, with
    nothing pending: X, by which a group holds, goes before what runs and cuts it. Each command is
    written into ``position`` of its node's queue; what stood there is lost.
    """

    def __init__(
        self,
        mother: Mother,
        axes: Mapping[str, int | Member],
        *,
        position: int = QUEUE_LENGTH,
        drift_ppm: int = DRIFT_PPM,
    ) -> None:
        """``drift_ppm``: how much later than planned a node may be over; 0 on a common clock.

        :class:`BadRequest` for what no node can be, two axes on one, and a position that is none.
        """
        members = {
            name: axis if isinstance(axis, Member) else Member(axis) for name, axis in axes.items()
        }
        if not members:
            raise BadRequest("a group without axes: name one, as in group(x=10)")
        nodes: dict[int, str] = {}
        for name, member in members.items():
            other = nodes.setdefault(checked_address(member.node), name)
            if other != name:
                raise BadRequest(
                    f"axes {other} and {name}: expected a node each, got node {member.node} for "
                    "both"
                )
        if not 1 <= position <= QUEUE_LENGTH:
            raise BadRequest(f"queue position {position}: expected 1 to {QUEUE_LENGTH}")
        self._mother = mother
        self.axes: Final[Mapping[str, Member]] = members
        self.position: Final = position
        self._drift_ppm = drift_ppm

    def plan(
        self, commands: Mapping[str, Command] | None = None, /, **named: Command
    ) -> dict[str, GroupMotion]:
        """What the axes would do. Nothing is sent; :class:`BadRequest` for what cannot be done."""
        wanted = {**(commands or {}), **named}
        if not wanted:
            raise BadRequest("a group that is told nothing: name an axis, as in move(x=400)")
        return {name: self._planned(name, command) for name, command in wanted.items()}

    async def start(
        self,
        commands: Mapping[str, Command] | None = None,
        /,
        *,
        release: Callable[[], object] | None = None,
        **named: Command,
    ) -> GroupRun:
        """Start all axes that are named together; returns as soon as they are released.

        Each starts at that instant, or so many microseconds later as its command's T says. A node
        that does not acknowledge what it is sent keeps all from starting (:class:`NotStarted`); so
        does a call that is cancelled before. The release is the broadcast ``y``, which lets go
        every node on the line that is held, of this group or not; or what ``release`` does, which
        may be a coroutine function: it pulls the nodes' shared sync line low.
        """
        motions = self.plan(commands, **named)
        shares = [self._share(name, planned.motion) for name, planned in motions.items()]
        let_go = None if release is None else _awaitable(release)
        released = await start_together(self._mother, shares, release=let_go)
        return GroupRun(self._mother, motions, released, self._drift_ppm)

    async def move(
        self,
        commands: Mapping[str, Command] | None = None,
        /,
        *,
        release: Callable[[], object] | None = None,
        **named: Command,
    ) -> GroupRun:
        """As :meth:`start`, and wait until the planned time has passed.

        A call that is cancelled stops the axes that it has started, with S.
        """
        run = await self.start(commands, release=release, **named)
        try:
            await run.wait()
        except BaseException:
            await stand_down(self._mother, [self.axes[name].node for name in run.motions])
            raise
        return run

    async def stop(self) -> None:
        """Stop all axes with S, one after the other, whatever they do.

        Where every millisecond counts, the e-stop of mother's is quicker, and stops all nodes.
        Those that do not acknowledge it are sent it once more when all others have been sent
        theirs; the first error of these is raised.
        """
        failed: MotherError | None = None
        for node in await stand_down(self._mother, [member.node for member in self.axes.values()]):
            try:
                await self._mother.send(node, STOP)
            except MotherError as failure:  # the others need theirs
                failed = failed or failure
        if failed is not None:
            raise failed

    async def use_common_clock(self, *, on: bool = True) -> None:
        """Have the nodes count the clock at their xclk pins from now on, or again their own.

        It is written to their EEPROMs, and they are rebooted (``$R``), which ends all motion and
        puts session settings back. Somebody must drive the clock, at the ``xfreq`` of the nodes, or
        nothing moves (``HostedBus.shared_line``; an adapter has no output that is quick enough).
        """
        for member in self.axes.values():
            await self._mother.send(member.node, f"$CC{int(not on)}")
        for member in self.axes.values():
            # A second reboot does what the first one did.
            await self._mother.send(member.node, "$R", accept_duplicates=True)

    def _planned(self, name: str, command: Command) -> GroupMotion:
        member = self._member(name)
        motion = replace(_motion(name, command, member.filling), sync=True)
        profile = plan(motion, member.drive)
        if profile.duration is None:
            raise BadRequest(
                f"axis {name}: expected a motion with an end, got a continuous one; give it steps"
            )
        start = motion.wait_us * US
        return GroupMotion(motion, profile, start, start + profile.duration * US // TICKS_PER_US)

    def _share(self, name: str, motion: Motion) -> Share:
        member = self.axes[name]
        lines = edit_lines(self.position, motion, member.filling)
        return Share(member.node, lines, [RunPosition(self.position).text()])

    def _member(self, name: str) -> Member:
        try:
            return self.axes[name]
        except KeyError:
            have = ", ".join(self.axes)
            raise BadRequest(f"axis {name}: expected one of this group, {have}") from None


def _motion(name: str, command: Command, defaults: Defaults) -> Motion:
    """The motion that a command says, with the defaults for what it does not."""
    if isinstance(command, Motion):
        return command
    if isinstance(command, int):
        if not command:
            raise BadRequest(
                f"axis {name}: expected steps other than 0; leave out an axis that is to stand"
            )
        move = Move(abs(command), opposite=command < 0)
    else:
        if not isinstance(command, str):
            raise BadRequest(
                f"axis {name}: expected a line, whole steps or a Motion, got {command!r}, "
                f"{type(command).__name__}"
            )
        parsed = parse(command)
        if not isinstance(parsed.command, Move) or parsed.remarks:
            why = f": {parsed.remarks[0]}" if parsed.remarks else ""
            raise BadRequest(
                f"axis {name}: expected a motion command such as m400v120, got "
                f"{quoted(command)}{why}"
            )
        move = parsed.command
    return Session.start(defaults).resolve(move)[0]


def _awaitable(release: Callable[[], object]) -> Callable[[], Awaitable[object]]:
    """A release as a coroutine function, whichever it is."""

    async def let_go() -> None:
        result = release()
        if inspect.isawaitable(result):
            await result

    return let_go
