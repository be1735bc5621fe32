"""sacbus: virtual SAC motion controllers and their mother on an RS485 bus.

Owns the version and the two public names, which load what they need on first use: importing
`sacbus`, or a core room such as `sacbus.wire`, drags in neither asyncio nor numpy.
"""

from __future__ import annotations

from importlib import import_module

# As type checkers know it. `typing` itself takes 10 ms, in which a command cannot be interrupted
# without a traceback (`__main__.py`).
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Final

    from sacbus.daemon import open_bus
    from sacbus.mother import Mother

__all__ = ["Mother", "__version__", "open_bus"]

__version__ = "0.1.0"

# By name, not by import statement, so that the arrows of the rooms stay what they are.
_HOMES: Final = {"Mother": "sacbus.mother", "open_bus": "sacbus.daemon"}


def __getattr__(name: str) -> Any:  # noqa: ANN401 (PEP 562: a module's attribute may be anything)
    """A public name, from the room that owns it; kept, so that this runs once a name."""
    home = _HOMES.get(name)
    if home is None:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    value = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
