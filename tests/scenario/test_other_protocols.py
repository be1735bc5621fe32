"""Scenarios on lines that speak something else than SAC: bytes out, what is said and done in."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.scenario.stage import failures, played

HEAD = '[[bus]]\n[[bus.nodes]]\naddresses = "0,3"\nkind = "ss-mst67"\n'


def test_bytes_move_a_module_and_its_answer_is_seen(tmp_path: Path) -> None:
    text = """
        [[step]]
        raw = "19 04 0f a0 00 0a"
        [[step]]
        expect = { answer = "ack", from = 3, within = "20 ms" }
        [[step]]
        expect = { node = 3, position = 10, state = "STANDBY", within = "2 s" }
        [[step]]
        expect = { node = 0, position = 0 }
    """
    assert failures(tmp_path / "a.toml", text, HEAD) == []


def test_what_a_module_has_given_up_is_given_up_by_who_watches(tmp_path: Path) -> None:
    text = """
        [[step]]
        raw = "1f 00"
        [[step]]
        expect = { answer = "nak", from = 3, within = "40 ms" }
        [[step]]
        name = "look"
        wait = "20 ms"
        [[step]]
        after = "look"
        expect = { pattern = "00 06", to = 3, within = "200 ms" }
        [[step]]
        at = "100 ms"
        raw = "1f 00"
        [[step]]
        at = "150 ms"
        raw = "1f 00 06"
    """
    assert failures(tmp_path / "a.toml", text, HEAD) == []


@pytest.mark.parametrize(("raw", "moves"), [("^04 ^18 00 0f a0", True), ("1c 18 00 0f", False)])
def test_ninth_bits_begin_messages(tmp_path: Path, raw: str, *, moves: bool) -> None:
    text = f"""
        [[step]]
        raw = "{raw}"
        [[step]]
        expect = {{ node = 3, velocity = {-150 if moves else 0}, within = "60 ms" }}
    """
    nine = HEAD + 'jmp2 = "closed"\n'
    result = played(tmp_path / "a.toml", text, nine)
    assert result.passed, result.failures
