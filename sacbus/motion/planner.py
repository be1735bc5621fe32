"""From a command to its profile.

Owns the order in which the rules apply; shares.py counts, layout.py chooses ramps. `plan` is on
the path of every command of every node: the usual one is looked up and not laid out.
Source: manual, "Profile Planning", "Profiles"; spec, "Profile".
"""

from typing import Final

from sacbus.language import Motion
from sacbus.motion.drive import Drive, Rpm, has_ramp
from sacbus.motion.harmonic import harmonic
from sacbus.motion.profile import Profile
from sacbus.motion.shares import Shares, harmonic_steps, linear_steps, truncate

_REMEMBERED: Final = 4096
"""Pairs of ramps kept a drive; beyond it all are forgotten, which costs a microsecond each."""


def plan(motion: Motion, drive: Drive, start_rpm: Rpm = 0) -> Profile:
    """The profile of a command from its start velocity.

    start_rpm: RPM kept from the command before, 0 = from rest. The start wait and sync are the
    node's: tick 0 is the first pulse. ValueError for negative steps.
    """
    steps = motion.steps
    known = None
    key = (motion.rpm, motion.acc100, motion.dec100, motion.linear, start_rpm)
    if not (steps is None or motion.pulses):
        known = drive.whole_ramps.get(key)
        if known is not None:
            n_acc, n_dec, ramps = known
            cruise = steps - n_acc - n_dec
            if cruise >= 0:
                extra, m = motion.extra_pulses, drive.m
                shares = Shares(
                    n_acc, cruise, n_dec, extra, m, accelerates=n_acc > 0, truncated=False
                )
                duration = ramps + (cruise * m + extra) * drive.cruise_period(motion.cycle_us)
                kept = 0 if has_ramp(motion.dec100) else motion.rpm
                return Profile(motion, drive, start_rpm, shares, duration, kept)
    shares = share_out(motion, drive, start_rpm)
    ends_at_speed = motion.steps is not None and not has_ramp(motion.dec100)
    kept = motion.rpm if ends_at_speed else 0
    profile = None
    if not (motion.linear or shares.cruise is None or drive.auto_micro):
        duration = _harmonic_duration(motion, drive, start_rpm, shares)
        if duration >= 0:
            profile = Profile(motion, drive, start_rpm, shares, duration, kept)
    if profile is None:
        profile = Profile.laid_out(motion, drive, start_rpm, shares, kept)
    if known is None and profile.duration is not None:
        _remember(key, drive, shares, profile.duration, motion)
    return profile


def share_out(motion: Motion, drive: Drive, start_rpm: Rpm) -> Shares:
    """The steps of a command shared out between acceleration, cruise and deceleration."""
    rpm, m, slow = motion.rpm, drive.m, drive.slow
    # A ramp is made of full steps, whatever the command counts in.
    scale, unit = (m, 1) if motion.pulses else (1, m)
    n_acc = n_dec = 0
    if rpm > slow:
        acc100, dec100 = motion.acc100, motion.dec100
        if motion.linear:
            v0 = max(start_rpm, slow) if start_rpm else 0
            n_acc = linear_steps(v0, rpm, acc100, drive.steps_per_rev) * scale
            n_dec = linear_steps(0, rpm, dec100, drive.steps_per_rev) * scale
        else:
            v0 = max(start_rpm, slow)
            n_acc = harmonic_steps(v0, rpm, acc100) * scale
            n_dec = harmonic_steps(slow, rpm, dec100) * scale
    steps = motion.steps
    if steps is None:
        return Shares(n_acc, None, 0, 0, unit, accelerates=n_acc > 0, truncated=False)
    if steps < 0:
        raise ValueError(f"a command has no negative number of steps, got {steps}")
    n_cruise = steps - n_acc - n_dec
    if n_cruise >= 0:
        return Shares(
            n_acc,
            n_cruise,
            n_dec,
            motion.extra_pulses,
            unit,
            accelerates=n_acc > 0,
            truncated=False,
        )
    kept_acc, kept_dec = truncate(n_acc, n_dec, steps)
    return Shares(kept_acc, 0, kept_dec, 0, unit, accelerates=n_acc > 0, truncated=True)


def _remember(
    key: tuple[int, int, int, bool, Rpm],
    drive: Drive,
    shares: Shares,
    duration: int,
    motion: Motion,
) -> None:
    """Keep what both whole ramps take: the next command of these speeds differs in its cruise."""
    if shares.truncated or motion.pulses or drive.auto_micro:
        return
    cruised = (shares.cruise_pulses or 0) * drive.cruise_period(motion.cycle_us)
    if len(drive.whole_ramps) >= _REMEMBERED:
        drive.whole_ramps.clear()
    drive.whole_ramps[key] = (shares.acc, shares.dec, duration - cruised)


def _harmonic_duration(motion: Motion, drive: Drive, start_rpm: Rpm, shares: Shares) -> int:
    """Ticks of a finite harmonic command, looked up; -1 when only its legs can tell.

    That is where truncation makes deceleration begin with an even stretch (`layout.decelerate`).
    """
    n_acc, cruise, n_dec, extra, unit, accelerates, is_truncated = shares
    rate, offset, slow_speed = drive.rate, drive.offset, drive.slow_speed
    duration = 0
    # With no ramp before it, deceleration starts from V; unless truncation took the whole ramp.
    last_speed = -1 if accelerates else drive.speed(motion.rpm)
    if n_acc:
        n_acc *= unit
        start = drive.speed(start_rpm) if start_rpm > drive.slow else slow_speed
        slope = motion.acc100 if motion.rpm >= start_rpm else -motion.acc100
        last_speed = start + slope * (n_acc - 1)
        ramp = harmonic(rate, start, slope, offset)
        sums = ramp.sums
        duration = sums[n_acc] if n_acc < len(sums) else ramp.time(n_acc)
    if n_dec:
        n_dec *= unit
        if is_truncated and slow_speed + motion.dec100 * (n_dec - 1) > last_speed:
            return -1
        ramp = harmonic(rate, slow_speed, motion.dec100, offset)
        sums = ramp.sums
        duration += sums[n_dec] if n_dec < len(sums) else ramp.time(n_dec)
    if cruise or extra:
        duration += ((cruise or 0) * unit + extra) * drive.cruise_period(motion.cycle_us)
    return duration
