"""How a SAC starts: cold, when power comes, and warm, at ``$R``.

Owns the second after power came, in which the network is not heard and any key restores the
factory's memory, and what the terminal shows meanwhile. What a boot sets up is the node's business.

    power comes -> version line -> 1 s: a key, or RST that is low, restores -> prompt -> autorun
    $R -> prompt -> autorun

Source: manual, "Miscellaneous" (the bail-out option), "network" (RST), "Autorun"; spec, "Version
line and prompt".
"""

from __future__ import annotations

from typing import Final

from sacbus.kernel import SECOND, Ns

__all__ = ["LISTENS", "NO_POWER", "VERSION_LINE", "Start"]

#: How long a key restores the factory's memory (manual: "approximately a one second delay").
LISTENS: Final[Ns] = SECOND

#: The manual mentions it and shows none (decision). It is the emulated firmware's, not ours.
VERSION_LINE: Final = "SAC v1.0"


class Start:
    """What keeps a node from obeying: a boot, until it is ``over``, or (None) that power is off.

    A cold one ``listens``: a key restores the factory's memory.
    """

    __slots__ = ("listens", "over", "restores")

    def __init__(self, over: Ns | None, *, listens: bool = False) -> None:
        self.over = over
        self.listens = listens
        #: Whether it ends with the factory's memory.
        self.restores = False

    def key(self) -> bool:
        """A key has come on the terminal; False when it is an ordinary one."""
        if self.listens:
            self.restores = True
        return self.listens or self.over is None


#: Nothing starts, and keys come to nobody. One for all nodes, since nothing in it changes.
NO_POWER: Final = Start(None)
