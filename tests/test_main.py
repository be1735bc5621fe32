"""The entry point: Ctrl-C before a command is there to heed it, and after it has ended."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sacbus.cli import root
from tests.serving import PATIENCE

#: Presses Ctrl-C when the module of its first argument is looked for (``dying``: while an object
#: is cleared away there, as imports do), or at the very end.
PRESSED = """
import atexit, os, signal, sys
from sacbus.__main__ import main

def press():
    os.kill(os.getpid(), signal.SIGINT)

class Dying:
    def __del__(self):
        press()
        moment  # where an exception would come, and be told of and dropped

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == moment:
            press()
        elif "dying " + name == moment:
            Dying()

moment = sys.argv.pop(1)
sys.meta_path.insert(0, Finder())
if moment == "end":
    atexit.register(press)
main(**eval(sys.argv.pop(1)))
"""

#: What each command is given, to get as far as the imports of its own.
GIVEN = {
    "serve": ["--ephemeral"],
    "send": ["/nonexistent", "10m400"],
    "terminal": ["/nonexistent"],
    "monitor": ["/nonexistent"],
    "plan": ["m400"],
    "queue": ["get", "/nonexistent", "/nonexistent/queue.csv"],
    "calibrate": ["/nonexistent", "10"],
    "check": ["/nonexistent"],
    "scan": ["/nonexistent"],
    "estop": ["/nonexistent"],
    "gcode": ["/nonexistent", "--axis", "X=10:400"],
    "eeprom": ["show", "/nonexistent"],
    "kinds": [],
    "run": ["/nonexistent.toml"],
    "export": ["/nonexistent", "--csv", "/nonexistent.csv"],
    "diff": ["/nonexistent", "/nonexistent"],
    "simad": ["encode", "/nonexistent", "--axes", "10"],
    "dissector": [],
    "ss": ["/nonexistent", "3", "status"],
}


def pressed(moment: str, *arguments: str, main: str = "{}") -> tuple[int, str, str]:
    """Status, output and errors of a command with Ctrl-C at a moment."""
    ended = subprocess.run(
        [sys.executable, "-c", PRESSED, moment, main, *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    return ended.returncode, ended.stdout, ended.stderr.strip()


@pytest.mark.slow
@pytest.mark.parametrize("module", ["click", "sacbus.config.notation", "dying sacbus.cli.serve"])
@pytest.mark.parametrize("command", sorted(root.commands))
def test_ctrl_c_while_a_command_is_loaded_ends_it_with_130_and_no_word(
    command: str, module: str
) -> None:
    assert pressed(module, command, *GIVEN[command]) == (130, "", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "command"),
    [
        ("sacbus.selector", "serve"),
        ("sacbus.serve", "serve"),
        ("sacbus.mother", "send"),
        ("sacbus.monitor.run", "monitor"),
        ("sacbus.plan.command", "plan"),
        ("numpy", "plan"),
        ("sacbus.config.reading", "check"),
        ("nodes", "kinds"),
    ],
)
def test_ctrl_c_while_a_command_loads_what_it_needs_is_told_in_a_word(
    module: str, command: str
) -> None:
    assert pressed(module, command, *GIVEN[command]) == (130, "", "interrupted")


@pytest.mark.slow
def test_ctrl_c_after_the_end_changes_nothing_of_it() -> None:
    status, output, errors = pressed("end", "plan", "m200v100a1d1")
    assert (status, errors) == (0, "")
    assert "90 + 20 + 90 steps" in output


@pytest.mark.slow
@pytest.mark.parametrize("module", ["click", "sacbus.serve"])
def test_for_whom_ctrl_c_is_a_good_end_it_is_one(module: str) -> None:
    told = "" if module == "click" else "interrupted"
    assert pressed(module, "serve", "--ephemeral", main="{'interrupted': 0}") == (0, "", told)


@pytest.mark.slow
def test_where_ctrl_c_is_ignored_it_stays_ignored() -> None:
    script = "trap '' INT; exec \"$@\""
    ended = subprocess.run(
        ["sh", "-c", script, "sh", sys.executable, "-c", PRESSED, "click", "{}", "plan", "m200"],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "peak" in ended.stdout


@pytest.mark.slow
@pytest.mark.parametrize("way", ["-m", "script"])
def test_the_commands_status_is_the_process_s(way: str) -> None:
    script = [str(Path(sys.executable).with_name("sacbus"))]
    program = [sys.executable, "-m", "sacbus"] if way == "-m" else script
    ended = subprocess.run(
        [*program, "frobnicate"], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("error: ")


@pytest.mark.slow
def test_what_comes_before_it_imports_next_to_nothing() -> None:
    # Until `main` runs, Ctrl-C is a traceback; `typing` alone took longer than all of this.
    asked = "import sys, sacbus.__main__; print(*{'click', 'typing'} & {*sys.modules})"
    ended = subprocess.run(
        [sys.executable, "-S", "-c", asked],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
    )
    assert ended.stdout == "\n"
