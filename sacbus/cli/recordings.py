"""What the commands about recordings have in common."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from sacbus.cli.options import WrongInput
from sacbus.picture_format import PictureError, picture_format

if TYPE_CHECKING:
    from sacbus.trace import Recording

__all__ = ["opened", "picture_form", "span"]

_UNITS: Final = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000}
_SPAN: Final = re.compile(r"(\d{1,9})(?:\.(\d{1,9}))?\s*(ns|us|ms|s)")


def span(_ctx: click.Context, _param: click.Parameter, given: str) -> int:
    """A length of time as ns: ``10ms``, ``1.5 us``."""
    if given == "0":
        return 0
    found = _SPAN.fullmatch(given.strip())
    if found is None:
        raise click.BadParameter(f"expected a time such as 1us, 10ms or 2s, got {given!r}")
    whole, fraction, unit = found[1], found[2] or "", found[3]
    factor = _UNITS[unit]
    return int(whole) * factor + int(fraction or 0) * factor // int("1" + "0" * len(fraction))


def opened(path: str) -> Recording:
    """A recording; what is none is refused in one line, status 2."""
    from sacbus.trace import RecordingError, read

    try:
        return read(path)
    except RecordingError as fault:
        raise WrongInput(str(fault)) from fault
    except OSError as fault:
        raise WrongInput(f"{path}: {fault.strerror}, name a recording") from fault


def picture_form(place: str | Path) -> str:
    """The format in which ``--plot`` draws, once it is sure that it can; or one line, status 2."""
    try:
        form = picture_format(Path(place))
    except PictureError as fault:
        raise WrongInput(str(fault)) from fault
    try:
        import sacbus.drawing  # noqa: F401 (matplotlib is an extra)
    except ImportError as fault:
        raise WrongInput(
            f"drawing needs matplotlib ({fault}), --plot, "
            "install it: python -m pip install 'sacbus[plot]'"
        ) from fault
    return form
