"""TOML texts: as anybody might write them, and as nobody should."""

from __future__ import annotations

import json
from itertools import count

from hypothesis import strategies as st

from sacbus.config.keys import BUS, LINKS, NODE, TOP

__all__ = ["configurations", "documents", "dumped"]

_NAMES = st.sampled_from(["a", "b", "c", "d-1", "é", "x y", 'q"', "d.e", "#", "]", ""])
_BLANKS = st.sampled_from(["", " ", "\t", "  "])
_COMMENTS = st.sampled_from(["", " # c", "# [x]", " # '''", ' # """ = {'])
_SCALARS = st.sampled_from(
    [
        "true",
        "1.5e3",
        "inf",
        "1979-05-27 07:32:00",
        "07:32:00",
        "'x'",
        '"# ]"',
        r'"\"}"',
        "'''\n[x]\n'''",
        '"""\ny = "z" ""\\"" ] \n"""',
        '"""a"""""',
        "[]",
        "{}",
    ]
)


def _spelled(name: str) -> st.SearchStrategy[str]:
    """A key, bare if it can be, or quoted."""
    quoted = [json.dumps(name, ensure_ascii=True)]
    if "'" not in name:
        quoted.append(f"'{name}'")
    if name.isascii() and name.replace("-", "").isalnum():
        quoted.append(name)
    return st.sampled_from(quoted)


@st.composite
def documents(draw: st.DrawFn) -> str:
    """A right TOML text of odd looks; its whole numbers are all different, and long."""
    numbers = count(100_000_001)
    lines: list[str] = []

    def value(depth: int) -> str:
        shape = draw(st.integers(0, 3 if depth < 3 else 1))
        if shape == 0:
            return str(next(numbers))
        if shape == 1:
            return draw(_SCALARS)
        if shape == 2:
            between = draw(st.sampled_from([",", ", ", " ,\n", ", # ],\n\n"]))
            around = draw(st.sampled_from(["", " ", "\n", " # [\n "]))
            inner = between.join(value(depth + 1) for _ in range(draw(st.integers(0, 3))))
            trailing = draw(st.sampled_from(["", ","])) if inner else ""
            return f"[{around}{inner}{trailing}{around}]"
        names = draw(st.lists(_NAMES, max_size=3, unique=True))
        blank = draw(_BLANKS)
        pairs = [f"{blank}{draw(_spelled(one))}{blank}={blank}{value(depth + 1)}" for one in names]
        return f"{{{','.join(pairs)}{blank}}}"

    def body(*, without: frozenset[str] = frozenset()) -> None:
        for name in draw(st.lists(_NAMES, max_size=3, unique=True)):
            if name in without:
                continue
            key = draw(_spelled(name))
            for inner in draw(st.lists(_NAMES, max_size=2)):
                key += draw(_BLANKS) + "." + draw(_BLANKS) + draw(_spelled(inner))
            lines.append(f"{draw(_BLANKS)}{key}{draw(_BLANKS)}={draw(_BLANKS)}{value(0)}")
            lines[-1] += draw(_COMMENTS)
            lines.extend([""] * draw(st.integers(0, 2)))

    body()
    # Headers have names of their own, so that no two of them contradict each other.
    for number in range(draw(st.integers(0, 3))):
        name = f"t{number}"
        if draw(st.booleans()):
            lines.append(f"[{name}.{draw(_spelled('in side'))}]{draw(_COMMENTS)}")
            body()
            lines.append(f"{draw(_BLANKS)}[ {name} ]")
            body(without=frozenset({"in side"}))
        else:
            for _ in range(draw(st.integers(1, 3))):
                lines.append(f"[[{draw(_BLANKS)}{name}{draw(_BLANKS)}]]{draw(_COMMENTS)}")
                body()
                for _ in range(draw(st.integers(0, 2))):
                    lines.append(f"[[{name}.{draw(_spelled('sub'))}]]")
                    body()
                    if draw(st.booleans()):
                        lines.append(f"[{name}.sub.{draw(_spelled('deep er'))}]")
                        body()
    ending = draw(st.sampled_from(["\n", "\r\n"]))
    return "\n".join(lines).replace("\n", ending)


_ANY_KEY = st.sampled_from(
    sorted({key.name for keys in (TOP, BUS, NODE, *LINKS.values()) for key in keys})
) | st.text("abk_ \n'\"", max_size=5)
_NONSENSE = st.recursive(
    st.booleans()
    | st.integers(-(2**80), 2**80)
    | st.integers(0, 260)
    | st.floats()
    | st.sampled_from(["", "sca", "10-19,x", "[::1]:1", "x\ny", "\0", "\u2028", "socket://h:1"])
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
    | st.dates()
    | st.datetimes(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_ANY_KEY, inner, max_size=3),
    max_leaves=6,
)

_STATES = st.sampled_from([False, "memory", "~/memory", "/x/left", "../x"])
_SERVED = {
    "listen": st.sampled_from(["7000", "127.0.0.1:7001", "[::1]:7000", "0.0.0.0:7000", "b:1", 0]),
    "echo": st.booleans(),
    "latency_us": st.integers(0, 5_000),
}
_LINK = st.one_of(
    st.fixed_dictionaries(
        {"kind": st.just("pty")},
        optional={"path": st.sampled_from(["a", "./a", "/x/b", "~/c"]), "echo": st.booleans()},
    ),
    st.fixed_dictionaries({"kind": st.just("tcp")}, optional=_SERVED),
    st.fixed_dictionaries({"kind": st.just("rfc2217")}, optional=_SERVED),
    st.fixed_dictionaries(
        {"kind": st.just("adapter"), "device": st.sampled_from(["COM5", "/dev/ttyX9", "a"])},
        optional={"rts": st.booleans(), "echo": st.booleans()},
    ),
)
_SETTINGS = {
    "kind": st.just("sac"),
    "ustep": st.integers(0, 7),
    "receiver": st.sampled_from(["device", "robust"]),
    "soft_ops": st.booleans(),
}
_NODE = st.one_of(
    st.fixed_dictionaries({"address": st.integers(4, 255)}, optional=_SETTINGS),
    st.fixed_dictionaries(
        {"addresses": st.sampled_from(["10-19,85", "20", "30-40"])}, optional=_SETTINGS
    ),
)
_BUS = st.fixed_dictionaries(
    {"name": st.sampled_from(["left", "Left", "right", "bus 3"])},
    optional={
        "protocol": st.just("sac"),
        "baud": st.integers(300, 4_000_000),
        "lanes": st.integers(1, 2),
        "seed": st.integers(-9, 9),
        "pace": st.booleans(),
        "state": _STATES,
        "nodes": st.lists(_NODE, max_size=3),
        "links": st.lists(_LINK, max_size=3),
    },
)
_RIGHT = st.fixed_dictionaries(
    {"bus": st.lists(_BUS, min_size=1, max_size=2)},
    optional={"state": _STATES, "speed": st.floats(0.1, 10), "precise": st.booleans()},
)


def _places(value: object) -> list[dict[str, object] | list[object]]:
    """A configuration's tables and arrays."""
    found: list[dict[str, object] | list[object]] = []
    if isinstance(value, dict | list):
        found.append(value)
        for one in value.values() if isinstance(value, dict) else value:
            found += _places(one)
    return found


@st.composite
def configurations(draw: st.DrawFn) -> dict[str, object]:
    """A configuration that may be right, with up to three places at which it is hardly so."""
    content = draw(_RIGHT)
    for _ in range(draw(st.integers(0, 3))):
        place = draw(st.sampled_from(_places(content)))
        if isinstance(place, list):
            place.insert(draw(st.integers(0, len(place))), draw(_NONSENSE))
            continue
        key = draw(st.sampled_from([*place, ""])) or draw(_ANY_KEY)
        value = place.pop(key, None)
        if draw(st.booleans()):
            place[key] = draw(_NONSENSE)
        else:
            place[draw(_ANY_KEY)] = value if value is not None else draw(_NONSENSE)
    return content


def dumped(value: object) -> str:
    """A value as TOML, tables in braces."""
    match value:
        case bool():
            return str(value).lower()
        case dict():
            return f"{{{', '.join(f'{_text(one)} = {dumped(of)}' for one, of in value.items())}}}"
        case list():
            return f"[{', '.join(map(dumped, value))}]"
        case str():
            return _text(value)
        case int() | float():
            return repr(value)
        case _:
            return value.isoformat()  # type: ignore[attr-defined,no-any-return]  # dates


def _text(value: str) -> str:
    escaped = "".join(
        one if one.isalnum() and one.isascii() else f"\\U{ord(one):08x}" for one in value
    )
    return f'"{escaped}"'
