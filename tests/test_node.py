"""The contract's own arithmetic, the settings of a kind, and the registry of kinds."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nodes.sac import KIND, SacSettings
from sacbus.bus import Bus
from sacbus.kernel import Kernel, LineRate
from sacbus.node import (
    Heard,
    KindError,
    NodeSettings,
    Report,
    ReportKind,
    SettingError,
    find_kind,
    kind_names,
    kinds,
    misfits,
    setting_list,
    settings_from,
)

# ---- what a node hears --------------------------------------------------------------------------


def test_bytes_heard_have_the_times_of_their_places_in_the_transmission() -> None:
    rate = LineRate()
    heard = Heard(b"\x03\xa5", start=1_000_000, first=7, rate=rate, following=b"\x00")
    assert heard.begins(0) == 1_000_000 + rate.span(7)
    assert heard.ends(0) == heard.begins(1) == 1_000_000 + rate.span(8)
    assert heard.ends(1) == 1_000_000 + rate.span(9)


@given(st.integers(0, 9), st.integers(0, 9), st.integers(-500_000, 6_000_000))
def test_a_byte_counts_as_begun_once_its_start_bit_has(first: int, size: int, moment: int) -> None:
    heard = Heard(bytes(size), 0, first, LineRate(), b"")
    assert heard.begun_before(moment) == sum(heard.begins(at) < moment for at in range(size))


@pytest.mark.parametrize(
    ("report", "text"),
    [
        (
            Report(5, 10, ReportKind.REFUSED, "the line does nothing", "mx", 2),
            "node 10: refused in 'mx', column 2: the line does nothing",
        ),
        (Report(5, 10, ReportKind.OVERRUN, "overwritten"), "node 10: queue overrun: overwritten"),
    ],
)
def test_a_report_reads_as_a_sentence_with_its_place(report: Report, text: str) -> None:
    assert str(report) == text


# ---- settings -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class KilnSettings(NodeSettings):
    fuel: str = field(default="gas", metadata={"choices": ("gas", "wood"), "help": "what burns"})
    lit: bool = field(default=False, metadata={"help": "burns at once"})
    chimneys: int = field(default=1, metadata={"low": 0, "high": 3, "help": "how many"})


def test_settings_given_are_taken_and_the_others_are_the_defaults() -> None:
    assert settings_from(KilnSettings, {}) == KilnSettings()
    assert settings_from(KilnSettings, {"fuel": "wood", "lit": True, "chimneys": 3}) == (
        KilnSettings("wood", True, 3)
    )


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({"colour": 1}, "setting 'colour': expected one of fuel, lit, chimneys"),
        ({"fuel": "coal"}, "setting 'fuel': expected gas or wood, got 'coal'"),
        ({"fuel": 1}, "setting 'fuel': expected gas or wood, got 1"),
        ({"fuel": ["gas"]}, "setting 'fuel': expected gas or wood, got ['gas']"),
        ({"lit": 1}, "setting 'lit': expected true or false, got 1"),
        ({"lit": "true"}, "setting 'lit': expected true or false, got 'true'"),
        ({"chimneys": -1}, "setting 'chimneys': expected a whole number from 0 to 3, got -1"),
        ({"chimneys": 4}, "setting 'chimneys': expected a whole number from 0 to 3, got 4"),
        ({"chimneys": True}, "setting 'chimneys': expected a whole number from 0 to 3, got True"),
        ({"chimneys": 1.0}, "setting 'chimneys': expected a whole number from 0 to 3, got 1.0"),
        ({"chimneys": None}, "setting 'chimneys': expected a whole number from 0 to 3, got None"),
    ],
)
def test_a_setting_that_does_not_fit_is_named_with_what_was_expected(
    given: dict[str, object], expected: str
) -> None:
    with pytest.raises(SettingError) as refused:
        settings_from(KilnSettings, given)
    assert str(refused.value) == expected
    assert isinstance(refused.value, ValueError)


def test_the_first_setting_that_does_not_fit_is_the_one_that_is_named() -> None:
    with pytest.raises(SettingError, match="'lit'"):
        settings_from(KilnSettings, {"chimneys": 2, "lit": 0, "fuel": 0})


def test_all_that_does_not_fit_is_told_at_once_with_what_was_expected() -> None:
    assert misfits(KilnSettings, {"lit": 1, "fuel": "gas", "colour": 1, "chimneys": 4}) == {
        "lit": "true or false",
        "colour": "one of fuel, lit, chimneys",
        "chimneys": "a whole number from 0 to 3",
    }
    assert misfits(KilnSettings, {"fuel": "wood", "lit": True}) == {}


def test_settings_are_listed_with_all_that_a_help_text_needs() -> None:
    assert [dataclasses.astuple(setting) for setting in setting_list(KilnSettings)] == [
        ("fuel", "gas", "gas or wood", "what burns"),
        ("lit", False, "true or false", "burns at once"),
        ("chimneys", 1, "a whole number from 0 to 3", "how many"),
    ]


def test_every_setting_of_a_sac_takes_its_own_default() -> None:
    defaults = {setting.name: setting.default for setting in setting_list(SacSettings)}
    assert settings_from(SacSettings, defaults) == SacSettings()


# ---- the registry -------------------------------------------------------------------------------


def install(site: Path, entries: str, *, module: str = "", name: str = "thirdparty") -> None:
    """What pip leaves behind for a package with entry points of our group."""
    about = site / f"{name}-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[sacbus.nodes]\n{entries}\n")
    if module:
        (site / f"{name}.py").write_text(module)


def test_the_projects_own_kind_is_found_by_its_entry_point() -> None:
    assert find_kind("sac") is KIND
    assert kinds()["sac"] is KIND
    assert "sac" in kind_names()


def test_a_kind_that_is_not_installed_is_answered_with_those_that_are() -> None:
    with pytest.raises(KindError) as missing:
        find_kind("sca")
    assert str(missing.value).startswith("node kind 'sca' is not installed; installed kinds: ")
    assert "sac" in str(missing.value).rpartition(":")[2].replace(",", "").split()
    assert isinstance(missing.value, LookupError)


def test_a_third_partys_kind_is_found_and_hosted_no_differently(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(
        tmp_path,
        "quiet = quietkind:KIND",
        name="quietkind",
        module=(
            "from nodes.sac import KIND as SAC, SacSettings\n"
            "class Quiet:\n"
            "    name, summary = 'quiet', 'a SAC that never answers'\n"
            "    protocol, settings = SAC.protocol, SacSettings\n"
            "    def create(self, address, settings, rate, tell):\n"
            "        return SAC.create(address, SacSettings(ack=False), rate, tell)\n"
            "KIND = Quiet()\n"
        ),
    )
    monkeypatch.syspath_prepend(tmp_path)
    names = list(kinds())
    assert {"quiet", "sac"} <= set(names)
    assert names == sorted(names)
    kind = find_kind("quiet")
    bus = Bus(Kernel(), kind.protocol)
    bus.add(kind.create(10, settings_from(kind.settings, {}), bus.rate, bus.tell))
    assert [node.address for node in bus.nodes] == [10]


@pytest.mark.parametrize(
    ("entry", "module", "why"),
    [
        ("kiln = kiln:KIND", "", "ModuleNotFoundError"),
        ("kiln = kiln:KIND", "OTHER = 1\n", "AttributeError"),
        ("kiln = kiln:KIND", "1 / 0\n", "ZeroDivisionError"),
    ],
)
def test_a_kind_that_cannot_be_loaded_is_named_with_its_cause_and_the_others_still_work(
    entry: str, module: str, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, entry, name="kiln", module=module)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "kiln", raising=False)
    for ask in (lambda: find_kind("kiln"), kinds):
        with pytest.raises(KindError) as broken:
            ask()
        message = str(broken.value)
        assert message.startswith("node kind 'kiln' (kiln:KIND) cannot be loaded: ")
        assert why in message
        assert message.endswith("mend or uninstall its package")
        assert broken.value.__cause__ is not None
    assert {"kiln", "sac"} <= set(kind_names())
    assert find_kind("sac") is KIND
