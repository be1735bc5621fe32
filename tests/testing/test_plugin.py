"""What pytest shows of tests that have a bus: run by pytester, as a project would run them."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

# Loaded here, for pytester forgets what is first loaded within it, and numpy loads only once.
import nodes.sac  # noqa: F401
import sacbus.testing.files
import sacbus.testing.made  # noqa: F401
from sacbus.trace import read
from sacbus.trace.records import Mark
from tests.full_disk import needs_full_device

pytest_plugins = ["pytester"]
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _as_in_a_project(pytester: pytest.Pytester) -> None:
    pytester.makeini(
        """
        [pytest]
        addopts = -p no:randomly -p no:cacheprovider --strict-markers
        asyncio_mode = strict
        asyncio_default_fixture_loop_scope = function
        filterwarnings = error
        """
    )


# ---- time ----


def test_a_plain_test_moves_its_bus(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_move(bus):
            bus.send(10, "m400v120")
            bus.expect(node=10, position=400, state="STANDBY", within="5 s")
            assert bus.node(10).position == 400
            bus.run_for("10 min")
            assert 600 < bus.time() < 605
        """
    )
    pytester.runpytest().assert_outcomes(passed=1)


def test_an_async_test_runs_in_the_time_of_its_bus(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import asyncio, pytest

        @pytest.mark.asyncio
        async def test_move(bus, mother):
            await mother.send(10, "m400v120")
            await bus.expected(node=10, position=400, state="STANDBY", within="5 s")
            before = bus.now
            await asyncio.sleep(600)
            assert 0 <= bus.now - before - 600_000_000_000 <= 1  # a ns of float seconds
            assert asyncio.get_running_loop().time() == bus.time()

        @pytest.mark.asyncio
        @pytest.mark.parametrize("steps", [100, 200])
        async def test_every_test_begins_at_0(bus, steps):
            assert bus.now == 0
            await bus.mother.send(10, f"m{steps}")
            await bus.reached(lambda: bus.node(10).position == steps, within="9 s")
        """
    )
    pytester.runpytest().assert_outcomes(passed=3)


def test_async_fixtures_share_the_time_whichever_comes_first(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import asyncio, pytest, pytest_asyncio

        @pytest_asyncio.fixture
        async def before():
            await asyncio.sleep(3)
            return asyncio.get_running_loop()

        @pytest_asyncio.fixture
        async def homed(bus):
            await bus.mother.send(10, "m200v120")
            await bus.reached(lambda: bus.node(10).state == "STANDBY", within="5 s")
            yield bus
            await bus.mother.send(10, "S")

        @pytest.mark.asyncio
        async def test_loop_first(before, homed):
            assert before is asyncio.get_running_loop()
            assert homed.node(10).position == 200
            assert homed.time() == before.time() > 3

        @pytest.mark.asyncio
        async def test_bus_first(bus, before):
            assert bus.time() == before.time() >= 3
        """
    )
    pytester.runpytest().assert_outcomes(passed=2)


def test_a_project_may_have_a_bus_of_its_own_or_build_on_ours(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(
        """
        import pytest

        @pytest.fixture
        def bus(make_bus):
            bus = make_bus(nodes=10)
            bus.run(bus.mother.send(10, "m40"))
            bus.run_for("1 s")
            return bus
        """
    )
    pytester.makepyfile(
        test_ours="""
        import asyncio, pytest

        @pytest.mark.asyncio
        async def test_async(bus):
            await asyncio.sleep(60)
            assert bus.node(10).position == 40
            assert bus.time() == pytest.approx(61, abs=0.1)
        """,
        test_theirs="""
        import asyncio, pytest

        @pytest.fixture
        def bus():
            return "number 9"

        @pytest.mark.asyncio
        async def test_async(bus):
            assert bus == "number 9"
            assert type(asyncio.get_running_loop()) is asyncio.SelectorEventLoop
        """,
    )
    pytester.runpytest().assert_outcomes(passed=2)


def test_auto_mode_needs_no_marker(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        async def test_move(bus, mother):
            await mother.send(10, "m40")
            await bus.expected(node=10, position=40, within="1 s")
        """
    )
    pytester.runpytest("-o", "asyncio_mode=auto").assert_outcomes(passed=1)


def test_tests_without_a_bus_keep_their_own_loop(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(
        """
        import asyncio

        class Own(asyncio.SelectorEventLoop): ...

        def pytest_asyncio_loop_factories(config, item):
            return {"own": Own}
        """
    )
    pytester.makepyfile(
        """
        import asyncio, pytest

        @pytest.mark.asyncio
        async def test_with(bus):
            assert type(asyncio.get_running_loop()).__name__ == "VirtualLoop"

        @pytest.mark.asyncio
        async def test_without():
            assert type(asyncio.get_running_loop()).__name__ == "Own"
        """
    )
    pytester.runpytest().assert_outcomes(passed=2)


def test_without_any_factory_tests_without_a_bus_have_the_usual_loop(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        import asyncio, pytest

        @pytest.mark.asyncio
        async def test_with(bus):
            await asyncio.sleep(1_000)

        @pytest.mark.asyncio
        async def test_without(request):
            assert type(asyncio.get_running_loop()) is asyncio.SelectorEventLoop
            assert not hasattr(request.node, "callspec")
        """
    )
    pytester.runpytest().assert_outcomes(passed=2)


@pytest.mark.parametrize(
    ("test", "why"),
    [
        (
            "async def test_it(bus): ...",
            "an async test with a bus is run by pytest-asyncio, mark it with pytest.mark.asyncio",
        ),
        (
            "@pytest.mark.asyncio(loop_scope='module')\nasync def test_it(bus): ...",
            "a test with a bus has a loop of its own: expected loop_scope function, got module",
        ),
        (
            "@pytest.mark.asyncio\nasync def test_it(request): request.getfixturevalue('bus')",
            "an async test must have its bus among its arguments, not ask for it later",
        ),
    ],
)
def test_an_async_test_that_would_not_run_by_its_bus_says_why(
    pytester: pytest.Pytester, test: str, why: str
) -> None:
    pytester.makepyfile(f"import pytest\n{test}")
    result = pytester.runpytest()
    assert result.ret == 1
    result.stdout.fnmatch_lines([f"*sacbus: {why}*"])
    result.stdout.no_fnmatch_line("*During handling*")


def test_without_pytest_asyncio_plain_tests_work_and_async_ones_say_what_to_install(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        def test_plain(bus):
            bus.send(10, "m40")

        async def test_async(bus): ...
        """
    )
    pytester.makeini("[pytest]\naddopts = -p no:randomly")
    result = pytester.runpytest("-p", "no:asyncio", "-p", "no:pytest_asyncio")
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(["*needs pytest-asyncio 1.4 or newer, install that"])


# ---- the marker ----


def test_markers_say_what_the_bus_is_made_of_the_nearest_wins(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        pytestmark = pytest.mark.sacbus(nodes="10-12,85", ustep=3, seed=4)

        def test_of_the_file(bus):
            assert list(bus.nodes) == [10, 11, 12, 85]
            bus.send(85, "m2")
            bus.expect(node=85, position=2, within="1 s")
            assert bus.node(85).pulses == 16
            assert bus.hosted.configuration.seed == 4

        @pytest.mark.sacbus(nodes={20: {"ustep": 1}, 21: {}}, seed=5)
        def test_of_its_own(bus):
            bus.send(20, "m2")
            bus.send(21, "m2")
            bus.run_for("1 s")
            assert [node.pulses for node in bus.nodes.values()] == [4, 16]
            assert bus.hosted.configuration.seed == 5
        """
    )
    pytester.runpytest().assert_outcomes(passed=2)


def test_a_bus_of_a_configuration_beside_the_test(pytester: pytest.Pytester) -> None:
    (pytester.path / "line.toml").write_text(
        '[[bus]]\nname = "a"\n[[bus.nodes]]\naddresses = "30"\n'
        '[[bus]]\nname = "b"\n[[bus.links]]\nkind = "pty"\npath = "taken"\n'
        '[[bus.nodes]]\naddresses = "40"\nustep = 2\n'
    )
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.sacbus("line.toml", name="b", slow=20)
        def test_second(bus):
            bus.send(40, "m5")
            bus.run_for("1 s")
            assert bus.node(40).pulses == 20
            assert bus.hosted.links == []
            (node,) = bus.hosted.configuration.every_node
            assert node.settings["slow"] == 20
        """
    )
    pytester.runpytest().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("microsteps=3", "microsteps: expected nodes, kind, name, baud, lanes, seed, or a setting"),
        ("ustep=9", "setting 'ustep': expected a whole number from 0 to 7, got 9"),
        ("nodes='10-300'", "10-300"),
        ("nodes=3", "nodes: expected addresses from 4 to 255, got 3"),
        ("nodes=[10, 10]", "nodes: expected every address once, got 10 twice"),
        ("nodes=None", "nodes: expected addresses such as"),
        ("nodes={10: 3}", "nodes: expected settings of node 10, got 3"),
        ("kind='kiln'", "node kind 'kiln' is not installed"),
        ("'nowhere.toml'", "cannot read the configuration"),
        ("name=3", "name: expected a text, got 3"),
        ("seed='x'", "seed: expected a whole number, got 'x'"),
        ("baud='fast'", "baud: expected a whole number, got 'fast'"),
    ],
)
def test_a_wrong_marker_is_one_line(pytester: pytest.Pytester, words: str, why: str) -> None:
    pytester.makepyfile(f"import pytest\n@pytest.mark.sacbus({words})\ndef test_it(bus): ...")
    result = pytester.runpytest()
    result.assert_outcomes(errors=1)
    (line,) = [one for one in result.outlines if one.startswith("sacbus: the marker of test_it: ")]
    assert why in line
    assert "Traceback" not in result.stdout.str()


def test_the_marker_is_explained(pytester: pytest.Pytester) -> None:
    pytester.runpytest("--markers").stdout.fnmatch_lines(["@pytest.mark.sacbus(file=None, *, nod*"])


# ---- failures ----


def test_a_failure_shows_the_last_packets_reports_and_states(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_short(bus):
            bus.send(10, "m400v120")
            bus.send(11, "banana")
            bus.expect(node=10, position=500, within="1 s")
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            '>       bus.expect(node=10, position=500, within="1 s")',
            "E  *expected node 10: position 500 within 1 s, got position *, state CRUISE, at *",
            "* sacbus: bus *",
            "at 1.0* s",
            "last on the line:",
            "  0.000000 s  mother: to 10 'm400v120', move 400 full steps at 120 RPM",
            "  0.004* s  10: ACK to 1",
            "  * s  mother: to 11 'banana', *",
            "last reports:",
            "  * s  node 11: refused in 'banana'*",
            "nodes:",
            "  node 10: CRUISE at *, 120* RPM, m400v120*",
            "  node 11: STANDBY at 0, 0 RPM",
        ],
        consecutive=False,
    )


def test_an_assertion_about_a_node_shows_the_node(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_early(bus):
            bus.send(10, "m400v120")
            assert bus.node(10).position == 400
        """
    )
    result = pytester.runpytest()
    result.stdout.fnmatch_lines(
        [
            "E       AssertionError: assert * == 400",
            "E        +  where * = <node 10: * RPM, m400v120*, at 0.0* s>.position",
            "* sacbus: bus *",
        ]
    )


def test_a_failure_in_an_async_test_and_in_a_fixture_is_told_alike(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.asyncio
        async def test_async(bus, mother):
            await mother.send(10, "m40")
            await bus.expected(node=10, position=41, within="1 s")

        @pytest.fixture
        def homed(bus):
            bus.until(lambda: bus.node(11).position == 1, within="20 ms")

        def test_fixture(homed): ...
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(failed=1, errors=1)
    text = result.stdout.str()
    assert text.count("- sacbus: bus -") == 2
    result.stdout.fnmatch_lines(
        [
            "*what is waited for did not come within 20 ms",
            "E * expected node 10: position 41 within 1 s, got position 40, state STANDBY, at *",
        ]
    )


def test_a_passed_test_tells_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(bus): bus.send(10, 'm40')")
    assert "last on the line" not in pytester.runpytest("-rA").stdout.str()


def test_many_nodes_are_told_of_with_those_first_that_do_something(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.sacbus(nodes="4-253")
        def test_it(bus):
            bus.send(200, "m400")
            assert False
        """
    )
    result = pytester.runpytest()
    result.stdout.fnmatch_lines(
        ["nodes:", "  node 200: *", "  node 4: STANDBY at 0, 0 RPM", "  and 238 more"]
    )


def test_two_buses_of_a_test_are_told_of_each_and_have_one_clock(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        def test_two(make_bus):
            left, right = make_bus(nodes=10, name="left"), make_bus(nodes=10, name="right")
            left.send(10, "m40")
            right.run_for("1 s")
            assert left.now == right.now
            assert (left.node(10).position, right.node(10).position) == (40, 1)
        """
    )
    result = pytester.runpytest()
    result.stdout.fnmatch_lines(["*- sacbus: left -*", "*- sacbus: right -*"])


# ---- recordings ----


def test_each_bus_is_recorded_where_asked_the_same_in_every_run(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        def test_it(make_bus):
            for bus in make_bus(nodes=10), make_bus(nodes=11):
                bus.send(10 if 10 in bus.nodes else 11, "m40")
                bus.run_for("1 s")
        """
    )
    texts = []
    for directory in "once", "again":
        pytester.runpytest(f"--sacbus-record={directory}").assert_outcomes(passed=1)
        files = sorted((pytester.path / directory).iterdir())
        name = "test_each_bus_is_recorded_where_asked_the_same_in_every_run.py-test_it-bus"
        assert [re.sub("-[0-9a-f]{8}[.]", "-N.", file.name) for file in files] == [
            f"{name}-2-N.jsonl",
            f"{name}-N.jsonl",
        ]
        texts.append([file.read_text() for file in files])
    assert texts[0] == texts[1]
    lines = [json.loads(line) for line in texts[0][0].splitlines()]
    assert lines[0]["sacbus"] == "recording"
    assert lines[-1]["is"] == "end"


def test_an_expectation_that_failed_is_marked_in_the_recording(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_it(bus):
            bus.expect(node=10, position=40, within="5 ms")
        """
    )
    pytester.runpytest("--sacbus-record=seen").assert_outcomes(failed=1)
    (file,) = (pytester.path / "seen").iterdir()
    (mark,) = [one for one in read(file) if isinstance(one, Mark)]
    assert mark.text == "expected node 10: position 40 within 5 ms, got position 0, state STANDBY"


@needs_full_device
def test_a_recording_that_is_not_whole_is_an_error_of_the_test_in_one_line(
    pytester: pytest.Pytester,
) -> None:
    pytester.makepyfile(
        """
        def test_it(bus):
            bus.send(10, "m40")
            bus.expect(node=10, position=40, within="1 s")
        """
    )
    pytester.runpytest("--sacbus-record=seen").assert_outcomes(passed=1)
    (file,) = (pytester.path / "seen").iterdir()
    file.unlink()
    file.symlink_to("/dev/full")
    result = pytester.runpytest("--sacbus-record=seen")
    result.assert_outcomes(passed=1, errors=1)
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    assert (
        f"sacbus: the recording seen/{file.name} could not be begun: No space left on device, "
        "nothing is kept, record elsewhere"
    ) in result.outlines
    assert "Traceback" not in result.stdout.str()


def test_tests_of_one_name_in_files_of_one_name_are_recorded_apart(
    pytester: pytest.Pytester,
) -> None:
    test = (
        'import pytest\n@pytest.mark.parametrize("x", ["a b", "a-b"])\ndef test_it(bus, x): pass\n'
    )
    places = ["there/left/test_same.py", "there/right/test_same.py", "there-right/test_same.py"]
    for place in places:
        path = pytester.path / place
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(test)
    root = pytester.mkdir("root")
    (root / "pytest.ini").write_text(
        "[pytest]\naddopts = -p no:randomly -p no:cacheprovider\n"
        "asyncio_default_fixture_loop_scope = function\n"
    )
    given = ["--import-mode=importlib", "-c", str(root / "pytest.ini"), "--sacbus-record=seen"]
    directories = [str((pytester.path / place).parent) for place in places]
    pytester.runpytest(*given, *directories).assert_outcomes(passed=6)
    seen = {file.name for file in (pytester.path / "seen").iterdir()}
    assert len(seen) == 6
    # Stable: whatever else is run, and in whatever order.
    for directory in reversed(directories):
        pytester.runpytest(*given, directory).assert_outcomes(passed=2)
    assert {file.name for file in (pytester.path / "seen").iterdir()} == seen


# ---- cost ----


def test_who_has_no_bus_loads_nothing_of_it(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import sys

        def test_it():
            loaded = {name for name in sys.modules if name.split(".")[0] in ("sacbus", "nodes")}
            assert loaded == {"sacbus", "sacbus.testing", "sacbus.testing.plugin"}
            assert "numpy" not in sys.modules
            assert "asyncio" not in sys.modules
        """
    )
    # Of the other plugins here some load asyncio, and this test is about ours.
    result = pytester.run(
        sys.executable, "-m", "pytest", "-p", "no:asyncio", "-p", "no:randomly",
        "-p", "no:hypothesispytest", "-p", "no:anyio", "-c", Path("/dev/null"), "--rootdir=.",
        "--confcutdir=.",  # or whatever lies in the directories above would be looked at, too
    )  # fmt: skip
    result.assert_outcomes(passed=1)
