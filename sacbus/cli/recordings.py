"""What the commands about recordings have in common."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from io import TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, TextIO

import click

from sacbus.cli.options import STANDARD, WrongInput
from sacbus.fresh import NO_ROOM, fresh_file
from sacbus.picture_format import PictureError, picture_format

if TYPE_CHECKING:
    from sacbus.trace import Recording

__all__ = [
    "fresh_or_standard",
    "fresh_text",
    "note_cut_off",
    "opened",
    "picture_form",
    "refuse_missing_directories",
    "refuse_shared_files",
    "span",
]


def span(_ctx: click.Context, _param: click.Parameter, given: str) -> int:
    """A length of time as ns: ``10ms``, ``1.5 us``; 0 is one without a unit too."""
    if given == "0":
        return 0
    from sacbus.bus.duration import DurationError, duration

    try:
        return duration(given)
    except DurationError as wrong:
        raise click.BadParameter(f"expected {wrong.expected}, got {given!r}") from wrong


def opened(path: str) -> Recording:
    """A recording; what is none is refused in one line, status 2."""
    from sacbus.trace import RecordingError, read

    try:
        return read(path)
    except RecordingError as fault:
        raise WrongInput(str(fault)) from fault
    except OSError as fault:
        raise WrongInput(f"{path}: {fault.strerror}, name a recording") from fault


def note_cut_off(recording: Recording) -> None:
    """Say that what was read is not all that happened; only a walk to its end finds that out."""
    if not recording.whole:
        seconds = f"{recording.end / 1e9:.6f} s"
        click.echo(f"note: {recording.name} was cut off at {seconds}: it was not closed", err=True)


def refuse_shared_files(outputs: Mapping[str, str | Path | None], inputs: Iterable[str]) -> None:
    """Refuse an output that is an input or another output, before one destroys the other.

    ``outputs``: by option. A device or a pipe holds nothing that could be lost: it may be shared.
    Standard output is no file here: what is printed goes there.
    """
    taken = [(Path(one), "which is read") for one in inputs]
    for option, place in outputs.items():
        if place is None:
            continue
        path = Path(place)
        if str(place) == STANDARD:
            raise click.UsageError(f"{option}: expected a file, got -, where its results are told")
        if path.exists() and not path.is_file():
            continue
        for other, why in taken:
            if _is_same(path, other):
                raise click.UsageError(f"{option}: expected a file of its own, got {place}, {why}")
        taken.append((path, f"which is that of {option}"))


def _is_same(path: Path, other: Path) -> bool:
    """Whether two names are of one file, which need not exist yet."""
    if path.exists() and other.exists():
        return path.samefile(other)  # hard links too
    return path.resolve() == other.resolve()


def refuse_missing_directories(outputs: Mapping[str, str | Path | None]) -> None:
    """Refuse outputs that no file can be made for, before what is to be kept takes its time."""
    for option, place in outputs.items():
        if place is None:
            continue
        directory = Path(place).parent
        if not directory.is_dir():
            what = "is not a directory" if directory.exists() else "does not exist"
            raise WrongInput(f"{option}: cannot write {place}, {directory} {what}")


@contextmanager
def fresh_or_standard(path: Path) -> Iterator[BinaryIO]:
    """A :func:`fresh_file`, or standard output for ``-``."""
    if str(path) != STANDARD:
        with fresh_file(path) as file:
            yield file
        return
    sys.stdout.flush()
    try:
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
    except OSError as fault:
        if fault.errno not in NO_ROOM:
            raise
        raise OSError(
            f"standard output: {fault.strerror}, what was written is not whole, make room there"
        ) from fault


@contextmanager
def fresh_text(path: Path) -> Iterator[TextIO]:
    """A :func:`fresh_or_standard` for text, whose line ends are left as they are."""
    with fresh_or_standard(path) as file:
        text = TextIOWrapper(file, encoding="utf-8", newline="")
        try:
            yield text
        finally:
            text.detach()  # what is written goes to the file, which is not this one's to close


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
