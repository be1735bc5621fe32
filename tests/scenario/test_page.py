"""The page of results: all that came of them, escaped, in one file, the same every time."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

from sacbus.scenario import Failure, Met, Result, Scenario
from sacbus.scenario.page import MOST_ROWS, Case, page
from tests.scenario.stage import HEAD, played

SVG = '<?xml version="1.0"?>\n<!DOCTYPE svg>\n<svg><g id="a" fill="url(#a)"/></svg>'

FAILS = """
    [[step]]
    name = "go"
    send = "10m40v300"
    [[step]]
    expect = { node = 10, position = 40, state = "STANDBY", within = "2 s" }
    [[step]]
    name = "too far"
    expect = { node = 10, position = 41 }
    [[step]]
    expect = { retries = 0 }
    """


class Read(HTMLParser):
    """A page as a browser takes it apart; every element must be closed in its turn."""

    VOID = frozenset({"meta"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.words.append(data.strip())


def test_a_failure_is_told_with_time_expected_got_the_line_and_the_nodes(file: Path) -> None:
    result = played(file, FAILS)
    words = Read(page([Case(result, "sacbus run x.toml", SVG)])).words
    (failure,) = result.failures
    begin = words.index("What was not as expected")
    told = words[begin : words.index("Expectations")]
    assert told[1:] == [
        "at", f"{failure.when / 1e9:.6f} s",
        "expected", "node 10: position 41",
        "got", "position 40, state STANDBY",
        "step", "too far",
        "where", failure.place,
        "The nodes at that time", "node 10: STANDBY at 40, 0 RPM",
        "The last on the line before it", "time, s", "who", "what",
        "0.000000", "mother", "to 10 'm40v300', move 40 full steps at 300 RPM",
        "0.003796", "10", "ACK to 1",
    ]  # fmt: skip
    assert words[words.index("What was not as expected") - 3] == "FAILED"


def test_expectations_that_were_met_are_told_as_well(file: Path) -> None:
    result = played(file, FAILS)
    words = Read(page([Case(result, "")])).words
    rows = words[words.index("Expectations") : words.index("The nodes at the end")]
    assert rows.count("met") == 2
    assert rows.count("failed") == 1
    assert rows[6:10] == [
        "met",
        f"{result.looked[0].when / 1e9:.6f}",
        "node 10: position 40, state STANDBY within 2 s",
        "as expected",
    ]


def test_nodes_counts_parameters_seeds_and_how_to_repeat_it(file: Path) -> None:
    head = "seed = 7\n[parameters]\nspeed = 300\n" + HEAD
    result = played(file, FAILS.replace("v300", "v{speed}"), head)
    words = Read(page([Case(result, "sacbus run 'x y.toml' --seed 7")])).words
    nodes = words[words.index("The nodes at the end") : words.index("What was counted")]
    assert nodes[6:14] == ["10", "STANDBY", "40", "0", "11", "STANDBY", "0", "0"]
    counts = words[words.index("What was counted") : words.index("How to repeat it")]
    assert {"acks", "naks", "timeouts", "retries", "collisions", "warnings"} <= set(counts)
    assert words[words.index("How to repeat it") :][1:] == [
        "sacbus run 'x y.toml' --seed 7",
        "value",
        "parameter speed",
        "300",
        "seed of bus bus",
        "7",
    ]


def test_whatever_stands_in_a_scenario_or_on_a_line_is_text() -> None:
    bad = "<script>alert('x')</script>\"&amp;\x07"
    scenario = Scenario(bad, (), (), case={"a": bad}, file=bad, parameters={bad: bad})
    result = Result(
        scenario,
        [Failure(1, bad, bad, bad, bad, (f"0.1 s  {bad}: {bad}",), (bad,))],
        counts={bad: {bad: 1}},
    )
    result.looked += [Met(0, bad, bad, bad), *result.failures]
    text = page([Case(result, bad, note=bad)] * 2)
    read = Read(text)
    assert "script" not in read.tags
    assert "\x07" not in text
    shown = bad.replace("\x07", "\\x07")
    assert any(shown in word for word in read.words)
    assert not any("alert" in (value or "") for _, value in read.attributes)


def test_pictures_are_a_part_of_it_and_their_names_do_not_meet(file: Path) -> None:
    result = played(file, '[[step]]\nwait = "1 s"\n')
    text = page([Case(result, "", SVG), Case(result, "", SVG)])
    for number in (1, 2):
        assert f'<svg><g id="case-{number}-a" fill="url(#case-{number}-a)"/></svg>' in text
    assert "<?xml" not in text
    ids = [value for name, value in Read(text).attributes if name == "id"]
    assert len(ids) == len(set(ids))


def test_it_needs_nothing_but_itself(file: Path) -> None:
    text = page([Case(played(file, FAILS), "", SVG)])
    assert "://" not in text
    assert "default-src 'none'" in text


def test_those_that_failed_are_unfolded_and_all_are_listed(file: Path) -> None:
    failed, passed = played(file, FAILS), played(file, '[[step]]\nwait = "1 s"\n')
    read = Read(page([Case(passed, ""), Case(failed, "")]))
    assert sum(name == "open" for name, _ in read.attributes) == 1
    assert [value for name, value in read.attributes if name == "href"] == ["#case-1", "#case-2"]


def test_of_very_many_expectations_all_failures_and_some_are_told() -> None:
    result = Result(Scenario("x", (), ()), [Failure(10**9, "a", "b")])
    result.looked += [Met(number, "c") for number in range(MOST_ROWS + 5)]
    result.looked += result.failures
    words = Read(page([Case(result, "")])).words
    assert words.count("failed") == 1
    assert words.count("met") == MOST_ROWS - 1
    assert "… and 6 more that were met." in words


def test_why_there_is_no_picture_is_told(file: Path) -> None:
    result = played(file, '[[step]]\nwait = "1 s"\n')
    assert "no picture, as" in Read(page([Case(result, "", note="no picture, as")])).words


def test_the_same_run_is_the_same_page(file: Path) -> None:
    pages = {page([Case(played(file, FAILS), "x", SVG)]) for _ in range(2)}
    assert len(pages) == 1
