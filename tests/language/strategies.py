"""Lines and commands for the properties of this room."""

from __future__ import annotations

from typing import Any, Final

from hypothesis import strategies as st

from sacbus.language import (
    BARE,
    Acceleration,
    ClearQueue,
    Command,
    Configure,
    Deceleration,
    Edit,
    EditQueue,
    Empty,
    EndLoop,
    Forward,
    LoopCount,
    LoopFinish,
    LoopQueue,
    LoopStart,
    MapPins,
    Message,
    Mode,
    Move,
    Next,
    Parameter,
    ProgramQueue,
    ProgramReferences,
    Ramp,
    Reboot,
    ReleaseSync,
    RestoreQueue,
    RunPosition,
    RunReferences,
    SaveQueue,
    SendAcks,
    SendCrcs,
    SendSoftOps,
    SetParameter,
    SetReference,
    ShowConfiguration,
    ShowMemory,
    ShowQueue,
    ShowReferences,
    ShowSession,
    ShowVelocity,
    SinglePulses,
    SoftOp,
    StepMode,
    Stop,
    ThrowAway,
    ToggleDebug,
    ToggleEncoder,
    ToggleGap,
    ToggleStepMode,
    Undo,
    Velocity,
)

BITS_32 = 2**32 - 1
DIGITS = tuple("0123456789")

rpms = st.just(BARE) | st.integers(1, BITS_32)
cycles = st.integers(1, BITS_32)
hundredths = st.integers(1, 9999) | st.integers(100, 999).map(lambda n: n * 100)
#: What the number format can say: two decimals below 100, whole numbers above, 999 at most.
ramps = st.just(BARE) | hundredths
latin = st.text(st.characters(max_codepoint=255))
positions = st.integers(1, 30)
loops = st.integers(0, 65_535)

velocities = st.tuples(st.none() | rpms, st.none()) | st.tuples(st.none(), cycles)
# Any: hypothesis takes fields by name, of any type.
qualifiers: Final[dict[str, Any]] = {
    "acc100": st.none() | ramps,
    "dec100": st.none() | ramps,
    "linear": st.none() | st.booleans(),
    "extra_pulses": st.none() | st.integers(0, 255),
    "wait_us": st.none() | st.integers(0, BITS_32),
    "sync": st.none() | st.booleans(),
    "pulses": st.none() | st.booleans(),
}
steps = st.none() | st.integers(0, BITS_32)

moves = st.builds(
    lambda velocity, **fields: Move(rpm=velocity[0], cycle_us=velocity[1], **fields),
    velocity=velocities,
    steps=steps,
    opposite=st.booleans(),
    **qualifiers,
)
edits = st.builds(
    lambda course, velocity, **fields: Edit(
        opposite=course[0], steps=course[1], rpm=velocity[0], cycle_us=velocity[1], **fields
    ),
    course=st.just((None, None)) | st.tuples(st.booleans(), steps),
    velocity=velocities,
    **qualifiers,
)


def values(parameter: Parameter) -> st.SearchStrategy[int]:
    """Values that leave nothing to remark."""
    if parameter.decimal:
        return hundredths
    most = 38_400 if parameter is Parameter.SW else parameter.largest
    least = 4 if parameter is Parameter.D_ID else int(parameter.zero is not None)
    good = st.integers(least, most)
    if parameter is Parameter.HW:
        return good.filter(lambda baud: baud not in (57_600, 115_200, 230_400))
    return good


parameters = st.sampled_from(Parameter).flatmap(
    lambda parameter: st.builds(SetParameter, st.just(parameter), values(parameter))
)

#: Every type of command but what only a mode knows.
BY_TYPE: Final[dict[type[Command], st.SearchStrategy[Command]]] = {
    Move: moves,
    ThrowAway: st.builds(ThrowAway, moves),
    Velocity: st.builds(Velocity, rpms) | st.builds(Velocity, st.none(), cycles),
    ShowVelocity: st.just(ShowVelocity()),
    Acceleration: st.builds(Acceleration, ramps),
    Deceleration: st.builds(Deceleration, ramps),
    Stop: st.builds(Stop, st.booleans()),
    Next: st.builds(Next, st.booleans()),
    ReleaseSync: st.just(ReleaseSync()),
    SinglePulses: st.builds(SinglePulses, st.text("+-", min_size=1)),
    ShowQueue: st.just(ShowQueue()),
    ProgramQueue: st.just(ProgramQueue()),
    EditQueue: st.builds(EditQueue, positions, edits.filter(lambda edit: edit != Edit())),
    SaveQueue: st.just(SaveQueue()),
    RestoreQueue: st.just(RestoreQueue()),
    ClearQueue: st.just(ClearQueue()),
    LoopStart: st.builds(LoopStart, positions),
    LoopFinish: st.builds(LoopFinish, positions),
    LoopCount: st.builds(LoopCount, loops),
    LoopQueue: st.just(LoopQueue()),
    EndLoop: st.just(EndLoop()),
    RunReferences: st.builds(RunReferences, loops),
    RunPosition: st.builds(RunPosition, positions),
    ProgramReferences: st.just(ProgramReferences()),
    SetReference: st.builds(SetReference, st.integers(0, 30), st.integers(0, 30)),
    ShowReferences: st.just(ShowReferences()),
    ToggleGap: st.just(ToggleGap()),
    ToggleDebug: st.just(ToggleDebug()),
    ShowConfiguration: st.just(ShowConfiguration()),
    ShowSession: st.just(ShowSession()),
    Undo: st.just(Undo()),
    Configure: st.just(Configure()),
    SetParameter: parameters,
    MapPins: st.builds(MapPins, st.integers(0, 7), st.integers(0, 7)),
    ShowMemory: st.just(ShowMemory()),
    StepMode: st.builds(StepMode, st.booleans()),
    ToggleStepMode: st.just(ToggleStepMode()),
    SendCrcs: st.builds(SendCrcs, st.booleans()),
    SendAcks: st.builds(SendAcks, st.booleans()),
    Ramp: st.builds(Ramp, st.booleans()),
    ToggleEncoder: st.just(ToggleEncoder()),
    SendSoftOps: st.builds(SendSoftOps, st.booleans()),
    Reboot: st.just(Reboot()),
    SoftOp: st.builds(SoftOp, st.booleans()),
    Empty: st.just(Empty()),
    Message: st.builds(Message, latin.map(lambda text: "." + text))
    | st.builds(Message, latin.map(lambda text: " " + text + "!")),
    Forward: st.builds(Forward, st.none(), latin)
    | st.builds(Forward, st.integers(0, 255), latin.filter(lambda rest: rest[:1] not in DIGITS)),
}
commands: st.SearchStrategy[Command] = st.one_of(*BY_TYPE.values())

modes = st.sampled_from(Mode)

#: Numbers at which something changes, and others; few draws each, since a line has several.
numbers = st.sampled_from(
    [
        *("", "", "0", "1", "00", "007", ".5", "0.", ".", "1.25", "99.99", "100.9", "1.239"),
        *("7", "8", "30", "31", "255", "256", "999", "1000", "999.9", "0.001", "0.004", "1.2.3"),
        *("65535", "65536", "999999999", "4294967295", "4294967296", "0000000000012"),
    ]
) | st.integers(0, 2**34).map(str)
parts = st.lists(
    st.tuples(st.sampled_from([*"vVadADlLutTsSfpF", "vc", "VC", "", "."]), numbers).map("".join),
    max_size=5,
).map("".join)
tails = st.sampled_from(["", "", "", " ", " rest", "x", "\n", "  \n"])
#: Lines that are mostly motion commands and mostly right.
nearly_moves = st.tuples(st.sampled_from(["m", "M", "m-", "M-"]), parts, tails).map("".join)
#: Lines that begin like some other command, of the prompt or of a mode.
nearly_commands = st.tuples(
    st.sampled_from(
        [
            *"qQlLxXcCgGbBzZvVaAdDyYsSnN+-$./",
            *("qs", "QP", "ls", "LF", "ln", "LA", "xm", "xp", "Xd", "xl", "cf", "CC", "$C", "$c"),
            *("$" + letter for letter in "EFHKLOPRUnhz"),
            *("$C" + parameter.letter for parameter in Parameter),
            *(parameter.letter for parameter in Parameter),
            *("$CU", "$CD", "$Cl", "U", ""),
        ]
    ),
    numbers,
    st.sampled_from(["", "", ",", "m", "m-", "M200"]),
    parts,
    tails,
).map("".join)
