"""The feed: what happens on the lines of a running daemon, for whoever wants to look on.

For every bus the daemon listens at a unix socket in the user's runtime directory
(:class:`FeedServer`). Who connects there is told, in JSON lines, what the bus is and then all that
is sent on it, with exact times, senders and collisions (``docs/feed.md``). Looking on disturbs
nobody: no link is opened, no byte can be sent, and a slow reader only misses lines.
"""

from sacbus.feed.client import Feed, SeveralBuses, find, running
from sacbus.feed.lines import (
    FORMAT,
    Hello,
    Line,
    Missed,
    Reached,
    Sent,
    Stopped,
    Way,
    decode,
    encode,
)
from sacbus.feed.places import same_link
from sacbus.feed.server import FeedServer

__all__ = [
    "FORMAT",
    "Feed",
    "FeedServer",
    "Hello",
    "Line",
    "Missed",
    "Reached",
    "Sent",
    "SeveralBuses",
    "Stopped",
    "Way",
    "decode",
    "encode",
    "find",
    "running",
    "same_link",
]
