"""How outside bytes reach the bus and come back. Links move bytes and count them, nothing more.

A link is anything of the shape `Link`. `PtyLink` is a serial port for any program on this machine;
`MemoryLink` ends in the same process, for tests and virtual time.
"""

from .client import Line, open_line
from .errors import LinkError, PathTaken
from .link import Link, LinkCounters
from .memory import MemoryClient, MemoryLink
from .presence import Presence
from .pty import PtyLink
from .tuning import Tuning

__all__ = [
    "Line",
    "Link",
    "LinkCounters",
    "LinkError",
    "MemoryClient",
    "MemoryLink",
    "PathTaken",
    "Presence",
    "PtyLink",
    "Tuning",
    "open_line",
]
