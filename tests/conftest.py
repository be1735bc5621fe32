"""What every test is held to: nothing left behind, and Hypothesis without a stopwatch."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# Durations are no property of the code on a machine that is shared: no deadline anywhere.
settings.register_profile("dev", deadline=None)
settings.register_profile(
    "ci", deadline=None, max_examples=400, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("dev")

# Under nohup, or in the background of a shell, the tests' own processes would inherit that hanging
# up, or Ctrl-C, is ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

_DESCRIPTORS = Path("/proc/self/fd")


def open_descriptors() -> dict[str, str]:
    """Descriptor to what it is open on; empty where the system does not tell.

    Without fonts: matplotlib keeps each open for the life of the process from the first picture
    on that wants it, whichever test happens to draw that.
    """
    found = {}
    if _DESCRIPTORS.is_dir():
        for entry in _DESCRIPTORS.iterdir():
            try:
                target = entry.readlink()
            except FileNotFoundError:  # the directory's own descriptor, closed by now
                continue
            if target.suffix != ".ttf":
                found[entry.name] = str(target)
    return found


@pytest.fixture(scope="session", autouse=True)
def _state_of_its_own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No test, nor a process of one, keeps or finds anything in the state directory of a person."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(autouse=True)
def _no_descriptor_left_behind() -> Iterator[None]:
    before = open_descriptors()
    yield
    after = open_descriptors()
    if len(after) > len(before):
        gc.collect()  # what only a reference cycle held is garbage, not a leak
        after = open_descriptors()
    left = {number: target for number, target in after.items() if number not in before}
    assert len(after) <= len(before), f"descriptors left open: {left}"
