"""A line of RS274 taken apart: words, comments, and the character that is neither.

Owns the form of lines: a word is a letter and a number, blanks mean nothing wherever they stand,
even within a number, and letters are of either case. Knows nothing of what words mean. Columns
count from 1.
Source: RS274/NGC interpreter, version 3 (NISTIR 6556), "Format of a Line". Decisions: docs,
"The words of G-code".

The libraries that can be had were tried against the cases of ``tests/gcode/test_words.py``, and
none passed. gcodeparser 0.3.0: loses lines that have no G word, what follows a comment and
``X 1 0``; reads G28.1 as G28 and ``X[1+2]`` as true. GcodeTools 0.3.2: takes ``G1X1`` for one word,
loses lines without G. nc-gcode-interpreter 0.1.9 (Sinumerik): refuses lower case, comments in
parentheses, ``%`` and ``/``; loses the G of ``G28.1`` and ``G1X1``, and I and J. pygcode is GPL.
None tells a column.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

__all__ = ["Flaw", "Uncommented", "Word", "column_of", "flaw_at", "split_words", "uncommented"]

Word = tuple[str, str]
"""A letter, upper case, and its number as it stands there without blanks."""

DIGITS: Final = 9
"""Digits before the point. So no sum of figures leaves the range in which floats are exact to a
thousandth of a step (decision); line numbers and speeds have fewer."""

_NUMBER = rf"[+-]?(?:[0-9]{{1,{DIGITS}}}(?:\.[0-9]*)?|\.[0-9]+)"
_WORD: Final = re.compile(rf"([A-Z])({_NUMBER})")
_WORDS: Final = re.compile(rf"(?:[A-Z]{_NUMBER})*")
_BEGUN: Final = re.compile(r"[A-Z][+-]?(.?)", re.DOTALL)
_LONG: Final = re.compile(rf"[A-Z][+-]?[0-9]{{{DIGITS}}}$")
_MESSAGE: Final = re.compile(r"\s*M\s*S\s*G\s*,(.*)", re.IGNORECASE | re.DOTALL)


class Flaw(NamedTuple):
    """What is wrong with the form of a line; ``at`` is where, a column or a place in a body."""

    at: int
    shown: str
    what: str
    remedy: str


class Uncommented(NamedTuple):
    """A line's ``body``, upper case and without blanks and comments, and what comments tell.

    messages: the texts of ``(MSG,...)`` in their order. flaws: of comments, by column.
    """

    body: str
    messages: tuple[str, ...] = ()
    flaws: tuple[Flaw, ...] = ()


def uncommented(text: str) -> Uncommented:
    """A line without its comments: parentheses anywhere, and all that follows a semicolon.

    Parentheses do not nest. Never raises: what is wrong is in ``flaws``, and the rest is read.
    """
    if text.isascii() and "(" not in text and ";" not in text:
        return Uncommented("".join(text.upper().split()))
    body: list[str] = []
    messages: list[str] = []
    flaws: list[Flaw] = []
    at = 0
    while at < len(text) and text[at] != ";":
        if text[at] != "(":
            body.append(_folded(text[at]))
            at += 1
            continue
        end = text.find(")", at)
        if end < 0:
            flaws.append(Flaw(at + 1, "(", "a comment that is not closed", "close it with )"))
            end = len(text)
        comment = text[at + 1 : end]
        if "(" in comment:
            inner = at + 2 + comment.index("(")
            flaws.append(Flaw(inner, "(", "a comment within a comment", "take it out"))
        elif (message := _MESSAGE.match(comment)) is not None:
            messages.append(_one_line(message[1]))
        at = end + 1
    return Uncommented("".join(body), tuple(filter(None, messages)), tuple(flaws))


def split_words(body: str) -> tuple[list[Word], int]:
    """The words at the beginning of a body, and where they end: its length if all is well."""
    found = _WORDS.match(body)
    assert found is not None  # no word at all is a match too
    end = found.end()
    return _WORD.findall(body, 0, end), end


def column_of(text: str, place: int) -> int:
    """The column in a line of what is at ``place`` in its body."""
    at = 0
    while at < len(text):
        if text[at] == "(":
            at = text.find(")", at)
            assert at >= 0, "what is not closed reaches to the end: no place is behind it"
        elif _folded(text[at]):
            if place == 0:
                break
            place -= 1
        at += 1
    return at + 1


def flaw_at(body: str, place: int) -> Flaw:
    """Why no word can be read at ``place`` in a body."""
    rest = body[place:]
    letter, number = rest[0], _BEGUN.match(rest)
    after = number[1] if number is not None else ""
    if letter == "O":
        return Flaw(place, _shown(rest), "subprograms are not read", "have them written out")
    if letter == "#" or after == "#":
        return Flaw(place, _shown(rest), "parameters are not read", "write the number itself")
    if letter == "[" or after == "[":
        return Flaw(place, _shown(rest), "expressions are not read", "write the number itself")
    if number is not None:
        what = f"expected a number such as 10, -1.5 or .25, got {_shown(after) or 'none'}"
        return Flaw(place, letter, what, "write one")
    if (long := _LONG.search(body, 0, place)) is not None and letter.isdigit():
        what = f"more than {DIGITS} digits before the point"
        return Flaw(long.start(), _shown(body[long.start() :]), what, "write fewer")
    if letter == ")":
        return Flaw(place, letter, "it closes no comment", "take it out")
    if letter == "/":
        return Flaw(place, letter, "a line is skipped by a / at its beginning", "write it there")
    if letter == "%":
        return Flaw(place, letter, "it stands in a line of its own", "write it there")
    return Flaw(place, _shown(rest[:1]), "no word begins with it", "write a letter and a number")


def _folded(character: str) -> str:
    # Characters outside ASCII stay as they are: some become two in upper case, or are blanks to
    # Python, and columns would be wrong.
    if not character.isascii():
        return character
    return "" if character.isspace() else character.upper()


def _one_line(text: str) -> str:
    """A message for people: nothing in it moves a terminal's cursor."""
    return "".join(one if one.isprintable() else "?" for one in " ".join(text.split()))


def _shown(text: str) -> str:
    """As much of a text as tells where one has to look; one line, whatever is in it."""
    short = text if len(text) <= 12 else f"{text[:12]}..."
    return short if short.isprintable() else ascii(short)
