"""A third party's package for the tests: as far as its masters are found by entry points."""

from __future__ import annotations

from pathlib import Path

__all__ = ["install"]


def install(site: Path, *masters: str) -> None:
    """Make ``site`` a place with a package whose entry points of ``sacbus.masters`` these are."""
    about = site / "smoke-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: smoke\nVersion: 1.0\n")
    points = "\n".join(("[sacbus.masters]", *masters, ""))
    (about / "entry_points.txt").write_text(points)
