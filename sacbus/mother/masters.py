"""The master of a protocol, for who speaks as one without knowing which: lines in words.

Owns this contract, what becomes of a line in terms that are every protocol's, and how masters are
found: entry points of the group ``sacbus.masters`` by the names of their protocols, the project's
own no differently from a third party's. Synchronous; knows no protocol.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from typing import Final, Generic, NamedTuple, TypeVar
from typing import Protocol as Contract

from sacbus.kernel import LineRate, Ns
from sacbus.mother.clock import Clock
from sacbus.mother.errors import BadRequest
from sacbus.mother.statistics import NodeStatistics

__all__ = [
    "GROUP",
    "Addressed",
    "Came",
    "Master",
    "MasterBase",
    "MasterKind",
    "Speak",
    "Transactions",
    "find_master",
]

GROUP: Final = "sacbus.masters"


class Addressed(NamedTuple):
    """A line taken apart: for ``node``, or for ``everybody``, who do not answer; and its command.

    Of what is for everybody ``node`` is what the protocol calls that, as a recording has it.
    """

    node: int
    command: str
    everybody: bool = False


@dataclass(frozen=True, slots=True)
class Came:
    """What became of a line.

    ``outcome``: ``ack``; ``sent`` for what nobody answers; ``nak``; ``no answer``; ``unknown`` for
    what may have been executed, or not; ``lost`` with the line. ``attempts``: how often it went.
    ``words``: what an answer said, or what went wrong, for people; empty where answers bring no
    words. ``mere``: an answer that says no more than ``outcome`` does, a protocol's plain ACK.
    """

    line: Addressed
    outcome: str
    attempts: int = 1
    words: str = ""
    mere: bool = False

    def __str__(self) -> str:
        return self.outcome if self.mere or not self.words else f"{self.outcome} ({self.words})"


#: Puts bytes on a line; with a 0 or 1 for each as its ninth bit where that says something.
Speak = Callable[[bytes, bytes | None], object]


class Transactions(Contract):
    """What requests become on one line, one at a time, by the rules of a protocol."""

    @property
    def statistics(self) -> Mapping[int, NodeStatistics]:
        """What has been counted of each node."""
        ...

    def hear(self, data: bytes) -> None:
        """Bytes of the nodes have arrived."""
        ...

    def lose(self, why: str) -> None:
        """The line is gone: everything that waits is lost, and so is all that is asked later."""
        ...


_T = TypeVar("_T", bound=Transactions)


class Master(Transactions, Contract):
    """A master on one line, who is asked in words."""

    def ask(
        self, line: str, done: Callable[[Came], object], *, accept_duplicates: bool = False
    ) -> None:
        """Have a line executed; ``done`` is called once, with what became of it.

        ``accept_duplicates``: after silence send again even what may then run twice. BadRequest at
        once for what :meth:`MasterKind.read` refuses.
        """
        ...


class MasterBase(Generic[_T]):
    """What masters of the project share: the line is their transactions' own business."""

    def __init__(self, transactions: _T) -> None:
        self._transactions = transactions

    @property
    def statistics(self) -> Mapping[int, NodeStatistics]:
        """As :class:`Transactions` has it; and so the others."""
        return self._transactions.statistics

    def hear(self, data: bytes) -> None:
        """Bytes from the line."""
        self._transactions.hear(data)

    def lose(self, why: str) -> None:
        """The line is gone."""
        self._transactions.lose(why)


class MasterKind(Contract):
    """The masters of a protocol, as an entry point of the group ``sacbus.masters`` gives them."""

    @property
    def answers_in_words(self) -> bool:
        """Whether an answer brings words; without, nobody can ask for what one must say."""
        ...

    def read(self, line: str) -> Addressed:
        """Whom a line is for; BadRequest, naming what is expected, for one that cannot be sent."""
        ...

    def create(
        self,
        clock: Clock,
        speak: Speak,
        rate: LineRate,
        *,
        slack: Ns | None = None,
        unsent: Callable[[], int] | None = None,
    ) -> Master:
        """A master on a line.

        ``slack``: how much later than the line's own figures an answer may come; None: as on a line
        in this process. ``unsent``, where it can be known: how many bytes still wait for the line.
        """
        ...


def find_master(protocol: str) -> MasterKind | None:
    """The master of a protocol; None when none is installed.

    BadRequest, naming it, for one that cannot be loaded.
    """
    entry = _installed(GROUP, tuple(sys.path)).get(protocol)
    if entry is None:
        return None
    try:
        kind: MasterKind = entry.load()
    except Exception as fault:  # a third party's import may fail in any way
        raise BadRequest(
            f"the master of {protocol!r} ({entry.value}) cannot be loaded: {fault!r}; "
            "mend or uninstall its package"
        ) from fault
    return kind


@lru_cache(1)
def _installed(group: str, _path: tuple[str, ...]) -> Mapping[str, EntryPoint]:
    """The masters by protocol. All that is installed on a path is looked through once: 2 ms."""
    found: dict[str, EntryPoint] = {}
    for entry in entry_points(group=group):
        found.setdefault(entry.name, entry)  # what stands first on the path
    return found
