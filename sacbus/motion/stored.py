"""A profile as JSON has it, and back, exactly.

Owns the stored form of legs and of what they are made from. What is stored is where each pulse
comes from, not the command alone: a recording stays true when the planner is changed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, Final

from sacbus.language import Motion
from sacbus.motion.drive import Drive
from sacbus.motion.harmonic import HarmonicLaw, harmonic
from sacbus.motion.legs import Back, Even, Forth, Leg, State
from sacbus.motion.linear import LinearLaw, linear
from sacbus.motion.profile import Profile
from sacbus.motion.ramp import Ramp

__all__ = ["profile_from", "store_profile"]

#: What is stored of each; how a motion was said is not: two that differ in that are equal.
_MOTION: Final = tuple(one.name for one in fields(Motion) if one.compare)
_DRIVE: Final = tuple(one.name for one in fields(Drive) if one.init)

#: What JSON gives for an object; ``Any``: whatever stands in it, which is checked as it is used.
Stored = Mapping[str, Any]


def store_profile(profile: Profile) -> dict[str, object]:
    """Everything that tells a profile's pulses; what planned it is left out."""
    motion, drive = profile.motion, profile.drive
    return {
        "motion": {name: getattr(motion, name) for name in _MOTION},
        "drive": {name: getattr(drive, name) for name in _DRIVE},
        "duration": profile.duration,
        "legs": [_store(leg) for leg in profile.course.legs],
    }


def profile_from(stored: Stored) -> Profile:
    """The profile that was stored; KeyError, TypeError or ValueError for what is none."""
    drive = dict(stored["drive"])
    drive["pull_out"] = tuple((rpm, most) for rpm, most in drive["pull_out"])
    return Profile.of_legs(
        Motion(**stored["motion"]), Drive(**drive), _legs(stored["legs"]), stored["duration"]
    )


def _store(leg: Leg) -> dict[str, object]:
    match leg:
        case Even(state, count, period, speed, weight):
            return {
                "leg": "even",
                "state": state.value,
                "count": count,
                "period": period,
                "speed": speed,
                "weight": weight,
            }
        case Forth(state, ramp, begin, count, weight):
            place = {"leg": "forth", "state": state.value, "begin": begin}
        case Back(state, ramp, end, count, weight):
            place = {"leg": "back", "state": state.value, "end": end}
        case _:
            raise TypeError(f"not a leg of a profile: {leg!r}")
    return {**place, "count": count, "weight": weight, "ramp": _store_ramp(ramp)}


def _store_ramp(ramp: Ramp) -> dict[str, object]:
    match ramp.law:
        case HarmonicLaw() as law:
            return {
                "law": "harmonic",
                "rate": law.rate,
                "start": law.start,
                "slope": law.slope,
                "offset": ramp.offset,
            }
        case LinearLaw() as law:
            return {
                "law": "linear",
                "pulses_per_rev": law.pulses_per_rev,
                "acc100": law.acc100,
                "rate": law.rate,
                "offset": ramp.offset,
            }
        case law:
            raise TypeError(f"not a law of a ramp: {law!r}")


def _legs(stored: Iterable[Stored]) -> list[Leg]:
    return [_leg(one) for one in stored]


def _leg(stored: Stored) -> Leg:
    state = State(stored["state"])
    count, weight = stored["count"], stored["weight"]
    match stored["leg"]:
        case "even":
            return Even(state, count, stored["period"], stored["speed"], weight)
        case "forth":
            return Forth(state, _ramp(stored["ramp"]), stored["begin"], count, weight)
        case "back":
            return Back(state, _ramp(stored["ramp"]), stored["end"], count, weight)
        case other:
            raise ValueError(f"expected a leg that is even, forth or back, got {other!r}")


def _ramp(stored: Stored) -> Ramp:
    figures = {name: value for name, value in stored.items() if name != "law"}
    match stored["law"]:
        case "harmonic":
            return harmonic(**figures)
        case "linear":
            return linear(**figures)
        case other:
            raise ValueError(f"expected a ramp that is harmonic or linear, got {other!r}")
