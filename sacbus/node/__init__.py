"""The contract between the bus and a kind of node, and the registry of kinds.

Owns the shapes in which the two meet, a file each: what a node hears, can be asked and tells
(``contract``), what a wire protocol must answer (``protocol``), what a configuration may say of a
node (``settings``), and how kinds are found (``kind``). Time is always an argument, in ns of bus
time. Nothing here knows a particular protocol or kind.
"""

from .contract import (
    BOOT,
    OFF,
    STANDBY,
    Heard,
    MistunedNode,
    Node,
    PinError,
    Pins,
    Report,
    ReportKind,
    Snapshot,
    Terminal,
)
from .kind import (
    GROUP,
    KindError,
    MemoryTable,
    MemoryValue,
    MemoryWords,
    NodeKind,
    PolyglotKind,
    find_kind,
    find_protocol,
    kind_names,
    kinds,
    protocols_of,
    spoken_by,
)
from .protocol import EVERYONE, MASTER, Decoder, Protocol, Said
from .settings import (
    NodeSettings,
    Setting,
    SettingError,
    misfits,
    setting_list,
    settings_from,
)

__all__ = [
    "BOOT",
    "EVERYONE",
    "GROUP",
    "MASTER",
    "OFF",
    "STANDBY",
    "Decoder",
    "Heard",
    "KindError",
    "MemoryTable",
    "MemoryValue",
    "MemoryWords",
    "MistunedNode",
    "Node",
    "NodeKind",
    "NodeSettings",
    "PinError",
    "Pins",
    "PolyglotKind",
    "Protocol",
    "Report",
    "ReportKind",
    "Said",
    "Setting",
    "SettingError",
    "Snapshot",
    "Terminal",
    "find_kind",
    "find_protocol",
    "kind_names",
    "kinds",
    "misfits",
    "protocols_of",
    "setting_list",
    "settings_from",
    "spoken_by",
]
