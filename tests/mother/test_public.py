"""The public names of mother's room."""

from __future__ import annotations

import subprocess
import sys

import pytest

import sacbus.mother


@pytest.mark.parametrize("name", sacbus.mother.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(sacbus.mother, name).__name__ == name
    assert name in dir(sacbus.mother)


def test_another_name_is_none() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nonsense'"):
        sacbus.mother.nonsense  # noqa: B018 (asking is the test)


@pytest.mark.slow
def test_who_only_sends_does_not_wait_for_numpy() -> None:
    asked = "import sys, sacbus.mother; print('numpy' in sys.modules)"
    ended = subprocess.run([sys.executable, "-c", asked], capture_output=True, check=True)
    assert ended.stdout == b"False\n"
