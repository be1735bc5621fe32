from __future__ import annotations

import re

import pytest

from examples import virtual_time


def test_ten_minutes_of_motion_end_where_they_were_sent(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert virtual_time.main([]) == 0
    first = capsys.readouterr().out
    lines = first.splitlines()
    # 17 bytes, 385 us and 6 further characters, 4 bytes.
    assert lines[0] == "node 10 acknowledged after 5.932 ms of bus time"
    assert [line.split(":")[0] for line in lines[1:11]] == [f"{n:2} min" for n in range(1, 11)]
    assert lines[11:13] == ["node 10 STANDBY at +240000", "node 11 STANDBY at -240000"]
    assert re.fullmatch(r"601\.0 s of bus time in \d+ ms", lines[13])
    # To the last pulse the same again; only the wall clock differs.
    assert virtual_time.main([]) == 0
    assert capsys.readouterr().out.splitlines()[:13] == lines[:13]
