"""Steps and rules to be had at random."""

from __future__ import annotations

from hypothesis import strategies as st

from sacbus.simad import Timing
from tests.simad.reference import Due

#: Gaps that make steps fall together, wait for one another, or not.
gaps = st.one_of(
    st.just(0), st.just(0), st.integers(0, 600), st.integers(0, 6_000), st.integers(0, 60_000)
)


@st.composite
def streams(draw: st.DrawFn, most: int = 60) -> list[Due]:
    """Steps of up to five axes in the order of time, several of one axis at an instant too."""
    axes = draw(st.integers(1, 5))
    steps = draw(
        st.lists(st.tuples(gaps, st.integers(0, axes - 1), st.sampled_from((1, -1))), max_size=most)
    )
    now = draw(st.integers(0, 10_000))
    found = []
    for gap, axis, way in steps:
        now += gap
        found.append((now, axis, way))
    return found


def timings() -> st.SearchStrategy[Timing]:
    """Gecko's rules, and others: with a period longer than a turn of DIR, and shorter."""
    ns = st.integers(1, 9_000)
    return st.one_of(
        st.just(Timing()),
        st.builds(Timing, low=ns, high=ns, setup=ns, hold=st.integers(0, 9_000)),
        st.builds(
            Timing,
            low=st.integers(1, 50),
            high=st.integers(2_000, 40_000),
            setup=st.integers(1, 50),
            hold=st.integers(0, 50),
        ),
    )
