"""Lines and commands for the properties of this room."""

from __future__ import annotations

from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    Acceleration,
    Command,
    Deceleration,
    Empty,
    Forward,
    Message,
    Move,
    Next,
    ReleaseSync,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    Stop,
    Velocity,
)

BITS_32 = 2**32 - 1
DIGITS = tuple("0123456789")

rpms = st.just(BARE) | st.integers(1, BITS_32)
cycles = st.integers(1, BITS_32)
#: What the number format can say: two decimals below 100, whole numbers above, 999 at most.
ramps = st.just(BARE) | st.integers(1, 9999) | st.integers(100, 999).map(lambda n: n * 100)
latin = st.text(st.characters(max_codepoint=255))

moves = st.builds(
    lambda velocity, **fields: Move(rpm=velocity[0], cycle_us=velocity[1], **fields),
    velocity=st.tuples(st.none() | rpms, st.none()) | st.tuples(st.none(), cycles),
    steps=st.none() | st.integers(0, BITS_32),
    opposite=st.booleans(),
    acc100=st.none() | ramps,
    dec100=st.none() | ramps,
    linear=st.none() | st.booleans(),
    extra_pulses=st.none() | st.integers(0, 255),
    wait_us=st.none() | st.integers(0, BITS_32),
    sync=st.none() | st.booleans(),
    pulses=st.none() | st.booleans(),
)

commands: st.SearchStrategy[Command] = st.one_of(
    moves,
    st.builds(Velocity, rpms),
    st.builds(Velocity, st.none(), cycles),
    st.just(ShowVelocity()),
    st.builds(Acceleration, ramps),
    st.builds(Deceleration, ramps),
    st.builds(Stop, st.booleans()),
    st.builds(Next, st.booleans()),
    st.just(ReleaseSync()),
    st.builds(SinglePulses, st.text("+-", min_size=1)),
    st.builds(SoftOp, st.booleans()),
    st.just(Empty()),
    st.builds(Message, latin.map(lambda text: "." + text)),
    st.builds(Message, latin.map(lambda text: " " + text + "!")),
    st.builds(Forward, st.none(), latin),
    st.builds(Forward, st.integers(0, 255), latin.filter(lambda rest: rest[:1] not in DIGITS)),
)

numbers = st.one_of(
    st.just(""),
    st.integers(0, 300).map(str),
    st.integers(0, 2**34).map(str),
    st.decimals(0, 1100, places=3).map(str),
    st.from_regex(r"0{0,12}[0-9]{0,4}\.?[0-9]{0,4}", fullmatch=True),
)
#: Lines that are mostly motion commands and mostly right.
nearly_moves = st.builds(
    lambda head, parts, tail: head + "".join(parts) + tail,
    st.sampled_from(["m", "M", "m-", "M-"]),
    st.lists(
        st.builds(
            str.__add__, st.sampled_from([*"vVadADlLutTsSfpF", "vc", "VC", "", "."]), numbers
        ),
        max_size=6,
    ),
    st.sampled_from(["", "", "", " ", " rest", "x", "\n", "  \n"]),
)
