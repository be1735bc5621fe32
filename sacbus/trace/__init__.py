"""Recordings: what happened on buses, kept in a file and read back.

``Recorder`` writes one (``recorder.py``), ``read`` gives it back (``reading.py``) as records
(``records.py``) and as the track of each node (``track.py``).
"""

from sacbus.trace.reading import Recording, RecordingError, read
from sacbus.trace.recorder import Recorder
from sacbus.trace.track import Track

__all__ = ["Recorder", "Recording", "RecordingError", "Track", "read"]
