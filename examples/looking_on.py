"""Look on at a bus: read its feed with nothing but sockets and JSON.

Start a bus in one terminal and this in another, then send something:

    make serve
    python examples/looking_on.py
    sacbus send /tmp/sacbus 10m400

It finds the feeds of all buses that you run, takes the first that answers, and prints who said
what, and when, until the bus ends or, with a number as its argument, until that many transmissions
have been seen. The status is 0 then, and 1 when no bus runs. The lines are described in
docs/feed.md.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any


def feeds() -> list[Path]:
    """The sockets of the user's buses; those of killed runs refuse connections."""
    user = os.getuid()
    places = (
        os.environ.get("XDG_RUNTIME_DIR") or f"/run/user/{user}",
        f"{tempfile.gettempdir()}/runtime-{user}",  # where sacbus puts it without the first
    )
    return sorted(feed for place in places for feed in Path(place, "sacbus").glob("*.feed"))


def lines(feed: socket.socket) -> Iterator[dict[str, Any]]:
    """The feed's lines; what is new to us is the reader's to let pass."""
    with feed.makefile(encoding="utf-8") as text:
        for line in text:
            yield json.loads(line)


def first_feed() -> socket.socket | None:
    """A connection to the first bus that is alive."""
    for path in feeds():
        feed = socket.socket(socket.AF_UNIX)
        try:
            feed.connect(str(path))
        except OSError:
            feed.close()
        else:
            return feed
    return None


def main(arguments: Sequence[str]) -> int:
    """Print what is said; the status is as described above."""
    wanted = int(arguments[0]) if arguments else None
    feed = first_feed()
    if feed is None:
        print("no bus runs here", file=sys.stderr)
        return 1
    seen = 0
    with feed:
        for line in lines(feed):
            if line["event"] == "hello":
                print(f"bus {line['bus']}, {line['protocol']} at {line['baud']} baud", flush=True)
            elif line["event"] == "transmission":
                seconds = line["start_ns"] / 1e9
                mark = "!" if line["collided"] else " "
                print(f"{seconds:.6f} {mark} {line['sender']}: {line['data']}", flush=True)
                seen += 1
            if seen == wanted:
                break
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
