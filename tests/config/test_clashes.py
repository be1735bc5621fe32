"""What the parts of a configuration have against each other, and what they have not."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.config.cases import cases, mistakes

CASES = cases("clashes.txt")


@pytest.mark.parametrize(("text", "told"), CASES, ids=[" ".join(told)[:60] for _, told in CASES])
def test_clashes_are_told_with_both_places(tmp_path: Path, text: str, told: list[str]) -> None:
    assert mistakes(tmp_path / "x.toml", text) == [one for one in told if one]


@pytest.mark.usefixtures("kiln")
def test_a_bus_has_one_protocol(tmp_path: Path) -> None:
    node = "[[bus.nodes]]\naddress = {}\nkind = '{}'\n"
    first, second = node.format(10, "kiln"), node.format(11, "sac")
    file = tmp_path / "x.toml"
    (told,) = mistakes(file, f"[[bus]]\n{first}{second}{node.format(12, 'kiln')}")
    assert told == (
        "bus 'bus': nodes[1].kind: expected a kind that speaks smoke as line 4 does, got 'sac', "
        "which speaks sac, line 7, put it on another bus"
    )
    (told,) = mistakes(file, f"[[bus]]\nprotocol = 'sac'\n{first}{second}")
    assert told == (
        "bus 'bus': nodes[0].kind: expected a kind that speaks sac as line 2 does, got 'kiln', "
        "which speaks smoke, line 5, put it on another bus"
    )
    assert mistakes(file, f"[[bus]]\n{first}[[bus]]\nname = 'b'\n{second}") == []
