"""The planner against scipy's Dijkstra, and what a body must and must not pass."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.planner import Planner, PlannerConfig


def believed(occupied, resolution_m=0.05, unknown=None):
    """A grid that holds the picture (row 0 the lowest), and its clearance."""
    occupied = np.asarray(occupied, bool)
    grid = OccupancyGrid(GridConfig(resolution_m=resolution_m))
    ny, nx = occupied.shape
    grid.grow_to_contain((0.0, 0.0), ((nx - 0.5) * resolution_m, (ny - 0.5) * resolution_m))
    assert grid.shape == occupied.shape
    grid.state[:] = np.where(occupied, Belief.OCCUPIED, Belief.FREE)
    if unknown is not None:
        grid.state[unknown] = Belief.UNKNOWN
    distance = distance_transform_edt(~occupied) if occupied.any() else np.full(occupied.shape, np.inf)
    clearance = np.clip(distance * resolution_m - 0.5 * resolution_m, 0.0, 1.0)
    clearance[occupied] = 0.0
    return grid, clearance.astype(np.float32)


def clutter(rng, n=90):
    """Walls around a square with random blocks and a few long walls."""
    occupied = np.zeros((n, n), bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    for _ in range(10):
        y, x = rng.integers(2, n - 12, 2)
        occupied[y : y + rng.integers(1, 12), x : x + rng.integers(1, 12)] = True
    occupied[2:14, 2:14] = False
    return occupied


def dijkstra_costs(planner, grid, clearance, start):
    """The twin: scipy's Dijkstra over the same steps and prices, in integers of the kernel's unit."""
    terrain = planner.terrain(grid, clearance)
    prices = terrain.prices.reshape(3, -1)
    column = np.minimum((clearance * 200 + 0.02).astype(int), prices.shape[1] - 1)
    price = prices[grid.state, column]
    ny, nx = price.shape
    iy, ix = np.mgrid[:ny, :nx]
    rows, cols, costs = [], [], []
    for dx, dy in [(1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)]:
        jx, jy = ix + dx, iy + dy
        ok = (jx >= 0) & (jy >= 0) & (jx < nx) & (jy < ny)
        a, b = (iy[ok], ix[ok]), (jy[ok], jx[ok])
        step = price[b] if dx * dy == 0 else price[b] * 1448 >> 10
        allowed = (price[b] > 0) & (price[a[0], b[1]] > 0) & (price[b[0], a[1]] > 0)
        rows.append((a[0] * nx + a[1])[allowed])
        cols.append((b[0] * nx + b[1])[allowed])
        costs.append(step[allowed])
    graph = coo_array(
        (np.concatenate(costs), (np.concatenate(rows), np.concatenate(cols))), shape=(ny * nx,) * 2
    )
    return dijkstra(graph.tocsr(), indices=start[1] * nx + start[0]).reshape(ny, nx)


@pytest.mark.parametrize("seed", range(5))
def test_flood_and_a_star_cost_what_dijkstra_says(seed):
    rng = np.random.default_rng(seed)
    grid, clearance = believed(clutter(rng))
    planner = Planner()
    expected = dijkstra_costs(planner, grid, clearance, (8, 8)) * 0.05 / 1024
    wave = planner.flood(grid, clearance, (8, 8))
    assert wave.is_exhausted
    np.testing.assert_allclose(wave.cost_m, expected, rtol=1e-6)
    reached = np.argwhere(np.isfinite(expected))[:, ::-1]
    for goal in reached[rng.integers(0, len(reached), 20)]:
        path = planner.plan(grid, clearance, (8, 8), goal[None])
        assert path is not None
        np.testing.assert_allclose(path.cost_m, expected[goal[1], goal[0]], rtol=1e-6)
