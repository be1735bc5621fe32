"""What tests of pictures have in common."""

from __future__ import annotations

import sys

import pytest


def without_matplotlib(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if it were not installed, and nobody in this process had drawn before."""
    loaded = [name for name in sys.modules if name.startswith("matplotlib.")]
    for name in ("matplotlib", *loaded):
        monkeypatch.setitem(sys.modules, name, None)
    for name in (
        "sacbus.drawing",
        "sacbus.plan.picture",
        "sacbus.simad.picture",
        "sacbus.trace.plots",
    ):
        package, _, last = name.rpartition(".")
        monkeypatch.delitem(sys.modules, name, raising=False)
        if package in sys.modules:
            monkeypatch.delattr(sys.modules[package], last, raising=False)
