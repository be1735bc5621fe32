"""Recordings: what happened on buses, kept in a file and read back.

``Recorder`` writes one (``recorder.py``), ``read`` gives it back (``reading.py``) as records
(``records.py``), as the track of each node (``track.py``), and of several as the axes of a path
(``paths.py``). ``write_pcapng`` makes a capture of one (``exchange.py``), for Wireshark; what a
capture is, ``capture.py`` and ``pcapng.py`` know, and the monitor writes them as well. Names load
what they need on first use: it needs no recordings.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sacbus.trace.exchange import write_pcapng
    from sacbus.trace.paths import RESTS, last_path
    from sacbus.trace.reading import Recording, RecordingError, read
    from sacbus.trace.recorder import Recorder, RecordingCutOff
    from sacbus.trace.track import Track

__all__ = [
    "RESTS",
    "Recorder",
    "Recording",
    "RecordingCutOff",
    "RecordingError",
    "Track",
    "last_path",
    "read",
    "write_pcapng",
]

_HOMES: Final = {
    "RESTS": "paths",
    "Recorder": "recorder",
    "Recording": "reading",
    "RecordingCutOff": "recorder",
    "RecordingError": "reading",
    "Track": "track",
    "last_path": "paths",
    "read": "reading",
    "write_pcapng": "exchange",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 (PEP 562: a module's attribute may be anything)
    """A public name, from the file that owns it; kept, so that this runs once a name."""
    home = _HOMES.get(name)
    if home is None:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    value = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = value
    return value
