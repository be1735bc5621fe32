"""A kind of node of a third party, for those who read configurations."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def kiln(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An installed kind of a third party, and one that cannot be loaded."""
    about = tmp_path / "kiln-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: kiln\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[sacbus.nodes]\nkiln = kilnkind:KIND\nbroken = nowhere:KIND\n"
    )
    (tmp_path / "kilnkind.py").write_text(
        "from dataclasses import dataclass, field\n"
        "from sacbus.kernel import LineRate\n"
        "from sacbus.node import NodeSettings, SettingError\n"
        "@dataclass(frozen=True)\n"
        "class Settings(NodeSettings):\n"
        "    fuel: str = field(default='gas', metadata={'choices': ('gas', 'wood'), 'help': 'x'})\n"
        "    logs: int = field(default=0, metadata={'low': 0, 'high': 9, 'help': 'x'})\n"
        "    def __post_init__(self):\n"
        "        if self.fuel == 'gas' and self.logs:\n"
        "            raise SettingError('logs: expected 0 with fuel = gas')\n"
        "class Smoke:\n"
        "    name, lanes, rate = 'smoke', 2, LineRate(2400, 11)\n"
        "    addresses = range(4, 256)\n"
        "class Kiln:\n"
        "    name, summary, protocol, settings = 'kiln', 'hot', Smoke(), Settings\n"
        "KIND = Kiln()\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
