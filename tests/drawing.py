"""What tests of pictures have in common."""

from __future__ import annotations

import io

from matplotlib.figure import Figure


def load_fonts() -> None:
    """Have matplotlib open its fonts; that it keeps them open is no leak of the test that drew."""
    figure = Figure(figsize=(1, 1))
    figure.text(0, 0, "a")
    figure.savefig(io.BytesIO(), format="png")
