"""How outside bytes reach the bus and come back. Links move bytes and count them, nothing more.

A link is anything of the shape `Link`. `PtyLink` is a serial port for any program on this machine;
`MemoryLink` ends in the same process, for tests and virtual time. Over the network come any number
of programs at once, each with a link of its own: `tcp.TcpServer` and `rfc2217.Rfc2217Server`.
"""

from .client import Line, open_line
from .errors import LinkError, PathTaken
from .link import FormattedLink, Link, LinkCounters, SerialFormat, Server, TellingLink
from .memory import MemoryClient, MemoryLink
from .presence import Presence
from .pty import PtyLink
from .tuning import Tuning

__all__ = [
    "FormattedLink",
    "Line",
    "Link",
    "LinkCounters",
    "LinkError",
    "MemoryClient",
    "MemoryLink",
    "PathTaken",
    "Presence",
    "PtyLink",
    "SerialFormat",
    "Server",
    "TellingLink",
    "Tuning",
    "open_line",
]
