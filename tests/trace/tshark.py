"""tshark with our dissector, as a Wireshark user runs it."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import pytest

from nodes.sac import KIND

__all__ = ["TSHARK", "listed", "needs_tshark", "tshark"]

TSHARK: Final = shutil.which("tshark")

needs_tshark = pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")


def tshark(*arguments: str | Path) -> str:
    """What it prints; a Lua error, which it tells and goes on, fails the test."""
    assert TSHARK is not None
    ran = subprocess.run(
        [TSHARK, "-X", f"lua_script:{KIND.protocol.dissector}", *arguments],
        capture_output=True,
        check=False,
        timeout=60,
    )
    errors = ran.stderr.decode()
    assert ran.returncode == 0, errors
    assert "Lua" not in errors, errors
    text = ran.stdout.decode()
    assert "Lua Error" not in text, text
    return text


def listed(
    capture: Path, fields: Iterable[str], *, more: Sequence[str] = ()
) -> list[dict[str, str]]:
    """These fields of every frame, empty where it has none; of several, with commas between."""
    names = list(fields)
    asked = [word for name in names for word in ("-e", name)]
    frames = json.loads(tshark("-r", capture, *more, "-T", "json", *asked))
    told = [frame["_source"].get("layers", {}) for frame in frames]
    return [{name: ",".join(frame.get(name, ())) for name in names} for frame in told]
