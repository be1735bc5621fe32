"""What may come over a line: packets, pieces of packets, and bytes that are meant to hurt."""

from __future__ import annotations

from hypothesis import strategies as st

from sacbus.kernel import MS, Ns
from sacbus.wire import encode
from tests.nodes.sac.bench import NODE

__all__ = ["ADDRESSES", "bursts", "lines", "traffic"]

ADDRESSES = (NODE, 10, 11)

#: Bytes that mean something to a receiver, far oftener than chance would bring them.
_MEANT = st.sampled_from(
    bytes((2, 2, 3, 3, 0, 6, 21, 17, 18, *ADDRESSES, 1, *b"mMvVaAdDsSnNy+-/0125."))
)

#: Lines as people, programs and accidents make them.
lines = st.one_of(
    st.sampled_from(
        (
            "m200v100a1d1",
            "m-300v300a5d999",
            "m",
            "mv50",
            "m400s",
            "m100t2000",
            "m20u5p",
            "m50l1a20d20",
            "v200",
            "vc700",
            "v",
            "a2",
            "d",
            "S",
            "s",
            "N",
            "n",
            "y",
            "+++",
            "--",
            " hello",
            "/m20",
            "10m50",
            "0s",
            "\x11",
            "\x12",
            "",
            "m132",
            "m349",
            "m13",
            "$R",
            "q",
            "m99999999999",
        )
    ).map(str.encode),
    st.binary(max_size=50),
    st.lists(_MEANT, max_size=50).map(bytes),
)

_packets = st.builds(
    lambda dest, src, line, crc: encode(dest, src, line, crc=crc),
    st.sampled_from((*ADDRESSES, 0, 1, 200)),
    st.sampled_from((0, 1, 5, *ADDRESSES)),
    lines,
    st.booleans(),
)

bursts = st.lists(
    st.one_of(
        _packets, st.binary(min_size=1, max_size=20), st.lists(_MEANT, min_size=1).map(bytes)
    ),
    min_size=1,
    max_size=4,
).map(b"".join)
"""What is sent in one go; not empty."""

#: Pauses: none at all, those in which answers and deaf times lie, and long ones.
_PAUSES = st.one_of(st.just(0), st.integers(0, 3 * MS), st.integers(0, 500 * MS))


def traffic(max_size: int = 8) -> st.SearchStrategy[list[tuple[Ns, bytes]]]:
    """Bursts, each with the pause before it."""
    return st.lists(st.tuples(_PAUSES, bursts), min_size=1, max_size=max_size)
