"""The recording of a scenario while it is played: written on, and read by expectations of motion.

Owns the file that both share. Reading begins at its beginning each time, so what is asked of the
motion costs more the later it is asked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import BinaryIO

from sacbus.hosted import HostedBus
from sacbus.trace import Recorder, Recording, RecordingCutOff, Track, read

__all__ = ["Tape"]


class Tape:
    """Records buses into ``file``, which is open for reading and writing, until it is closed.

    ``cut_off``: as :class:`~sacbus.trace.Recorder` has it. Once it has been cut off, whatever is
    asked of it raises that.
    """

    def __init__(
        self,
        buses: Sequence[HostedBus],
        file: BinaryIO,
        cut_off: Callable[[RecordingCutOff], object] | None = None,
    ) -> None:
        self.recorder = Recorder(buses, file, cut_off=cut_off)
        self._numbers = {bus.configuration.name: number for number, bus in enumerate(buses)}
        self._file = file

    def number(self, bus: str) -> int:
        """The number of a bus in the recording."""
        return self._numbers[bus]

    def failed(self, expected: str, got: str, step: str, bus: str) -> None:
        """Remark, now, what came instead of what was expected; ``step``: its name, if any."""
        details = {"step": step} if step else {}
        self.recorder.mark(f"expected {expected}, got {got}", bus=self.number(bus), **details)

    def tracks(self, bus: str) -> Mapping[int, Track]:
        """Where the nodes of a bus have been until now, by their configured addresses."""
        self.recorder.flush()
        self._refuse_half()
        wanted = self._numbers[bus]
        tracks = read(self._file).tracks
        self._file.seek(0, os.SEEK_END)
        return {address: track for (number, address), track in tracks.items() if number == wanted}

    def close(self) -> Recording:
        """End the recording and give it."""
        self.recorder.close()
        self._refuse_half()
        return read(self._file)

    def _refuse_half(self) -> None:
        if self.recorder.fault is not None:
            raise self.recorder.fault
