"""What can be wrong before any key is looked at: one line, with its place."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sacbus.config.mistake import ConfigError
from sacbus.config.source import MOST_BYTES, load, parse


def refusal(data: bytes) -> str:
    with pytest.raises(ConfigError) as wrong:
        parse(data, "x.toml", Path())
    assert len(wrong.value.mistakes) == 1
    return str(wrong.value)


@pytest.mark.parametrize(
    ("data", "line"),
    [
        (b"a = \n", "not TOML: invalid value, x.toml:1:5, correct it"),
        (b"a = 1\n\n  b\n", None),
        (b"a = 1\r\nb = [1,\r\n  x]\r\n", "not TOML: invalid value, x.toml:3:3, correct it"),
        (b"a = 1\na = 2\n", "not TOML: cannot overwrite a value, x.toml:2:6, correct it"),
        (b'a = "x', "not TOML: unterminated string, x.toml:1:7, correct it"),
        (b'x = 1\na = """\nx\n', "not TOML: unterminated string, x.toml:4:1, correct it"),
        (b"[a\n", None),
        (b"a = 1 b = 2", None),
        (b"a = '\x01'", None),
        (b"a = {b = 1, b = 2}", None),
        (b"a = 2026-02-30", None),
        (
            b"a = 1\nb = '\xe4'\n",
            "expected UTF-8, got the byte 0xe4, x.toml:2:6, save the file as UTF-8",
        ),
        (
            "ä = 'ö".encode() + b"\xff",
            "expected UTF-8, got the byte 0xff, x.toml:1:7, save the file as UTF-8",
        ),
        (
            "a = 1\n".encode("utf-16"),
            "expected UTF-8, got the byte 0xff, x.toml:1:1, save the file as UTF-8",
        ),
        (b"a = " + b"[" * 50_000, "brackets are nested too deeply, x.toml, write it flatter"),
        (b"a = " + b"1" * 5_000, "a number has too many digits, x.toml, write a shorter one"),
        (
            b"#" * (MOST_BYTES + 1),
            (
                "expected a configuration of at most 1048576 bytes, got more, x.toml, "
                "check whether this is the right file"
            ),
        ),
    ],
    ids=range(17),
)
def test_a_text_that_is_no_toml_is_told_with_line_and_column(data: bytes, line: str | None) -> None:
    told = refusal(data)
    if line is None:  # tomllib's words differ between versions
        assert told.startswith("not TOML: ")
        assert ", x.toml:" in told
    else:
        assert told == line


@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"], ids=["plain", "with a mark"])
def test_utf8_is_read_with_and_without_a_byte_order_mark(start: bytes) -> None:
    source = parse(start + "a = 'ä'\n".encode(), "x.toml", Path("/d"))
    assert source.content == {"a": "ä"}
    assert source.lines == {("a",): 1}
    assert source.directory == Path("/d")


@given(st.binary() | st.text("ab=.[]{}\"'\\#, \n\r\t1-:u", max_size=60).map(str.encode))
def test_any_bytes_are_toml_or_one_mistake(data: bytes) -> None:
    said = "nothing"
    try:
        parse(data, "x.toml", Path())
    except ConfigError as wrong:
        said = str(wrong)
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize(
    ("name", "told"),
    [
        (
            "none.toml",
            (
                "cannot read the configuration (No such file or directory), {}, "
                "check the path and its permissions"
            ),
        ),
        (
            ".",
            (
                "cannot read the configuration (Is a directory), {}, "
                "check the path and its permissions"
            ),
        ),
        ("a\0b", None),
        ("a\nb", None),
    ],
)
def test_a_file_that_cannot_be_read_is_told(tmp_path: Path, name: str, told: str | None) -> None:
    path = f"{tmp_path}/{name}"
    with pytest.raises(ConfigError) as wrong:
        load(path)
    assert len(str(wrong.value).splitlines()) == 1
    if told is not None:
        assert str(wrong.value) == told.format(path)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_is_not_ours_to_read_is_told(tmp_path: Path) -> None:
    path = tmp_path / "secret.toml"
    path.touch(mode=0o200)
    with pytest.raises(ConfigError, match=r"\(Permission denied\)"):
        load(path)


def test_relative_paths_begin_at_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "x.toml").write_text("a = 1")
    monkeypatch.chdir(tmp_path)
    assert load("sub/x.toml").directory == tmp_path / "sub"
    assert load("sub/x.toml").name == "sub/x.toml"
