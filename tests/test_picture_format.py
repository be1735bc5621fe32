"""Which names a picture may have."""

from __future__ import annotations

from pathlib import Path

import pytest

from sacbus.picture_format import PictureError, picture_format


def test_the_ending_tells_the_format() -> None:
    assert picture_format(Path("a.png")) == "png"
    assert picture_format(Path("a.SVG")) == "svg"
    for name in ("a", "a.pdf", "png"):
        with pytest.raises(PictureError, match=r"ends in \.png or \.svg"):
            picture_format(Path(name))
