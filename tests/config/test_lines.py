"""Where keys stand: by hand for what is strange, by property against tomllib for the rest."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator

import pytest
from hypothesis import given

from sacbus.config.lines import Path, line_of, locate
from tests.config.strategies import documents


def paths(value: object, path: Path = ()) -> Iterator[tuple[Path, object]]:
    """Every path in TOML's values that is short enough to be kept, and what is there."""
    if path:
        yield path, value
    if len(path) == 7:
        return
    if isinstance(value, dict):
        for name, one in value.items():
            yield from paths(one, (*path, name))
    elif isinstance(value, list):
        for index, one in enumerate(value):
            yield from paths(one, (*path, index))


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("", {}),
        ("a = 1", {("a",): 1}),
        ("# a = 1\n\n  a = 1 # b = 2\nb=2\n", {("a",): 3, ("b",): 4}),
        ("a = 1\r\n\r\nb = 2\r\n", {("a",): 1, ("b",): 3}),
        ("a . b\t.\tc = 1", {("a",): 1, ("a", "b"): 1, ("a", "b", "c"): 1}),
        ("a.b = 1\na.c = 1", {("a",): 1, ("a", "b"): 1, ("a", "c"): 2}),
        ('"a.b" = 1\n\'c"d\'.e = 2', {("a.b",): 1, ('c"d',): 2, ('c"d', "e"): 2}),
        (r'"\u0061\"\\" = 1', {('a"\\',): 1}),
        ('"" = 1', {("",): 1}),
        ("1.2 = 3.4", {("1",): 1, ("1", "2"): 1}),
        ('a = "x # y ] }"\nb = 1', {("a",): 1, ("b",): 2}),
        ('a = "\\""\nb = 1', {("a",): 1, ("b",): 2}),
        ("a = 'C:\\'\nb = 1", {("a",): 1, ("b",): 2}),
        ('a = ""\nb = 1', {("a",): 1, ("b",): 2}),
        ('a = """\nb = 0\n"""\nb = 1', {("a",): 1, ("b",): 4}),
        ('a = """\\"""\n"""\nb = 1', {("a",): 1, ("b",): 3}),
        ('a = """x"""""\nb = """"x"""\nc = """"""', {("a",): 1, ("b",): 2, ("c",): 3}),
        ("a = '''\n'' ' b = 0'''''\nb = 1", {("a",): 1, ("b",): 3}),
        ("a = 1979-05-27 07:32:00Z # b\nb = 1", {("a",): 1, ("b",): 2}),
        ("a = []\nb = [ # ]\n]\nc = 1", {("a",): 1, ("b",): 2, ("c",): 4}),
        (
            "a = [1, [\n2, '],'\n], # ]\n3,\n]\nb = 1",
            {
                ("a",): 1,
                ("a", 0): 1,
                ("a", 1): 1,
                ("a", 1, 0): 2,
                ("a", 1, 1): 2,
                ("a", 2): 4,
                ("b",): 6,
            },
        ),
        (
            'a = { b = 1, c.d = """\n""", e = [\n1] }\nf = {}',
            {
                ("a",): 1,
                ("a", "b"): 1,
                ("a", "c"): 1,
                ("a", "c", "d"): 1,
                ("a", "e"): 2,
                ("a", "e", 0): 3,
                ("f",): 4,
            },
        ),
        (
            "[a.b]\nc = 1\n[a]\nd = 1\n[ 'e' ]",
            {("a",): 3, ("a", "b"): 1, ("a", "b", "c"): 2, ("a", "d"): 4, ("e",): 5},
        ),
        (
            "[[a]]\nx = 1\n[[a.b]]\n[a.b.c]\ny = 1\n[[a.b]]\n[[a]]\n[[a.b]]",
            {
                ("a",): 1,
                ("a", 0): 1,
                ("a", 0, "x"): 2,
                ("a", 0, "b"): 3,
                ("a", 0, "b", 0): 3,
                ("a", 0, "b", 0, "c"): 4,
                ("a", 0, "b", 0, "c", "y"): 5,
                ("a", 0, "b", 1): 6,
                ("a", 1): 7,
                ("a", 1, "b"): 8,
                ("a", 1, "b", 0): 8,
            },
        ),
        (
            "[a]\n[[a.b]]\nx.y = 1",
            {("a",): 1, ("a", "b"): 2, ("a", "b", 0): 2}
            | {("a", "b", 0, "x"): 3, ("a", "b", 0, "x", "y"): 3},
        ),
    ],
)
def test_keys_are_found_where_they_stand(text: str, lines: dict[Path, int]) -> None:
    tomllib.loads(text)  # it is TOML
    assert locate(text) == lines


@pytest.mark.slow
@given(documents())
def test_everything_that_tomllib_reads_is_found_where_it_stands_and_nothing_else(text: str) -> None:
    lines = locate(text)
    there = dict(paths(tomllib.loads(text)))
    assert lines.keys() == there.keys()
    for path, value in there.items():
        # The strategy's whole numbers are all different, and stand nowhere else in the text.
        if isinstance(value, int) and not isinstance(value, bool):
            assert str(value) in text.split("\n")[lines[path] - 1]


def test_what_lies_deeper_than_any_configuration_is_passed_over_quickly() -> None:
    deep = ".".join("a" * 3_000)
    lines = locate(f"{deep} = 1\nb = 2\n[c.{deep}]\nd = 1\n[[e.{deep}]]\n[[e.{deep}]]\nf = 1")
    assert max(map(len, lines)) == 7
    assert (lines["b",], lines["c",], lines["e",]) == (2, 3, 5)


def test_what_is_not_there_stands_where_the_nearest_thing_around_it_does() -> None:
    lines = locate("\n[[bus]]\nname = 1\n")
    assert line_of(lines, ("bus", 0, "name")) == 3
    assert line_of(lines, ("bus", 0, "links", 1, "kind")) == 2
    assert line_of(lines, ("speed",)) is None
    assert line_of(lines, ()) is None
