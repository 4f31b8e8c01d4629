"""Numbers as people say them."""

from experiments.words import counted


def test_one_is_one_and_all_others_are_many():
    assert [counted(n, "frontier") for n in (0, 1, 2)] == ["0 frontiers", "1 frontier", "2 frontiers"]
