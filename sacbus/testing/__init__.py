"""Tests of controllers and of motion, on buses in virtual time: what the pytest plugin gives.

Owns the public names, which load their files on first use: the plugin is loaded by every pytest of
an environment, also where nobody has a bus. Nothing here is imported by any other room.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sacbus.testing.bus import VirtualBus
    from sacbus.testing.made import BusMaker, virtual_bus
    from sacbus.testing.node import VirtualNode
    from sacbus.testing.port import VirtualPort

__all__ = ["BusMaker", "VirtualBus", "VirtualNode", "VirtualPort", "virtual_bus"]

# By name, as in ``sacbus/__init__.py``.
_HOMES: Final = {
    "BusMaker": "sacbus.testing.made",
    "VirtualBus": "sacbus.testing.bus",
    "VirtualNode": "sacbus.testing.node",
    "VirtualPort": "sacbus.testing.port",
    "virtual_bus": "sacbus.testing.made",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 (PEP 562: a module's attribute may be anything)
    """A public name, from the file that owns it."""
    home = _HOMES.get(name)
    if home is None:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    value = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
