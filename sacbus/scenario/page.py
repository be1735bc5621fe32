"""Results as a page to read: one HTML file that needs nothing else, not even the network.

Owns what a page says and its look. Everything that comes from a scenario, a bus or a node is
escaped; the same run gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from sacbus.kernel import SECOND, Ns
from sacbus.scenario.junit import told
from sacbus.scenario.result import Failure, Met, Result

__all__ = ["Case", "page"]

#: Rows of a table at most; of what was as expected no more are told.
MOST_ROWS: Final = 1_000

_STYLE: Final = """
:root { color: #1b2a41; background: #fff; font: 15px/1.45 system-ui, sans-serif; }
body { max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin: 0 0 1rem; }
h2 { font-size: 1.15rem; margin: 0; display: inline; }
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
table { border-collapse: collapse; max-width: 100%; font-size: .9rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem .8rem .25rem 0;
  border-bottom: 1px solid #e4e8ee; overflow-wrap: break-word; }
td { min-width: 2.5rem; max-width: 30rem; }
.line td { max-width: 50rem; }
th { font-weight: 600; color: #56637a; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
code, pre, .line td { font-family: ui-monospace, monospace; font-size: .85rem; }
pre { background: #f4f6f9; padding: .7rem; overflow-x: auto; margin: .3rem 0; }
details { border: 1px solid #d5dbe4; border-radius: 6px; padding: .8rem 1rem; margin: 1rem 0; }
summary { cursor: pointer; }
.mark { display: inline-block; min-width: 4.2rem; font-weight: 700; }
.passed .mark, td.passed { color: #1c6e4a; white-space: nowrap; }
.failed .mark, td.failed { color: #b3261e; white-space: nowrap; }
details.failed { border-left: 4px solid #b3261e; }
.failure { background: #fdf3f2; border-left: 4px solid #b3261e; padding: .6rem 1rem;
  margin: .8rem 0; }
.failure dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; margin: 0; }
.failure dt { color: #56637a; } .failure dd { margin: 0; overflow-wrap: anywhere; }
.line td:first-child { white-space: nowrap; }
.note { color: #56637a; }
svg { max-width: 100%; height: auto; }
"""

#: Nothing is fetched and nothing is run, whatever a scenario may have in it.
_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'"


@dataclass(frozen=True, slots=True)
class Case:
    """A result, and what a page tells besides.

    ``repeat``: the command line that gives it again. ``picture``: an SVG of what happened; without
    one ``note`` says why.
    """

    result: Result
    repeat: str
    picture: str = ""
    note: str = ""


def page(cases: Sequence[Case]) -> str:
    """One document with all cases, in their order; those that failed are unfolded."""
    failed = sum(not case.result.passed for case in cases)
    heading = f"{len(cases) - failed} of {_count(len(cases), 'case')} passed"
    body = [f"<h1>{heading}</h1>"]
    if len(cases) > 1:
        body.append(_overview(cases))
    for number, case in enumerate(cases, start=1):
        body += _case(case, number, unfolded=len(cases) == 1 or not case.result.passed)
    return "\n".join(
        [
            "<!DOCTYPE html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
            '<meta name="viewport" content="width=device-width">',
            f"<title>{heading}</title>",
            f"<style>{_STYLE}</style>",
            "</head>",
            "<body>",
            *body,
            "</body>",
            "</html>",
            "",
        ]
    )


def _overview(cases: Sequence[Case]) -> str:
    rows = []
    for number, case in enumerate(cases, start=1):
        result = case.result
        name = f'<a href="#case-{number}">{_text(result.name)}</a>'
        cells = [
            _cell(_verdict(result), _class(result)),
            f"<td>{name}</td>",
            _cell(result.scenario.file),
            _cell(str(result.expectations), "number"),
            _cell(str(len(result.failures)), "number"),
            _cell(_seconds(result.ended), "number"),
        ]
        rows.append(f'<tr class="{_class(result)}">{"".join(cells)}</tr>')
    heads = ("", "case", "file", "#expectations", "#failures", "#bus time, s")
    return _table(heads, rows)


def _case(case: Case, number: int, *, unfolded: bool) -> list[str]:
    result = case.result
    opened = " open" if unfolded else ""
    took = f'<span class="note">{_seconds(result.ended)} s of bus time</span>'
    mark = f'<span class="mark">{_verdict(result)}</span>'
    return [
        f'<details class="{_class(result)}" id="case-{number}"{opened}>',
        f"<summary>{mark} <h2>{_text(result.name)}</h2> {took}</summary>",
        *_failures(result),
        *_expectations(result),
        *_picture(case, number),
        *_nodes(result),
        *_counts(result),
        *_again(case),
        "</details>",
    ]


def _failures(result: Result) -> Iterable[str]:
    if result.failures:
        yield "<h3>What was not as expected</h3>"
    for failure in result.failures:
        yield '<div class="failure">'
        yield "<dl>"
        facts = {
            "at": f"{_seconds(failure.when)} s",
            "expected": failure.expected,
            "got": failure.got,
            "step": failure.step,
            "where": failure.place,
        }
        for name, fact in facts.items():
            if fact:
                yield f"<dt>{name}</dt><dd>{_text(fact)}</dd>"
        yield "</dl>"
        if failure.states:
            yield "<h3>The nodes at that time</h3>"
            yield f"<pre>{_text(chr(10).join(failure.states))}</pre>"
        if failure.packets:
            yield "<h3>The last on the line before it</h3>"
            yield _table(("#time, s", "who", "what"), map(_packet, failure.packets), "line")
        yield "</div>"


def _packet(words: str) -> str:
    """A row of what a failure tells of the line: ``0.003796 s  10: ACK to 1``."""
    when, _, rest = words.partition(" s  ")
    who, _, what = rest.partition(": ")
    return f"<tr>{_cell(when, 'number')}{_cell(who)}{_cell(what)}</tr>"


def _expectations(result: Result) -> Iterable[str]:
    if not result.looked:
        return
    yield "<h3>Expectations</h3>"
    # Of what was met the first, of what was not all.
    room = MOST_ROWS - len(result.failures)
    shown = []
    for one in result.looked:
        if isinstance(one, Met):
            room -= 1
            if room < 0:
                continue
        shown.append(one)
    yield _table(("", "#time, s", "expected", "got", "step", "where"), map(_looked, shown))
    if len(shown) < len(result.looked):
        yield f'<p class="note">… and {len(result.looked) - len(shown)} more that were met.</p>'


def _looked(one: Met | Failure) -> str:
    failed = isinstance(one, Failure)
    cells = [
        _cell("failed" if failed else "met", "failed" if failed else "passed"),
        _cell(_seconds(one.when), "number"),
        _cell(one.expected),
        _cell(one.got if isinstance(one, Failure) else "as expected"),
        _cell(one.step),
        _cell(one.place),
    ]
    return f"<tr>{''.join(cells)}</tr>"


def _picture(case: Case, number: int) -> Iterable[str]:
    if case.picture:
        yield "<h3>What happened</h3>"
        yield _inline(case.picture, f"case-{number}-")
    elif case.note:
        yield f'<p class="note">{_text(case.note)}</p>'


def _inline(svg: str, prefix: str) -> str:
    """An SVG as a part of a page, where the names inside of several must not meet."""
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{prefix}', svg)
    svg = re.sub(r"url\(#", f"url(#{prefix}", svg)
    return re.sub(r'href="#', f'href="#{prefix}', svg)


def _nodes(result: Result) -> Iterable[str]:
    if not result.nodes:
        return
    yield "<h3>The nodes at the end</h3>"
    several = len(result.counts) > 1
    rows = []
    for (bus, address), seen in list(result.nodes.items())[:MOST_ROWS]:
        cells = [
            *([_cell(bus)] if several else []),
            _cell(str(address), "number"),
            _cell(seen.state),
            _cell(f"{seen.position_steps:g}", "number"),
            _cell(f"{seen.rpm:g}", "number"),
            _cell(seen.current or ""),
        ]
        rows.append(f"<tr>{''.join(cells)}</tr>")
    heads = ("#node", "state", "#position, full steps", "#velocity, RPM", "command")
    yield _table(("bus", *heads) if several else heads, rows)


def _counts(result: Result) -> Iterable[str]:
    if not result.counts:
        return
    yield "<h3>What was counted</h3>"
    names = list(next(iter(result.counts.values())))
    rows = [
        f"<tr>{_cell(bus)}{''.join(_cell(str(counts[name]), 'number') for name in names)}</tr>"
        for bus, counts in result.counts.items()
    ]
    yield _table(("bus", *(f"#{name}" for name in names)), rows)


def _again(case: Case) -> Iterable[str]:
    yield "<h3>How to repeat it</h3>"
    yield f"<pre>{_text(case.repeat)}</pre>"
    scenario = case.result.scenario
    facts = {f"parameter {name}": value for name, value in scenario.parameters.items()}
    facts |= {f"seed of bus {bus.name}": bus.seed for bus in scenario.buses}
    rows = [f"<tr>{_cell(name)}{_cell(str(value))}</tr>" for name, value in facts.items()]
    yield _table(("", "value"), rows)


def _table(heads: Sequence[str], rows: Iterable[str], kind: str = "") -> str:
    """Heads that begin with # are over numbers."""
    cells = "".join(
        f'<th class="number">{_text(head[1:])}</th>'
        if head.startswith("#")
        else f"<th>{_text(head)}</th>"
        for head in heads
    )
    body = "\n".join(rows)
    head = f"<thead><tr>{cells}</tr></thead>"
    return f'<table class="{kind}">\n{head}\n<tbody>\n{body}\n</tbody>\n</table>'


def _cell(text: str, kind: str = "") -> str:
    return f'<td class="{kind}">{_text(text)}</td>' if kind else f"<td>{_text(text)}</td>"


def _text(text: str) -> str:
    """As it stands on a page: nothing in it is markup, and nothing a control character."""
    return escape(told(text))


def _verdict(result: Result) -> str:
    return "passed" if result.passed else "FAILED"


def _class(result: Result) -> str:
    return "passed" if result.passed else "failed"


def _seconds(time: Ns) -> str:
    return f"{time / SECOND:.6f}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}"
