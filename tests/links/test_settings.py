"""The settings of a line, on a real pty."""

from __future__ import annotations

import os
import termios
from collections.abc import Iterator

import pytest

from sacbus.links.settings import LineSettings


@pytest.fixture
def slave() -> Iterator[int]:
    master, slave = os.openpty()
    yield slave
    os.close(slave)
    os.close(master)


def test_raw_means_no_flag_that_touches_a_byte(slave: int) -> None:
    LineSettings(slave).make_raw(38_400)
    iflag, oflag, cflag, lflag, _, _, characters = termios.tcgetattr(slave)
    assert (iflag, oflag, lflag) == (0, 0, 0)
    assert cflag & termios.CSIZE == termios.CS8
    assert not cflag & (termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
    assert cflag & termios.CREAD
    assert (characters[termios.VMIN], characters[termios.VTIME]) == (1, 0)


@pytest.mark.parametrize("rate", [1200, 9600, 19_200, 38_400, 57_600, 115_200, 2_000_000])
def test_a_usual_rate_is_told_as_it_was_set(slave: int, rate: int) -> None:
    settings = LineSettings(slave)
    settings.make_raw(rate)
    assert settings.baud() == rate
    assert termios.tcgetattr(slave)[5] == getattr(termios, f"B{rate}")


@pytest.mark.parametrize("rate", [31_250, 250_000])
def test_an_unusual_rate_is_set_and_told_where_the_system_can(slave: int, rate: int) -> None:
    settings = LineSettings(slave)
    settings.make_raw(rate)
    assert settings.baud() == rate
    assert termios.tcgetattr(slave)[3] == 0


def test_what_another_sets_is_told_at_once(slave: int) -> None:
    settings = LineSettings(slave)
    settings.make_raw(38_400)
    attributes = termios.tcgetattr(slave)
    attributes[4] = attributes[5] = termios.B9600
    termios.tcsetattr(slave, termios.TCSANOW, attributes)
    assert settings.baud() == 9600


@pytest.mark.parametrize("rate", [0, -1])
def test_no_rate_at_all_is_refused(slave: int, rate: int) -> None:
    with pytest.raises(ValueError, match=f"cannot set {rate} baud, expected one of"):
        LineSettings(slave).make_raw(rate)
