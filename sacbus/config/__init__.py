"""Configuration files: TOML to what the daemon hosts, with every mistake told at once.

Owns the keys of a configuration, their checks, and how mistakes read. Hands out values and opens
nothing; the daemon does. The names here load what they need on first use: the command line takes
``sacbus.config.notation`` for its options without waiting for a daemon.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from sacbus.config.mistake import ConfigError, Mistake
    from sacbus.config.reading import Examined, Setup, examine, read

__all__ = ["ConfigError", "Examined", "Mistake", "Setup", "examine", "read"]

_HOMES: Final = {
    "ConfigError": "mistake",
    "Mistake": "mistake",
    "Examined": "reading",
    "Setup": "reading",
    "examine": "reading",
    "read": "reading",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 (PEP 562: a module's attribute may be anything)
    """A public name, from the file that owns it."""
    home = _HOMES.get(name)
    if home is None:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    return getattr(import_module(f"{__name__}.{home}"), name)
