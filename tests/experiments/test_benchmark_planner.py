"""What the benchmark compares must compute the same."""

import numpy as np
import pytest

from experiments.benchmarking.c_twin import library_of
from experiments.benchmarking.planner import C_SOURCE, benchmark_planner, csgraph_flood, office, twin_search
from occmap.planner import Planner
from occmap.search import SearchMemory, SearchRequest


@pytest.fixture(scope="module")
def terrain():
    return Planner().terrain(*office(200, np.random.default_rng(0)))


def test_the_twin_in_c_and_scipy_find_the_costs_of_the_kernel(terrain):
    memory, start = SearchMemory(), terrain.flat((7, 7))
    request = SearchRequest.flood(terrain, None, None, np.inf)
    memory.search(terrain, start, terrain.prices, request)
    reached = memory.cost < 2**31 - 1
    assert reached.sum() > 10_000
    by_scipy = csgraph_flood(terrain, start)
    np.testing.assert_array_equal(np.isfinite(by_scipy), reached)
    np.testing.assert_array_equal(by_scipy[reached], memory.cost[reached])
    twin = library_of(C_SOURCE)
    if twin is None:
        pytest.skip("no C compiler")
    job = twin_search(twin, terrain, start, -1, request)
    np.testing.assert_array_equal(job(), memory.cost)
    np.testing.assert_array_equal(job(), memory.cost)


def test_the_twin_in_c_finds_the_same_way_by_a_star(terrain):
    twin = library_of(C_SOURCE)
    if twin is None:
        pytest.skip("no C compiler")
    memory, start, goal = SearchMemory(), terrain.flat((7, 7)), (192, 192)
    request = SearchRequest.towards(terrain, np.array([goal]))
    memory.search(terrain, start, terrain.prices, request)
    cost = twin_search(twin, terrain, start, terrain.flat(goal), request)()
    assert cost[terrain.flat(goal)] == memory.cost[terrain.flat(goal)]


def test_the_benchmark_runs():
    speed = benchmark_planner(size_cells=200, repeats=1)
    assert speed.cells_reached > 10_000
    assert speed.flood_ms > 0.0
