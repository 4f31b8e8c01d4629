"""How fast the planner searches, beside the same search in C and beside what else Python offers."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from experiments.benchmarking.c_twin import library_of
from experiments.benchmarking.rivals import milliseconds, path_rivals
from occmap.grid import GridConfig, OccupancyGrid
from occmap.planner import Planner
from occmap.search import SearchMemory, SearchRequest
from occmap.terrain import Terrain

C_SOURCE = Path(__file__).with_name("planner.c")
Job = Callable[[], object]


@dataclass(frozen=True)
class PlannerSpeed:
    """Medians over one run in which all took turns; CPU milliseconds."""

    cells_reached: int
    flood_ms: float
    a_star_ms: float
    flood_in_c_ms: float | None
    """None where no C compiler is found."""
    a_star_in_c_ms: float | None
    csgraph_ms: float
    """scipy's Dijkstra to all cells, the graph's building included."""
    rivals_ms: dict[str, float | None]
    """What others take for the way of a_star_ms."""


def benchmark_planner(size_cells: int = 800, seed: int = 0, repeats: int = 7) -> PlannerSpeed:
    """Cost from one corner of an office-like map to everywhere, and the way to the opposite corner."""
    grid, clearance_m = office(size_cells, np.random.default_rng(seed))
    planner = Planner()
    terrain = planner.terrain(grid, clearance_m)
    start, goal = (7, 7), (size_cells - 8, size_cells - 8)
    flood = SearchRequest.flood(terrain, None, None, np.inf)
    a_star = SearchRequest.towards(terrain, np.array([goal]))
    memory = SearchMemory()
    jobs: dict[str, Job] = {
        "flood": lambda: memory.search(terrain, terrain.flat(start), terrain.prices, flood),
        "a_star": lambda: memory.search(terrain, terrain.flat(start), terrain.prices, a_star),
        "csgraph": lambda: csgraph_flood(terrain, terrain.flat(start)),
    }
    twin = library_of(C_SOURCE)
    if twin is not None:
        jobs["flood_in_c"] = twin_search(twin, terrain, terrain.flat(start), -1, flood)
        jobs["a_star_in_c"] = twin_search(twin, terrain, terrain.flat(start), terrain.flat(goal), a_star)
    spent = in_turns(jobs, repeats)

    weights = np.where(prices_of(terrain) > 0, prices_of(terrain) / 1024.0, np.inf).astype(np.float32)
    wave = planner.flood(grid, clearance_m, start)
    if wave.path_to(goal) is None:
        raise ValueError(f"the corners of the office of seed {seed} are not connected: choose another seed")
    return PlannerSpeed(
        cells_reached=wave.n_reached,
        flood_ms=spent["flood"],
        a_star_ms=spent["a_star"],
        flood_in_c_ms=spent.get("flood_in_c"),
        a_star_in_c_ms=spent.get("a_star_in_c"),
        csgraph_ms=spent["csgraph"],
        rivals_ms=milliseconds(path_rivals(weights, start, goal), 1),
    )


def in_turns(jobs: dict[str, Job], repeats: int) -> dict[str, float]:
    """Median CPU milliseconds of each job; they take turns, so that a busy machine slows all alike."""
    spent: dict[str, list[float]] = {name: [] for name in jobs}
    for job in jobs.values():
        job()
    for _ in range(repeats):
        for name, job in jobs.items():
            begun = time.thread_time()
            job()
            spent[name].append(1e3 * (time.thread_time() - begun))
    return {name: float(np.median(times)) for name, times in spent.items()}


def office(size_cells: int, rng: np.random.Generator) -> tuple[OccupancyGrid, NDArray[np.float32]]:
    """Rooms 5 m square with two doors a wall, and 5 cm clutter: a fully known belief and its clearance."""
    from scipy.ndimage import distance_transform_edt

    n, room, door = size_cells, 100, 18
    wall = np.zeros((n, n), bool)
    wall[::room] = wall[:, ::room] = wall[-1] = wall[:, -1] = True
    for k in range(room, n - 1, room):
        for begin in range(0, n - room + 1, room):
            a, b = begin + rng.integers(10, room - 2 * door, 2)
            wall[k, a : a + door] = False
            wall[b : b + door, k] = False
    for y, x in rng.integers(20, n - 20, (n * n // 1000, 2)):
        wall[y : y + rng.integers(1, 9), x : x + rng.integers(1, 9)] = True
    grid = OccupancyGrid(GridConfig())
    grid.grow_to_contain((0.0, 0.0), ((n - 0.5) * 0.05, (n - 0.5) * 0.05))
    grid.state[:] = np.where(wall, 2, 1)
    distance_m = np.asarray(distance_transform_edt(~wall)) * 0.05 - 0.025
    return grid, np.clip(distance_m, 0.0, 1.0).astype(np.float32)


def prices_of(terrain: Terrain) -> NDArray[np.int32]:
    """(ny, nx) what entering each cell costs, by the planner's price list; 0 where the body does not go."""
    prices = terrain.prices.reshape(3, -1)
    column = np.minimum((terrain.clearance_m * 200 + 0.02).astype(int), prices.shape[1] - 1)
    return prices[terrain.state, column]


def csgraph_flood(terrain: Terrain, start: int) -> NDArray[np.float64]:
    """(ny * nx,) costs to all cells by scipy: the same steps and prices as a sparse graph, then Dijkstra."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    price = prices_of(terrain)
    ny, nx = price.shape
    cells = np.arange(ny * nx).reshape(ny, nx)
    ends: list[tuple[NDArray, NDArray, NDArray]] = []
    for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1)):
        here = np.s_[max(-dy, 0) : ny - max(dy, 0), max(-dx, 0) : nx - max(dx, 0)]
        there = np.s_[max(dy, 0) : ny + min(dy, 0), max(dx, 0) : nx + min(dx, 0)]
        corners = (
            price[there[0], here[1]] * price[here[0], there[1]] > 0
            if dx * dy
            else np.ones_like(price[here], bool)
        )
        allowed = (price[there] > 0) & corners
        step = price[there].astype(np.int64) * (1448 if dx * dy else 1024) >> 10
        ends.append((cells[here][allowed], cells[there][allowed], step[allowed]))
    rows, columns, costs = (np.concatenate(parts) for parts in zip(*ends, strict=True))
    graph = coo_array((costs.astype(float), (rows, columns)), shape=(ny * nx, ny * nx)).tocsr()
    return dijkstra(graph, indices=start)


def twin_search(twin: ctypes.CDLL, terrain: Terrain, start: int, target: int, request: SearchRequest) -> Job:
    """A job that runs the C search in arrays of its own and cleans up after itself, as SearchMemory does."""
    ny, nx = terrain.shape
    n = nx * ny
    cost, link, touched = np.full(n, 2**31 - 1, np.int32), np.zeros(n, np.uint8), np.empty(n, np.int32)
    ring = 4096
    heads, items = np.empty(ring, np.int32), np.empty((1 << 16, 2), np.int32)
    box = np.array(request.box, np.int64)
    n_touched = 0

    def at(array: NDArray) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def number(value: int) -> ctypes.c_int64:
        return ctypes.c_int64(value)

    twin.search.restype = ctypes.c_int64

    def job() -> NDArray[np.int32]:
        nonlocal n_touched
        cost[touched[:n_touched]] = 2**31 - 1
        n_touched = twin.search(
            at(terrain.state), at(terrain.clearance_m), number(nx), number(ny), at(terrain.prices),
            number(terrain.prices.size // 3), number(start), number(target), at(box),
            number(request.bucket_bits), at(cost), at(link), at(touched), at(heads), number(ring), at(items),
            number(len(items)),
        )  # fmt: skip
        if n_touched < 0:
            raise MemoryError(f"{len(items)} entries are too few for the queue of the C search")
        return cost

    return job
