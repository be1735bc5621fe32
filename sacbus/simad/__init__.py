"""SiMAD: N step and direction axes on N + 1 lines, after Doug Fortune's announcement.

``encode`` gives the edges of the lines that make steps (``encoder.py``), ``decode`` the steps that
edges make (``decoder.py``); ``Encoder`` and ``Decoder`` do it as they come. Arrays in, arrays out:
steps are ``Steps`` (``steps.py``), edges are ``Edges`` (``edges.py``), times whole ns. What the
lines must keep to is a ``Timing`` (``timing.py``). In files they are VCD (``dump.py``), steps also
CSV and npy (``step_files.py``). Where the announcement contradicts itself, and how it is read
here: docs/simad.md.
"""

from __future__ import annotations

from sacbus.simad.decoder import Decoder, decode
from sacbus.simad.edges import Edges
from sacbus.simad.encoder import MAX_DELAY, Encoded, Encoder, Encoding, encode
from sacbus.simad.fault import DelayTooLong, SimadError
from sacbus.simad.report import AxisReport, Report
from sacbus.simad.steps import Steps, merge
from sacbus.simad.timing import GECKO, Timing, highest_rate

__all__ = [
    "GECKO",
    "MAX_DELAY",
    "AxisReport",
    "Decoder",
    "DelayTooLong",
    "Edges",
    "Encoded",
    "Encoder",
    "Encoding",
    "Report",
    "SimadError",
    "Steps",
    "Timing",
    "decode",
    "encode",
    "highest_rate",
    "merge",
]
