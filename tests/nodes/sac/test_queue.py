"""The queue: positions, what waits, and undo; values in, values out."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from nodes.sac.queue import CONTINUOUS_POSITION, THROW_AWAY_POSITION, Queue
from sacbus.language import QUEUE_LENGTH, Defaults, Motion, seeded_row

SEED = seeded_row(Defaults())


def motion(steps: int) -> Motion:
    return replace(SEED, steps=steps)


def steps(queue: Queue) -> list[int | None]:
    return [row.steps for row in queue.rows()]


def test_every_position_is_the_seeded_row_until_somebody_writes() -> None:
    queue = Queue(Defaults(sprf=400))
    assert queue.rows() == (seeded_row(Defaults(sprf=400)),) * QUEUE_LENGTH
    assert (queue.next_free, queue.pending, queue.waiting()) == (1, [], [])


def test_commands_go_round_and_wait_in_the_order_in_which_they_came() -> None:
    queue = Queue(Defaults())
    for number in range(1, 36):
        assert queue.add(motion(number)) is None
        assert queue.pending.pop(0) == (number - 1) % QUEUE_LENGTH + 1
    assert queue.next_free == 6
    assert steps(queue)[:7] == [31, 32, 33, 34, 35, 6, 7]


def test_the_31st_that_waits_takes_the_place_of_the_oldest_and_its_turn() -> None:
    queue = Queue(Defaults())
    for number in range(1, 31):
        assert queue.add(motion(number)) is None
    assert queue.add(motion(31)) == 1
    assert [one.steps for one in queue.waiting()] == [31, *range(2, 31)]
    assert queue.next_free == 2


def test_what_comes_behind_the_31st_goes_on_overwriting_and_runs_once() -> None:
    queue = Queue(Defaults())
    for number in range(1, 32):
        queue.add(motion(number))
    queue.pending.pop(0)
    assert queue.add(motion(32)) == 2
    assert queue.pending == [*range(2, 31)]
    assert [one.steps for one in queue.waiting()] == [32, *range(3, 31)]
    held = queue.pending.pop(0)
    assert queue.next_free == 3
    assert queue.put_back(held)


def test_a_held_command_that_was_overwritten_by_what_came_behind_the_31st_is_not_put_back() -> None:
    queue = Queue(Defaults())
    for number in range(1, 32):
        queue.add(motion(number))
    queue.pending.pop(0)
    held = queue.pending.pop(0)
    queue.add(motion(32))
    assert queue.pending == [*range(3, 31), held]
    assert not queue.put_back(held)
    assert queue.pending == [*range(3, 31), held]


def test_an_edit_makes_nothing_pending_and_moves_no_pointer() -> None:
    queue = Queue(Defaults())
    queue.write(9, motion(5))
    assert (queue.row(9).steps, queue.next_free, queue.pending) == (5, 1, [])


def test_hidden_positions_are_kept_apart() -> None:
    queue = Queue(Defaults())
    assert (queue.row(CONTINUOUS_POSITION), queue.row(THROW_AWAY_POSITION)) == (SEED, SEED)
    queue.continuous, queue.throw_away = motion(1), motion(2)
    assert (queue.row(0).steps, queue.row(31).steps) == (1, 2)
    assert queue.rows() == (SEED,) * QUEUE_LENGTH
    queue.load([motion(7)] * QUEUE_LENGTH)
    assert (queue.row(0).steps, queue.row(31).steps) == (1, 2)


def test_what_was_taken_from_the_head_waits_again_unless_it_was_overwritten() -> None:
    queue = Queue(Defaults())
    queue.add(motion(1))
    queue.add(motion(2))
    head = queue.pending.pop(0)
    assert queue.put_back(head)
    assert queue.pending == [1, 2]
    head = queue.pending.pop(0)
    for number in range(3, 32):
        queue.add(motion(number))
    assert queue.pending[-1] == 1
    assert not queue.put_back(head)


def test_undo_puts_back_the_position_written_last_and_undone_twice_is_as_it_was() -> None:
    queue = Queue(Defaults())
    assert queue.undo() is None
    queue.write(3, motion(5))
    queue.write(4, motion(6))
    assert queue.undo() == 4
    assert steps(queue)[2:4] == [5, SEED.steps]
    assert queue.undo() == 4
    assert steps(queue)[2:4] == [5, 6]


def test_an_undone_command_does_not_run_nor_does_what_stood_in_its_place() -> None:
    queue = Queue(Defaults())
    queue.add(motion(1))
    queue.add(motion(2))
    assert queue.undo() == 2
    assert (queue.pending, queue.next_free) == ([1], 2)
    # And does not come back by another undo.
    assert queue.undo() == 2
    assert (queue.pending, queue.next_free) == ([1], 2)


def test_an_undone_edit_of_a_pending_command_leaves_it_pending() -> None:
    queue = Queue(Defaults())
    queue.add(motion(1))
    queue.write(1, motion(9))
    queue.undo()
    assert [one.steps for one in queue.waiting()] == [1]


def test_an_undone_command_that_has_its_turn_already_is_only_put_back() -> None:
    queue = Queue(Defaults())
    queue.add(motion(1))
    queue.pending.pop(0)
    assert queue.undo() == 1
    assert (steps(queue)[0], queue.next_free, queue.pending) == (SEED.steps, 2, [])


def test_loaded_rows_replace_all_and_nothing_waits_or_can_be_undone() -> None:
    queue = Queue(Defaults())
    queue.add(motion(1))
    queue.load([motion(number) for number in range(30)])
    assert steps(queue) == list(range(30))
    assert (queue.pending, queue.next_free) == ([], 1)
    assert queue.undo() is None


@given(
    st.lists(
        st.sampled_from(["add", "take", "undo", "put back"])
        | st.tuples(st.just("write"), st.integers(1, 30))
    )
)
def test_whatever_is_done_what_waits_stands_in_a_row_behind_the_next_free_one(
    deeds: list[str | tuple[str, int]],
) -> None:
    queue = Queue(Defaults())
    taken: int | None = None
    for number, deed in enumerate(deeds):
        if isinstance(deed, tuple):
            queue.write(deed[1], motion(number + 1))
        elif deed == "add":
            queue.add(motion(number + 1))
        elif deed == "undo":
            queue.undo()
        elif deed == "take" and queue.pending:
            taken = queue.pending.pop(0)
        elif deed == "put back" and taken is not None and queue.pending[:1] == [taken % 30 + 1]:
            queue.put_back(taken)
            taken = None
        count = len(queue.pending)
        assert count <= QUEUE_LENGTH
        before = [(queue.next_free - 2 - at) % QUEUE_LENGTH + 1 for at in range(count)]
        if count < QUEUE_LENGTH:
            assert queue.pending == before[::-1]
        assert set(queue.pending) == set(before)
