"""The master's side: transactions, emergency stop and scan, groups, queue files, calibration.

What only needs packets is imported at once. What plans motion stands on numpy, which takes longer
to import than most commands to send: it is fetched from its file on first use.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from sacbus.mother.caller import Caller
from sacbus.mother.clock import Clock
from sacbus.mother.errors import (
    BadRequest,
    LineLost,
    MotherError,
    NoAnswer,
    NotStarted,
    Refused,
    Stopped,
    UnknownOutcome,
)
from sacbus.mother.mother import Mother, addressed_line
from sacbus.mother.outcome import Acknowledged, Sent
from sacbus.mother.queue_file import (
    Difference,
    QueueFile,
    RowRefused,
    differences,
    put_queue,
)
from sacbus.mother.release import Release, Share, stand_down, start_together
from sacbus.mother.request import safe_body
from sacbus.mother.sac_master import SacMaster
from sacbus.mother.scan import ScanProgress
from sacbus.mother.soft_ops import SoftOpHeard
from sacbus.mother.statistics import NodeStatistics
from sacbus.mother.streamed import StreamBroken, Streamed, WrongNode

if TYPE_CHECKING:
    from sacbus.mother.calibration import Calibration, NoSoftOp, Unlikely, calibrate
    from sacbus.mother.group import Group, GroupMotion, GroupRun, Member
    from sacbus.mother.queue_stream import LostTrack, QueueStream
    from sacbus.mother.stream import Stream

__all__ = [
    "Acknowledged",
    "BadRequest",
    "Calibration",
    "Caller",
    "Clock",
    "Difference",
    "Group",
    "GroupMotion",
    "GroupRun",
    "LineLost",
    "LostTrack",
    "Member",
    "Mother",
    "MotherError",
    "NoAnswer",
    "NoSoftOp",
    "NodeStatistics",
    "NotStarted",
    "QueueFile",
    "QueueStream",
    "Refused",
    "Release",
    "RowRefused",
    "SacMaster",
    "ScanProgress",
    "Sent",
    "Share",
    "SoftOpHeard",
    "Stopped",
    "Stream",
    "StreamBroken",
    "Streamed",
    "UnknownOutcome",
    "Unlikely",
    "WrongNode",
    "addressed_line",
    "calibrate",
    "differences",
    "put_queue",
    "safe_body",
    "stand_down",
    "start_together",
]

#: Where the names are that plan motion.
_HOMES: Final = {
    "Calibration": "calibration",
    "Group": "group",
    "GroupMotion": "group",
    "GroupRun": "group",
    "LostTrack": "queue_stream",
    "Member": "group",
    "NoSoftOp": "calibration",
    "Unlikely": "calibration",
    "QueueStream": "queue_stream",
    "Stream": "stream",
    "calibrate": "calibration",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 (PEP 562: a module's attribute may be anything)
    """A name that plans motion, from its file; kept, so that this runs once a name."""
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
