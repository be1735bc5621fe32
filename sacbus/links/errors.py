"""What can go wrong with a link, as one small tree.

    LinkError (OSError)          the link cannot be had, or is not open
      PathTaken (FileExistsError)  its path belongs to somebody or something else

Bytes that nobody reads, a client that leaves or one that writes garbage are no errors: they are
counted (`LinkCounters`), as on a wire.
"""

from __future__ import annotations

__all__ = ["LinkError", "PathTaken"]


class LinkError(OSError):
    """A link that cannot be had. Its text is one line: what is wrong, where, what to do."""

    what: str
    where: str
    remedy: str

    def __init__(self, what: str, where: str, remedy: str) -> None:
        super().__init__(f"{what}, {where}, {remedy}")
        self.what = what
        self.where = where
        self.remedy = remedy


class PathTaken(LinkError, FileExistsError):
    """The path is served by a live run, or something that is not ours stands there."""
