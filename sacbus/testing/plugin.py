"""The pytest plugin: buses in virtual time as fixtures, scenarios as tests, failures that tell.

Owns what pytest asks for: options, the marker, fixtures, reports. It is loaded by every pytest of
its environment, so nothing of sacbus is imported before a test wants it.

How virtual time reaches a test: the clock is a kernel, made for each test that has a bus. A plain
test moves it through its bus. An async one runs in a :class:`~sacbus.host.VirtualLoop` on that very
kernel, which pytest-asyncio is asked for through its hook ``pytest_asyncio_loop_factories`` (1.4
and newer), for these tests alone: all others keep the loop that they have.
"""

from __future__ import annotations

import inspect
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pytest

if TYPE_CHECKING:
    import asyncio

    from sacbus.kernel import Kernel
    from sacbus.mother import Mother
    from sacbus.testing.bus import VirtualBus
    from sacbus.testing.made import BusMaker
    from sacbus.testing.recordings import Recordings

__all__: list[str] = []

#: The fixture that stands for a test's clock; who has it has a bus.
CLOCK: Final = "_sacbus_clock"

_ASYNC_HOOK: Final = "pytest_asyncio_loop_factories"

_kernel_of: Final = pytest.StashKey["Kernel"]()
_maker_of: Final = pytest.StashKey["BusMaker"]()

_MARKER: Final = (
    "sacbus(file=None, *, nodes, kind, name, baud, lanes, seed, **settings): what the bus of the "
    'test is made of: nodes="10-12" or a mapping of addresses to settings, a configuration\'s '
    "file, any setting of the nodes' kind"
)


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--sacbus-record``, and which files are scenarios."""
    group = parser.getgroup("sacbus", "virtual SAC controllers")
    group.addoption(
        "--sacbus-record",
        metavar="DIR",
        help="record the bus of each test and scenario into a file in DIR",
    )
    parser.addini(
        "sacbus_scenarios",
        "names of files that are scenarios; each case in them is a test",
        type="args",
        default=["*.scenario.toml"],
    )


def pytest_configure(config: pytest.Config) -> None:
    """The marker."""
    config.addinivalue_line("markers", _MARKER)


# ---- scenarios ----


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """A scenario's file: one that is named so, or a TOML file that is asked for by its path."""
    if file_path.suffix != ".toml":
        return None
    names = parent.config.getini("sacbus_scenarios")
    if not any(file_path.match(name) for name in names) and not parent.session.isinitpath(
        file_path
    ):
        return None
    from sacbus.testing.files import ScenarioFile  # noqa: PLC0415 (wanted now)

    collector: pytest.Collector = ScenarioFile.from_parent(parent, path=file_path)
    return collector


# ---- time ----


class _Loops:
    """Asks pytest-asyncio for loops in the time of one test function's buses."""

    def __init__(self) -> None:
        self.kernel: Kernel | None = None

    def __call__(self) -> asyncio.AbstractEventLoop:
        """The loop of the test that is being set up."""
        from sacbus.host import VirtualLoop  # noqa: PLC0415 (wanted now)

        assert self.kernel is not None, "a test is given its clock before all that it needs"
        return VirtualLoop(self.kernel)

    @pytest.hookimpl(tryfirst=True, optionalhook=True)
    def pytest_asyncio_loop_factories(self) -> Mapping[str, _Loops]:
        """pytest-asyncio's question, about that function alone."""
        return {"virtual": self}


@pytest.hookimpl(wrapper=True)
def pytest_generate_tests(metafunc: pytest.Metafunc) -> Generator[None, object, object]:
    """An async test with a bus runs in the bus's time."""
    if CLOCK not in metafunc.fixturenames or not hasattr(metafunc.config.hook, _ASYNC_HOOK):
        return (yield)
    # Only while this function is asked about: an implementation of that hook that stays would have
    # to know a loop for everybody's tests.
    plugins = metafunc.config.pluginmanager
    loops = _Loops()
    plugins.register(loops)
    try:
        return (yield)
    finally:
        plugins.unregister(loops)


def _loops(item: pytest.Item) -> _Loops | None:
    """What makes the loop of an async test; None where that is not ours."""
    given = getattr(item, "callspec", None)
    values = () if given is None else given.params.values()
    return next((value for value in values if isinstance(value, _Loops)), None)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A clock for the test, before its loop or its bus asks for one, whichever is first."""
    if CLOCK in getattr(item, "fixturenames", ()):
        from sacbus.kernel import Kernel  # noqa: PLC0415 (wanted now)

        item.stash[_kernel_of] = Kernel()
        if (loops := _loops(item)) is not None:
            loops.kernel = item.stash[_kernel_of]


@pytest.fixture(name=CLOCK)
def _clock(request: pytest.FixtureRequest) -> Kernel:
    """The clock of this test's buses; where an async test could not run by it, it says why."""
    item = request.node
    if inspect.iscoroutinefunction(request.function) or _in_a_loop():
        _refuse_foreign_loop(item)
    kernel: Kernel | None = item.stash.get(_kernel_of, None)
    if kernel is None:  # a plain test that asks for its bus while it runs
        from sacbus.kernel import Kernel  # noqa: PLC0415 (wanted now)

        kernel = item.stash[_kernel_of] = Kernel()
    return kernel


def _in_a_loop() -> bool:
    """Whether a fixture is asked for by a coroutine that runs."""
    import asyncio  # noqa: PLC0415 (wanted now)

    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def _refuse_foreign_loop(item: pytest.Item) -> None:
    mark = item.get_closest_marker("asyncio")
    if not hasattr(item.config.hook, _ASYNC_HOOK):
        why = "an async test with a bus needs pytest-asyncio 1.4 or newer, install that"
    elif mark is None:
        why = "an async test with a bus is run by pytest-asyncio, mark it with pytest.mark.asyncio"
    elif _loops(item) is None:
        why = "an async test must have its bus among its arguments, not ask for it later"
    else:
        default = item.config.getini("asyncio_default_test_loop_scope")
        scope = mark.kwargs.get("loop_scope") or default
        if scope == "function":
            return
        why = f"a test with a bus has a loop of its own: expected loop_scope function, got {scope}"
    pytest.fail(f"sacbus: {why}", pytrace=False)


# ---- fixtures ----


@pytest.fixture
def make_bus(request: pytest.FixtureRequest, _sacbus_clock: Kernel) -> Iterator[BusMaker]:
    """Makes buses in virtual time, all of this test on one clock; it takes the marker's words."""
    from sacbus.testing.made import BusMaker  # noqa: PLC0415 (wanted now)

    maker = request.node.stash[_maker_of] = BusMaker(
        _sacbus_clock, directory=request.path.parent, recordings=_recordings(request)
    )
    yield maker
    from sacbus.trace import RecordingCutOff  # noqa: PLC0415 (wanted now)

    try:
        maker.close()
    except RecordingCutOff as fault:
        cut_off = str(fault)
    else:
        return
    pytest.fail(f"sacbus: {cut_off}", pytrace=False)


def _recordings(request: pytest.FixtureRequest) -> Recordings | None:
    """Where this test's buses are recorded to, if anybody wants that."""
    directory = request.config.getoption("--sacbus-record")
    if directory is None:
        return None
    from sacbus.testing.recordings import Recordings  # noqa: PLC0415 (wanted now)

    root = request.config.rootpath
    return Recordings(Path(directory), request.node.nodeid, request.path, root)


@pytest.fixture
def bus(request: pytest.FixtureRequest, make_bus: BusMaker) -> VirtualBus:
    """A bus in virtual time, of what the marker ``sacbus`` says: nodes 10, 11 and 12 without it."""
    file: Any = None
    words: dict[str, Any] = {}
    # The nearest marker comes first and wins.
    for mark in reversed(list(request.node.iter_markers("sacbus"))):
        if len(mark.args) > 1:
            pytest.fail(f"sacbus: the marker takes one file, got {len(mark.args)}", pytrace=False)
        file = mark.args[0] if mark.args else file
        words.update(mark.kwargs)
    try:
        return make_bus(file, **words)
    except (ValueError, LookupError) as fault:  # SettingError, ConfigError; KindError
        wrong = str(fault)
    pytest.fail(f"sacbus: the marker of {request.node.name}: {wrong}", pytrace=False)


@pytest.fixture
def mother(bus: VirtualBus) -> Mother:
    """The master of ``bus``, for async tests: ``await mother.send(10, "m400")``."""
    return bus.mother


# ---- failures ----


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """A failure shows what was last on the line of each bus, and what its nodes are like."""
    report = yield
    maker = item.stash.get(_maker_of, None)
    if maker is None:
        return report
    if report.failed:
        for one in maker.buses:
            name = one.hosted.configuration.name
            report.sections.append((f"sacbus: {name}", "\n".join(one.told())))
    if call.when == "teardown":
        del item.stash[_maker_of]  # not kept for as long as pytest keeps the test
    return report
