"""``sacbus run``: scenarios played, and what came of each."""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import TYPE_CHECKING, BinaryIO, Final, Self

import click

from sacbus.cli.options import STANDARD, WrongInput, read_parameters, verbose
from sacbus.cli.recordings import (
    fresh_text,
    picture_form,
    refuse_missing_directories,
    refuse_shared_files,
)
from sacbus.cli.report import Report
from sacbus.cli.spoken import check_spoken
from sacbus.fresh import fresh_file

if TYPE_CHECKING:
    from sacbus.scenario import Result, Scenario
    from sacbus.trace import Recording

__all__ = ["run_command"]

#: Seconds until a scenario counts as slow, and between two words about how far it is.
SLOW: Final = 1.0


@click.command("run")
@click.argument("files", nargs=-1, required=True, metavar="SCENARIO.toml...")
@click.option(
    "--set",
    "parameters",
    multiple=True,
    metavar="NAME=VALUE",
    callback=read_parameters,
    help="A parameter's value; [1,2] makes a case of each. Repeats.",
)
@click.option("--seed", type=int, help="In place of the scenarios' own seeds.")
@click.option("--real", is_flag=True, help="In real time, mother at a pty of the bus.")
@click.option("--link", metavar="LINK", help="On a line: a port, a pty or a URL. In real time.")
@click.option(
    "--speed",
    type=click.FloatRange(1e-6, 1e6),
    help="Bus seconds in a second, with --real. [default: 1]",
)
@click.option("-k", "word", metavar="WORD", help="Only those with WORD in file, title or case.")
@click.option("-x", "first", is_flag=True, help="Stop after the first that fails.")
@click.option(
    "--record", type=click.Path(dir_okay=False), metavar="FILE", help="Keep a recording of it."
)
@click.option(
    "--vcd", type=click.Path(dir_okay=False), metavar="FILE", help="Write the nodes' pins as VCD."
)
@click.option(
    "--pcap", type=click.Path(dir_okay=False), metavar="FILE", help="Write pcapng for Wireshark."
)
@click.option(
    "--junit",
    type=click.Path(dir_okay=False, allow_dash=True),
    metavar="FILE",
    help="Write JUnit XML.",
)
@click.option(
    "--plot",
    "picture",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="Draw how the nodes moved and who talked: .png or .svg.",
)
@click.option(
    "--report",
    type=click.Path(dir_okay=False),
    metavar="FILE",
    help="Write a page to read: one HTML file, with pictures.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON.")
@verbose
def run_command(
    files: tuple[str, ...],
    parameters: dict[str, object],
    seed: int | None,
    real: bool,
    link: str | None,
    speed: float | None,
    word: str | None,
    first: bool,
    record: str | None,
    vcd: str | None,
    pcap: str | None,
    junit: str | None,
    picture: str | None,
    report: str | None,
    as_json: bool,
) -> int:
    """Play scenarios in virtual time, and say what was not as expected.

    Status 1 when an expectation fails, 2 for a scenario that is wrong; then none is played. A
    SCENARIO of - is standard input. All keys are in docs/scenarios.md.

    \b
    Example: sacbus run two-axes.toml --set speed=120 --junit results.xml
             sacbus run scenarios/*.toml --report results.html
             sacbus run two-axes.toml --link /dev/ttyUSB0
    """
    from sacbus.scenario.junit import junit as in_junit

    if real and link is not None:
        raise click.UsageError("expected --real or --link, got both")
    if as_json and junit == STANDARD:
        raise click.UsageError("--json: expected --junit to be a file, got standard output")
    pages = {"--record": record, "--vcd": vcd, "--pcap": pcap, "--plot": picture}
    kept = [option for option, path in pages.items() if path is not None]
    if kept and link is not None:
        raise click.UsageError(
            f"{kept[0]}: expected a bus in this process, got --link, see sacbus monitor"
        )
    if speed is not None and not real:
        raise click.UsageError("--speed: expected only with --real")
    outputs = {
        **pages,
        "--report": report,
        "--junit": None if junit == STANDARD else junit,
    }
    refuse_shared_files(outputs, [one for one in files if one != STANDARD])
    chosen = _read(files, parameters, seed, word, line_only=link is not None)
    if not chosen:
        raise click.UsageError(f"-k: no file, title or case has {word!r} in it")
    if kept and len(chosen) > 1:
        raise click.UsageError(
            f"{kept[0]}: expected one scenario of one case, got {len(chosen)}, use -k or --set"
        )
    refuse_missing_directories(outputs)
    if link is not None:
        _check_line(link, chosen)
    form = "" if picture is None else picture_form(picture)
    page = None if report is None else Report(report, parameters, _how(seed, real, link, speed))
    recorded = bool(kept) or (page is not None and link is None)
    results: list[Result] = []

    def write() -> None:
        if as_json:
            click.echo(json.dumps({"scenarios": [one.as_json() for one in results]}))
        if junit is not None:
            with fresh_text(Path(junit)) as xml:
                xml.write(in_junit(results))
        if page is not None:
            page.write()

    try:
        for scenario in chosen:
            with _Progress(scenario) as progress, _opened(record, recorded) as file:
                result = _played(scenario, real, link, speed, file, progress.come_to)
                if result.recording is not None:
                    _export(result.recording, vcd, pcap)
                    if picture is not None:
                        _draw(result, result.recording, picture, form)
                if page is not None:
                    page.add(result)
            results.append(result)
            if not as_json:
                _tell(result)
            if first and not result.passed:
                break
    except (KeyboardInterrupt, OSError):  # a line that is lost, a disk that is full
        # What had ended is kept; the one that had not is in none of them.
        if results:
            write()
        raise
    write()
    return 0 if all(one.passed for one in results) else 1


def _read(
    files: Sequence[str],
    parameters: dict[str, object],
    seed: int | None,
    word: str | None,
    *,
    line_only: bool,
) -> list[Scenario]:
    """All scenarios that are to be played; ConfigError with the mistakes of all files."""
    from sacbus.config import ConfigError, Mistake
    from sacbus.scenario import read
    from sacbus.scenario.result import case_words
    from sacbus.scenario.rules import refuse

    found: list[Scenario] = []
    mistakes: list[Mistake] = []
    for file in files:
        try:
            of_file = read(file, parameters, seed=seed)
            for scenario in of_file:
                told = f"{scenario.file} {scenario.title} {case_words(scenario.case)}"
                if word is None or word in told:
                    refuse(scenario, line_only=line_only)
                    found.append(scenario)
        except ConfigError as wrong:
            mistakes += wrong.mistakes
    if mistakes:
        raise ConfigError(list(dict.fromkeys(mistakes)))
    return found


def _check_line(link: str, scenarios: Sequence[Scenario]) -> None:
    """LinkError where LINK is known to speak what one of them does not."""
    from sacbus.configuration import check

    for protocol in {check(bus).name: None for one in scenarios for bus in one.buses}:
        asyncio.run(check_spoken(link, protocol))


def _played(
    scenario: Scenario,
    real: bool,
    link: str | None,
    speed: float | None,
    record: BinaryIO | None,
    progress: Callable[[int], None] | None,
) -> Result:
    from sacbus.scenario import run, run_on_link, run_real

    if link is not None:
        return run_on_link(scenario, link, progress=progress)
    if real:
        return run_real(scenario, speed=speed or 1.0, record=record, progress=progress)
    return run(scenario, record=record, progress=progress)


@contextmanager
def _opened(path: str | None, needed: bool) -> Iterator[BinaryIO | None]:
    """The file of a recording, for writing and for reading back; one without a name if need be."""
    if path is None and not needed:
        yield None
        return
    if path is not None:
        with Path(path).open("w+b", buffering=0) as file:
            if not file.seekable():
                raise WrongInput(f"--record: expected a file, got {path}, which is a pipe")
            yield file
        return
    from sacbus.trace import RecordingCutOff

    with TemporaryFile("w+b", buffering=0) as file:
        try:
            yield file
        except RecordingCutOff as fault:
            what = (
                f"{fault.reason}, what pictures are made of is kept there as long as it is played"
            )
            raise OSError(f"{gettempdir()}: {what}, make room or set TMPDIR") from fault


def _export(recording: Recording, vcd: str | None, pcap: str | None) -> None:
    """Write what is made of a recording. Each form is loaded only where it is asked for."""
    if vcd is not None:
        from sacbus.trace.vcd import write_vcd

        with fresh_text(Path(vcd)) as page:
            write_vcd(recording, page)
    if pcap is not None:
        from sacbus.trace import write_pcapng

        with fresh_file(Path(pcap)) as file:
            write_pcapng(recording, file)


def _draw(result: Result, recording: Recording, picture: str, form: str) -> None:
    from sacbus.trace.plots import draw_axes

    with fresh_file(Path(picture)) as file:
        draw_axes(recording, file, form, since=result.origin)


def _how(seed: int | None, real: bool, link: str | None, speed: float | None) -> list[str]:
    """The options that tell how a scenario is played."""
    given = {"--seed": seed, "--link": link, "--speed": speed}
    words = [
        word for name, value in given.items() if value is not None for word in (name, str(value))
    ]
    return [*words, *["--real"][:real]]


def _tell(result: Result) -> None:
    seconds = f"{result.ended / 1e9:.6f} s"
    verdict = "passed" if result.passed else "FAILED"
    click.echo(f"{verdict} {result.scenario.file}: {result.name}, {seconds}")
    for failure in result.failures:
        for line in failure.lines():
            click.echo(f"  {line}")


class _Progress:
    """How far a slow scenario is, on a terminal's last line; gone when it is over."""

    def __init__(self, scenario: Scenario) -> None:
        self._name = scenario.title
        self._next = time.monotonic() + SLOW
        self._shown = False
        #: None where nobody would see it.
        self.come_to = self._come_to if sys.stderr.isatty() else None

    def _come_to(self, now: int) -> None:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + SLOW
            self._shown = True
            click.echo(f"\r\x1b[K{self._name}: {now / 1e9:.0f} s of bus time", nl=False, err=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._shown:
            click.echo("\r\x1b[K", nl=False, err=True)
