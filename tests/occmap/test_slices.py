"""Computations in slices: the same result, a turn at a time."""

from __future__ import annotations

import pytest

from occmap import slices
from occmap.slices import Sliced, finish, take_turn


def counted(pieces: int, cost: int, done: list[int]) -> Sliced[int]:
    for k in range(pieces):
        done.append(k)
        yield cost
    return len(done)


def test_finished_at_once_it_returns_what_it_returns():
    assert finish(counted(5, 1_000_000, [])) == 5


@pytest.mark.parametrize(("cost", "done_after_turns"), [(100, [1, 2, 3, 3]), (60, [2, 3]), (1, [3])])
def test_a_turn_ends_once_enough_was_spent(monkeypatch, cost, done_after_turns):
    monkeypatch.setattr(slices, "TURN_CELLS", 100)
    done, after_turns = [], []
    sliced = counted(3, cost, done)
    is_over = False
    while not is_over:
        is_over = take_turn(sliced)
        after_turns.append(len(done))
    assert after_turns == done_after_turns


def test_what_fails_in_a_turn_is_not_hidden():
    def broken() -> Sliced[None]:
        yield 1
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        take_turn(broken())
