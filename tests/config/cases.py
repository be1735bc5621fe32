"""Configurations with all that is said of each: the texts beside this file, and how they are asked.

Cases are parted by "----"; what is said stands in lines after "! ", with "line" for the file's name
and "-" where there is no line.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.config import ConfigError, examine, read

__all__ = ["cases", "mistakes"]

Case = tuple[str, list[str]]


def cases(name: str) -> list[Case]:
    """The configurations of a file, each with what is said of it."""
    found: list[Case] = []
    for case in Path(__file__).with_name(name).read_text().split("----\n")[1:]:
        text, *told = case.removesuffix("\n").split("\n! ")
        found.append((text, told))
    return found


def mistakes(file: Path, text: str) -> list[str]:
    """What is said of a text as a file; whoever reads it is told the same."""
    file.write_text(text, newline="")
    examined = examine(file)
    if examined.mistakes:
        with pytest.raises(ConfigError) as wrong:
            read(file)
        assert wrong.value.mistakes == examined.mistakes
        assert str(wrong.value).splitlines() == [str(one) for one in examined.mistakes]
    else:
        assert read(file) == examined.setup
    told = [str(one).replace(f"{file}:", "line ") for one in examined.mistakes]
    return [one.replace(str(file), "-") for one in told]
