"""The formats that pictures are drawn in.

Owns what a file's name says of it. Apart from the drawing itself, so that a name that is wrong is
told whether there is anything to draw with or not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from sacbus.plan.entries import PlanError

__all__ = ["picture_format"]

FORMATS: Final = {".png": "png", ".svg": "svg"}


def picture_format(path: Path) -> str:
    """The format that a file's ending asks for; :class:`PlanError` for one that is not drawn."""
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise PlanError(
            f"pictures are drawn as PNG or SVG, {path}, give a name that ends in "
            + " or ".join(FORMATS)
        )
    return form
