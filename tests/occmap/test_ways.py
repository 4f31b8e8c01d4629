"""What ways cost is remembered, and is what a search from each place would find."""

from __future__ import annotations

import numpy as np
import pytest

from occmap import ways
from occmap.coarse_map import CoarseMap
from occmap.search import SearchMemory
from occmap.ways import TravelCosts
from tests.occmap.goal_scenes import Scene

FLOOR = "\n".join(["#" * 40, *["#" + 38 * "." + "#"] * 6, *["#" + 20 * "." + 18 * "#" + "#"] * 6, "#" * 40])
PLACES = [(2, 2), (2, 10), (18, 10), (18, 2), (36, 10)]


class Counted:
    """A coarse map, and how often it was searched."""

    def __init__(self, coarse):
        self.terrain, self._coarse, self.searches = coarse.terrain, coarse, 0

    def costs_m(self, start, blocks):
        self.searches += 1
        return self._coarse.costs_m(start, blocks)


@pytest.fixture
def scene():
    return Scene(FLOOR)


def coarse_and_blocks(scene):
    coarse = CoarseMap(scene.flood().terrain, SearchMemory())
    return Counted(coarse), np.array([coarse.block_near(cell) for cell in PLACES])


def test_ways_cost_what_a_search_from_each_place_finds(scene):
    coarse, blocks = coarse_and_blocks(scene)
    memory = TravelCosts()
    memory.open(coarse, blocks)
    direct = np.array([coarse.costs_m(int(block), blocks) for block in blocks])
    np.testing.assert_allclose(memory.between_m(range(5)), direct, atol=0.3)
    np.testing.assert_allclose(memory.from_one_m(1, [0, 3]), direct[1, [0, 3]], atol=0.3)


def test_only_what_is_new_is_searched_for(scene):
    coarse, blocks = coarse_and_blocks(scene)
    memory = TravelCosts()
    memory.open(coarse, blocks[:4])
    memory.between_m(range(4))
    before, coarse.searches = coarse.searches, 0
    memory.open(coarse, blocks)
    memory.between_m(range(5))
    assert (before, coarse.searches) == (4, 1)


@pytest.mark.parametrize("what", ["another map", "too many tours"])
def test_what_was_remembered_is_dropped_in_time(scene, what, monkeypatch):
    coarse, blocks = coarse_and_blocks(scene)
    memory = TravelCosts()
    memory.open(coarse, blocks)
    memory.between_m(range(5))
    if what == "another map":
        other = Scene(FLOOR.replace("#" * 40, "#" * 40 + "\n" + "#" * 40, 1))
        coarse, blocks = coarse_and_blocks(other)
    else:
        monkeypatch.setattr(ways, "TRUSTED_TOURS", 0)
    coarse.searches = 0
    memory.open(coarse, blocks)
    memory.between_m(range(5))
    assert coarse.searches > 0
