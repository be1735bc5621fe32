"""The table of what interferes with the order of commands; and the page that shows it."""

from __future__ import annotations

from itertools import product
from pathlib import Path

from nodes.sac.order import RULES, Cue, LoopFate, Present, Rule, Source

PAGE = Path(__file__).parents[3] / "docs" / "command-processor.md"


def test_every_source_has_a_rule_for_every_cue() -> None:
    assert set(RULES) == set(product(Source, Cue))


def test_only_a_stop_and_the_end_of_continuous_motion_drop_what_waits() -> None:
    drops = {at for at, rule in RULES.items() if not rule.waits}
    assert drops == {
        *((source, Cue.STOP) for source in Source),
        (Source.CONTINUOUS, Cue.END),
    }


def test_what_goes_before_others_leaves_loop_and_queue_as_they_are() -> None:
    for source, cue in product(Source, (Cue.CONTINUOUS, Cue.ONCE)):
        assert RULES[source, cue] == Rule(Present.CUT, LoopFate.GOES_ON)


def test_the_page_shows_the_table_as_it_is() -> None:
    shown = PAGE.read_text(encoding="utf-8")
    heads = "".join(f" {cue.value} |" for cue in Cue)
    table = [f"| what runs comes from |{heads}", f"|---|{'---|' * len(Cue)}"]
    for source in Source:
        cells = "".join(f" {told(RULES[source, cue], source)} |" for cue in Cue)
        table.append(f"| {source.value} |{cells}")
    assert "\n".join(table) in shown, "\n".join(table)


def told(rule: Rule, source: Source) -> str:
    """A rule as a cell of the table; what never is there is not told of."""
    present = [] if source is Source.STANDBY else [f"it {rule.present.value}"]
    loop = [] if rule.loop is LoopFate.GOES_ON else [f"a loop {rule.loop.value}"]
    waits = [] if rule.waits else ["what is pending is dropped"]
    return "; ".join(present + loop + waits) or "nothing"
