"""The lines as a Value Change Dump, written and read: for GTKWave, PulseView and a logic analyser.

Owns the form, and which wires of a file are the lines. Both ways go through a file in pieces, so
that one of any length takes no more memory than a short one. Written by hand rather than with
pyvcd, which takes a call an edge: ten million steps are thirty million of them.

Ours have the wires ``dir`` and ``step_NAME`` in the scope ``simad``, a tick a ns. Read are those of
others as well: any time scale, wires of any name, and whatever else is in the file is passed over.
Source: IEEE 1364, "Value change dump files".
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO, Final

import numpy as np

from sacbus.simad.edges import DIR, HIGH, LOW, UNKNOWN, Edges
from sacbus.simad.fault import SimadError
from sacbus.simad.steps import LATEST, MOST_AXES

__all__ = ["SCOPE", "Wires", "read_dump", "wire_names", "write_dump"]

SCOPE: Final = "simad"

#: Edges of a file that are handed out at a time, and bytes that are read.
PIECE: Final = 1 << 17
BYTES: Final = 1 << 20

#: A time scale's unit in ps, so that the parts of a ns are whole numbers.
_UNITS: Final = {"s": 10**12, "ms": 10**9, "us": 10**6, "ns": 10**3, "ps": 1}
_SCALE: Final = re.compile(r"(10{0,2})\s*([munp]?s)")

_LEVELS: Final = {"0": LOW, "1": HIGH, "x": UNKNOWN, "X": UNKNOWN, "z": UNKNOWN, "Z": UNKNOWN}


def wire_names(names: Sequence[str]) -> list[str]:
    """What the lines are called in a dump, DIR first, by the names of the axes."""
    return ["dir", *(f"step_{re.sub(r'[^A-Za-z0-9_]', '_', name)}" for name in names)]


# ---- writing ----


def write_dump(
    parts: Iterable[Edges], out: BinaryIO, names: Sequence[str], since: int = 0, end: int = 0
) -> int:
    """Write edges, as they come; how many. ``names``: of the axes.

    ``since``: when the file begins, ns, no later than the first edge; ``end``: when it ends, unless
    the last edge is later.
    """
    wires = wire_names(names)
    codes = [_code(number) for number in range(len(wires))]
    head = ["$version sacbus $end", "$timescale 1 ns $end", f"$scope module {SCOPE} $end"]
    head += [f"$var wire 1 {code} {wire} $end" for code, wire in zip(codes, wires, strict=True)]
    head += ["$upscope $end", "$enddefinitions $end", f"#{since}", "$dumpvars"]
    changes = [f"{level}{code}\n" for code in codes for level in (LOW, HIGH)]
    written, now = 0, since
    for part in parts:
        if head and part.count:
            out.write(_beginning(head, codes, part.direction))
            head = []
        if part.count:
            out.write(_body(part, changes, now))
            now = int(part.times[-1])
            written += part.count
    if head:
        out.write(_beginning(head, codes, HIGH))
    if end > now:
        out.write(f"#{end}\n".encode())
    return written


def _beginning(head: Sequence[str], codes: Sequence[str], direction: int) -> bytes:
    levels = [f"{direction}{codes[0]}", *(f"{HIGH}{code}" for code in codes[1:])]
    return "\n".join((*head, *levels, "$end", "")).encode()


def _body(edges: Edges, changes: Sequence[str], now: int) -> bytes:
    """Edges as text; ``now``: what the file has come to, whose line is there already."""
    times = edges.times
    same = np.append(times[0] == now, times[1:] == times[:-1]).tolist()
    which = (edges.lines.astype(np.int64) * 2 + edges.levels).tolist()
    return "".join(
        [
            changes[change] if together else f"#{when}\n{changes[change]}"
            for when, change, together in zip(times.tolist(), which, same, strict=True)
        ]
    ).encode()


def _code(number: int) -> str:
    """A short name of a wire, of printable characters; none is like a number or a keyword."""
    first, rest = 33, 94
    return (
        chr(first + number)
        if number < rest
        else chr(first + number // rest - 1) + chr(first + number % rest)
    )


# ---- reading ----


@dataclass(frozen=True, slots=True)
class Wires:
    """The lines in a file: their full names, DIR first, and how long a tick is, in ps."""

    names: tuple[str, ...]
    codes: tuple[str, ...]
    tick: int

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes' names: what follows ``step_``, or all of the last word."""
        words = [name.rpartition(".")[2] for name in self.names[1:]]
        return tuple(word.removeprefix("step_") for word in words)


def read_dump(
    file: BinaryIO, direction: str = "", steps: Sequence[str] = ()
) -> tuple[Wires, Iterator[Edges]]:
    """The lines of a file, and their edges in pieces, all of an instant together.

    ``direction`` and ``steps``: the wires' names, in full or the last word of it. Without them
    those of a scope with a ``dir`` and with wires that begin with ``step``. What a wire is at first
    is an edge too, from a level that is not known, a tick before the file begins. SimadError for
    what is no such file.
    """
    words = _words(file)
    tick, known = _head(words)
    names = (direction, *steps) if direction or steps else _found(known)
    full = [_named(known, name) for name in names]
    codes = [known[name] for name in full]
    if len(set(codes)) < len(codes):
        raise SimadError(f"expected wires of their own, got one twice in {', '.join(full)}")
    return Wires(tuple(full), tuple(codes), tick), _edges(words, codes, tick)


def _words(file: BinaryIO) -> Iterator[str]:
    rest = ""
    while block := file.read(BYTES):
        text = rest + block.decode("latin-1")
        words = text.split()
        rest = "" if text[-1].isspace() or not words else words.pop()
        yield from words
    if rest:
        yield rest


def _head(words: Iterator[str]) -> tuple[int, dict[str, str]]:
    """The time scale, and the codes of all wires of one bit by their full names."""
    tick, scopes = 0, list[str]()
    known: dict[str, str] = {}
    for word in words:
        if word == "$enddefinitions":
            _until_end(words)
            if not tick:
                raise SimadError("expected a $timescale before $enddefinitions, got none")
            return tick, known
        if not word.startswith("$"):
            continue  # sigrok-cli writes its sample rate before the dump
        told = _until_end(words)
        match word, told:
            case "$timescale", _:
                tick = _tick(" ".join(told))
            case "$scope", [_, name]:
                scopes.append(name)
            case "$upscope", _ if scopes:
                scopes.pop()
            case "$var", [_, "1", code, name, *_]:
                known[".".join((*scopes, name))] = code
            case _:
                pass  # a comment, a date, a wire of several bits
    raise SimadError("expected a value change dump, got no $enddefinitions")


def _until_end(words: Iterator[str]) -> list[str]:
    told: list[str] = []
    for word in words:
        if word == "$end":
            return told
        told.append(word)
    raise SimadError("expected $end, got the end of the file")


def _tick(text: str) -> int:
    found = _SCALE.fullmatch(text)
    if found is None:
        raise SimadError(f"$timescale: expected one such as 1 ns or 100 ps, got {text!r}")
    return int(found[1]) * _UNITS[found[2]]


def _found(known: dict[str, str]) -> tuple[str, ...]:
    """The lines of the one scope that has some."""
    scopes: dict[str, tuple[list[str], list[str]]] = {}
    for name in known:
        scope, _, word = name.rpartition(".")
        dirs, steps = scopes.setdefault(scope, ([], []))
        if word.lower() == "dir":
            dirs.append(name)
        elif word.lower().startswith("step"):
            steps.append(name)
    right = [(*dirs, *steps) for dirs, steps in scopes.values() if len(dirs) == 1 and steps]
    if len(right) != 1:
        there = ", ".join([*known][:12]) or "none"
        raise SimadError(
            f"expected one scope with wires dir and step_..., got {len(right)}, "
            f"name the wires, of {there}"
        )
    return right[0]


def _named(known: dict[str, str], name: str) -> str:
    """The full name of a wire."""
    if name in known:
        return name
    alike = [one for one in known if one.endswith(f".{name}")]
    if len(alike) != 1:
        there = ", ".join(alike[:12] or [*known][:12]) or "none"
        raise SimadError(f"expected one wire {name!r}, got {len(alike)}, of {there}")
    return alike[0]


def _edges(words: Iterator[str], codes: Sequence[str], tick: int) -> Iterator[Edges]:
    if len(codes) - 1 > MOST_AXES:
        raise SimadError(f"expected {MOST_AXES} step lines at most, got {len(codes) - 1}")
    changes = {
        f"{shown}{code}": line << 2 | level
        for line, code in enumerate(codes)
        for shown, level in _LEVELS.items()
    }
    find = changes.get
    ticks: list[int] = []
    which: list[int] = []
    direction, now, at_first = UNKNOWN, 0, 0
    for word in words:
        change = find(word)
        if change is not None:
            # What the file begins with has been so before: a line that falls at once does fall.
            ticks.append(now - at_first)
            which.append(change)
        elif word[0] == "#":
            if len(ticks) >= PIECE:
                part = _part(ticks, which, tick, direction)
                yield part
                direction = _last_direction(part)
                ticks, which = [], []
            now = _later(word, now)
        elif word[0] in "bBrRsS":
            next(words, "")  # a value of several bits, and whose it is
        elif word == "$comment":
            _until_end(words)
        elif word in {"$dumpvars", "$end"}:
            at_first = int(word == "$dumpvars" and not ticks and direction == UNKNOWN)
        # Else a value of another wire, or a keyword about values, which follow as any others.
    if ticks:
        yield _part(ticks, which, tick, direction)


def _later(word: str, now: int) -> int:
    digits = word[1:]
    if not (digits.isascii() and digits.isdecimal() and len(digits) < 19):
        raise SimadError(f"expected a time such as #100, got {word[:40]!r}")
    when = int(digits)
    if when < now:
        raise SimadError(f"expected a time no earlier than #{now}, got {word}")
    return when


def _part(ticks: list[int], which: list[int], tick: int, direction: int) -> Edges:
    """Edges of a piece. Parts of a ns are cut off: that keeps the order."""
    if ticks[-1] * tick // _UNITS["ns"] >= LATEST:
        raise SimadError(f"expected times up to 52 days, got #{ticks[-1]}")
    times = np.array(ticks, dtype=np.int64)
    if tick >= _UNITS["ns"]:
        times *= tick // _UNITS["ns"]
    else:
        times //= _UNITS["ns"] // tick
    both = np.array(which, dtype=np.int64)
    return Edges(times, (both >> 2).astype(np.uint8), (both & 3).astype(np.uint8), direction)


def _last_direction(edges: Edges) -> int:
    """The level of DIR behind some edges."""
    turns = np.flatnonzero(edges.lines == DIR)
    return int(edges.levels[turns[-1]]) if turns.size else edges.direction
