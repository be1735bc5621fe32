"""The formats that pictures are drawn in, by the name of a file.

Owns what a name says of it. Apart from the drawing itself (``drawing.py``), so that a name that is
wrong is told whether there is anything to draw with or not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

__all__ = ["PictureError", "picture_format"]

FORMATS: Final = {".png": "png", ".svg": "svg"}


class PictureError(ValueError):
    """Something that cannot be drawn: what, where, what to do."""


def picture_format(path: Path) -> str:
    """The format that a file's ending asks for; :class:`PictureError` for one not drawn."""
    form = FORMATS.get(path.suffix.lower())
    if form is None:
        raise PictureError(
            f"pictures are drawn as PNG or SVG, {path}, give a name that ends in "
            + " or ".join(FORMATS)
        )
    return form
