"""Errors of links: one line, three fields, and the builtin that a caller would expect."""

from __future__ import annotations

from sacbus.links import LinkError, PathTaken


def test_an_error_is_one_line_of_what_where_and_what_to_do() -> None:
    error = LinkError("no such directory", "/x", "create it")
    assert str(error) == "no such directory, /x, create it"
    assert (error.what, error.where, error.remedy) == ("no such directory", "/x", "create it")


def test_a_caller_may_catch_what_python_would_have_raised() -> None:
    assert issubclass(LinkError, OSError)
    assert issubclass(PathTaken, FileExistsError)
    assert issubclass(PathTaken, LinkError)
