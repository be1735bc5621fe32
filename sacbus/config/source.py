"""A configuration's text: from a file or standard input to TOML's values and their lines.

Owns what can be wrong before any key is looked at: no such file, not readable, not UTF-8, not TOML.
Each of these is one ConfigError of one mistake, with line and column where there are some.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from sacbus.config import lines
from sacbus.config.mistake import ConfigError, Mistake

__all__ = ["Source", "load", "parse"]

#: A configuration of 250 nodes with all their settings has a tenth of this.
MOST_BYTES: Final = 1 << 20

#: How tomllib ends its messages.
_AT: Final = re.compile(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


#: How tomllib begins them where a header is there already, as a table or as an array of some.
_CLASHES: Final = ("Cannot declare", "Cannot overwrite a value")
_HEADER: Final = re.compile(r"\s*(\[{1,2})\s*([^\[\]#]*?)\s*\]{1,2}\s*(?:#.*)?")


@dataclass(frozen=True, slots=True)
class Source:
    """A text that is TOML. ``directory`` is where its relative paths begin."""

    name: str
    directory: Path
    content: Mapping[str, object]
    lines: Mapping[lines.Path, int]


def load(file: str | Path, sort: str = "configuration") -> Source:
    """Read a file, or standard input for ``-``; ConfigError when it gives no TOML.

    ``sort``: what the file should be, in words.
    """
    if str(file) == "-":
        data = sys.stdin.buffer.read(MOST_BYTES + 1)
        return parse(data, "standard input", Path.cwd(), sort)
    name = _printable(str(file))
    try:
        with Path(file).open("rb") as opened:
            data = opened.read(MOST_BYTES + 1)
    except OSError as fault:
        what = f"cannot read the {sort} ({fault.strerror or fault})"
        raise _wrong(name, what, "check the path and its permissions") from fault
    except ValueError as fault:  # a NUL in its name
        raise _wrong(name, f"no file can have this name ({fault})", "check the path") from fault
    return parse(data, name, Path(file).absolute().parent, sort)


def parse(data: bytes, name: str, directory: Path, sort: str = "configuration") -> Source:
    """Bytes to TOML's values; ``name`` is what the mistakes call their origin."""
    if len(data) > MOST_BYTES:
        what = f"expected a {sort} of at most {MOST_BYTES} bytes, got more"
        raise _wrong(name, what, "check whether this is the right file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        begin = data.rfind(b"\n", 0, fault.start) + 1
        column = len(data[begin : fault.start].decode("utf-8-sig")) + 1
        what = f"expected UTF-8, got the byte {data[fault.start]:#04x}"
        line = data.count(b"\n", 0, begin) + 1
        raise _wrong(name, what, "save the file as UTF-8", line, column) from fault
    try:
        content = tomllib.loads(text)
        found = lines.locate(text)
    except tomllib.TOMLDecodeError as fault:
        raise _not_toml(name, text.replace("\r\n", "\n"), str(fault)) from fault
    except RecursionError as fault:
        raise _wrong(name, "brackets are nested too deeply", "write it flatter") from fault
    except ValueError as fault:  # Python converts no longer ones
        raise _wrong(name, "a number has too many digits", "write a shorter one") from fault
    return Source(name, directory, content, found)


def _single(text: str, line: int) -> tuple[str, str, int] | None:
    """Of two headers that clash, what is wrong, what to do and in which line; ``line``: the second.

    The likeliest slip with arrays of tables is a header with a bracket too few.
    """
    headers = {
        at: (hit[1], hit[2])
        for at, one in enumerate(text.split("\n")[:line], 1)
        if (hit := _HEADER.fullmatch(one))
    }
    if line not in headers:
        return None
    name = headers[line][1]
    alike = [at for at, one in headers.items() if one[1] == name]
    single = [at for at in alike if headers[at][0] == "["]
    if len(alike) < 2 or not single:
        return None
    if len(single) < len(alike):
        return f"expected [[{name}]] each time, got [{name}]", f"write [[{name}]]", single[0]
    what = f"expected [{name}] once, got it twice"
    return what, f"write [[{name}]] where there may be several", line


def _not_toml(name: str, text: str, said: str) -> ConfigError:
    what, line, column = said, None, None
    if hit := _AT.fullmatch(said):
        what = hit[1]
        line, column = text.count("\n") + 1, len(text) - text.rfind("\n")
        if hit[2]:
            line, column = int(hit[2]), int(hit[3])
    if line is not None and what.startswith(_CLASHES) and (told := _single(text, line)):
        return _wrong(name, f"not TOML: {told[0]}", told[1], told[2])
    what = " ".join(what.split())
    return _wrong(name, f"not TOML: {what[:1].lower()}{what[1:]}", "correct it", line, column)


def _wrong(
    name: str, what: str, remedy: str, line: int | None = None, column: int | None = None
) -> ConfigError:
    return ConfigError([Mistake(name, line, column, "", what, remedy)])


def _printable(name: str) -> str:
    """A file's name, on one line whatever it holds."""
    return name if name.isprintable() else repr(name)
