"""The tail of a line, in words."""

from __future__ import annotations

from sacbus.kernel import MS, SECOND
from sacbus.node import find_kind
from sacbus.scenario.line import KEPT, Line, Passed
from sacbus.wire import encode, nak


def line() -> Line:
    return Line(find_kind("sac").protocol)


def words(data: bytes, sender: int | str = "mother", **more: object) -> str:
    one = line()
    one.note(Passed(SECOND + MS, SECOND + 2 * MS, 0, sender, data, **more))  # type: ignore[arg-type]  # what a test gives
    (told,) = one.words(SECOND)
    return told


def test_a_packet_and_an_answer_read_in_words_with_the_time_since_the_beginning() -> None:
    assert words(encode(10, 1, b"m400")) == "0.001000 s  mother: to 10 'm400', move 400 full steps"
    assert words(encode(0, 1, b"y"), "link") == "0.001000 s  link: to all 'y', release sync"
    assert words(nak(1, 10), 10) == "0.001000 s  10: NAK to 1"


def test_what_is_wrong_with_it_is_said() -> None:
    damaged = encode(10, 1, b"m400").replace(b"4", b"5")
    assert words(damaged).endswith("move 500 full steps, CRC wrong")
    assert words(encode(10, 1, b"m1", crc=False)).endswith("move 1 full step, CRC unchecked")
    assert words(b"\x55\x55") == "0.001000 s  mother: 55 55"
    assert words(b"", faults=("drop",)) == "0.001000 s  mother: nothing, drop"
    told = words(encode(10, 1, b"S"), collided=True, faults=("delay",))
    assert told.endswith(", delay, collided")


def test_the_tail_is_bounded_and_watchers_are_told_of_each() -> None:
    one = line()
    told: list[Passed] = []
    one.watchers.append(told.append)
    for number in range(KEPT + 3):
        one.note(Passed(number, number + 1, 0, 10, b"x"))
    assert len(told) == KEPT + 3
    assert [passed.start for passed in one.tail] == list(range(3, KEPT + 3))


def test_a_watcher_may_leave_while_it_is_told() -> None:
    one = line()

    def leave(_passed: Passed) -> None:
        one.watchers.remove(leave)

    told: list[Passed] = []
    one.watchers += [leave, told.append]
    one.note(Passed(0, 1, 0, 10, b"x"))
    assert len(told) == 1
