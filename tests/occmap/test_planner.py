"""The planner against scipy's Dijkstra, and what a body must and must not pass."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, gaussian_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from occmap.body import Body
from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from occmap.planner import Planner, PlannerConfig, WideningFlood
from occmap.search import SearchMemory, SearchRequest
from occmap.slices import finish
from tests.ascii_maps import ascii_grid


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
    distance = np.full(occupied.shape, np.inf)
    if occupied.any():
        distance = np.asarray(distance_transform_edt(~occupied))
    clearance = np.clip(distance * resolution_m - 0.5 * resolution_m, 0.0, 1.0)
    clearance[occupied] = 0.0
    return grid, clearance.astype(np.float32)


def costs_of(wave):
    """(ny, nx) metres to every cell."""
    ny, nx = wave.terrain.shape
    return wave.cost_at(np.argwhere(np.ones((ny, nx), bool))[:, ::-1]).reshape(ny, nx)


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
    np.testing.assert_allclose(costs_of(wave), expected, rtol=1e-6)
    reached = np.argwhere(np.isfinite(expected))[:, ::-1]
    for goal in reached[rng.integers(0, len(reached), 20)]:
        path = planner.plan(grid, clearance, (8, 8), goal[None])
        assert path is not None
        np.testing.assert_allclose(path.cost_m, expected[goal[1], goal[0]], rtol=1e-6)


def test_a_second_search_finds_the_same_after_the_first_was_forgotten():
    grid, clearance = believed(clutter(np.random.default_rng(7)))
    planner = Planner()
    first = costs_of(planner.flood(grid, clearance, (8, 8)))
    planner.flood(grid, clearance, (10, 10), within_m=0.5)
    planner.plan(grid, clearance, (8, 8), np.array([[9, 9]]))
    np.testing.assert_array_equal(costs_of(planner.flood(grid, clearance, (8, 8))), first)
    planner.release()
    np.testing.assert_array_equal(costs_of(planner.flood(grid, clearance, (8, 8))), first)


def test_a_map_that_grows_and_shrinks_is_searched_as_by_a_planner_new_to_it():
    planner = Planner()
    for n in (60, 70, 90, 130, 60, 40, 80, 200, 90):
        grid, clearance = believed(clutter(np.random.default_rng(n), n))
        expected = costs_of(Planner().flood(grid, clearance, (8, 8)))
        np.testing.assert_array_equal(costs_of(planner.flood(grid, clearance, (8, 8))), expected)


def test_a_flood_may_end_early_and_is_exact_where_it_got():
    grid, clearance = believed(clutter(np.random.default_rng(3)))
    planner = Planner()
    full = costs_of(planner.flood(grid, clearance, (8, 8)))
    bounded = planner.flood(grid, clearance, (8, 8), within_m=1.5)
    bounded_costs = costs_of(bounded)
    reached = np.isfinite(bounded_costs)
    assert not bounded.is_exhausted
    np.testing.assert_array_equal(bounded_costs[reached], full[reached])
    assert np.array_equal(reached, full <= bounded_costs[reached].max())
    assert 1.5 <= bounded_costs[reached].max() < 1.7


def test_a_search_may_end_when_its_targets_are_settled():
    grid, clearance = believed(clutter(np.random.default_rng(3)))
    planner, memory = Planner(), SearchMemory()
    full = costs_of(planner.flood(grid, clearance, (8, 8)))
    terrain = planner.terrain(grid, clearance)

    def costs_m(targets, want=None):
        request = SearchRequest.flood(terrain, np.array(targets), want, np.inf)
        memory.search(terrain, terrain.flat((8, 8)), terrain.prices, request)
        cost = memory.cost[[terrain.flat(target) for target in targets]]
        return cost * np.float32(terrain.metres_per_cost), memory.n_touched

    near, far = np.argwhere((full > 0.5) & (full < 0.6))[0][::-1], np.argwhere(np.isfinite(full))[-1][::-1]
    exact = full[[near[1], far[1]], [near[0], far[0]]]
    costs, n_touched = costs_m((near, far), want=1)
    assert costs[0] == exact[0]
    assert n_touched < np.isfinite(full).sum()
    np.testing.assert_array_equal(costs_m((near, far))[0], exact)


@pytest.mark.parametrize("seed", range(3))
def test_a_flood_widened_step_by_step_is_the_flood_from_the_beginning(seed):
    grid, clearance = believed(clutter(np.random.default_rng(seed)))
    here = Pose2(*grid.frame.centre_of(8, 8), 0.0)
    widening = WideningFlood(Planner(), grid, clearance, here)
    for within_m in (0.5, 2.0, 4.0, np.inf):
        wave, afresh = finish(widening(within_m)), Planner().flood(grid, clearance, (8, 8), within_m=within_m)
        assert wave.exact_below == afresh.exact_below
        np.testing.assert_array_equal(np.sort(wave.reached_cells()), np.sort(afresh.reached_cells()))
        np.testing.assert_array_equal(costs_of(wave), costs_of(afresh))
    assert wave.is_exhausted
    assert finish(widening(np.inf)) is wave
    way, afresh_way = (w.cells_to((60, 60)) for w in (wave, afresh))
    np.testing.assert_array_equal(way, afresh_way)


def test_a_wavefront_is_void_once_its_planner_has_searched_again():
    grid, clearance = believed(clutter(np.random.default_rng(3)))
    planner = Planner()
    wave = planner.flood(grid, clearance, (8, 8))
    planner.flood(grid, clearance, (9, 9))
    with pytest.raises(ValueError, match="void"):
        wave.path_to((9, 9))


def test_the_nearest_of_several_goals_is_chosen_and_none_is_none():
    grid, clearance = believed(clutter(np.random.default_rng(1)))
    planner = Planner()
    costs = costs_of(planner.flood(grid, clearance, (8, 8)))
    goals = np.argwhere(np.isfinite(costs))[:: costs.size // 20, ::-1]
    path = planner.plan(grid, clearance, (8, 8), goals)
    assert path is not None
    assert path.cost_m == pytest.approx(costs[goals[:, 1], goals[:, 0]].min())
    assert planner.plan(grid, clearance, (8, 8), np.array([[0, 0]])) is None
    assert planner.plan(grid, clearance, (8, 8), np.array([[500, -3]])) is None


@pytest.mark.parametrize("seed", range(4))
def test_a_straightened_path_is_shorter_and_as_safe(seed):
    grid, clearance = believed(clutter(np.random.default_rng(seed)))
    planner = Planner()
    wave = planner.flood(grid, clearance, (8, 8))
    goal = tuple(np.argwhere(np.isfinite(costs_of(wave)))[-1][::-1])
    cells, path = wave.cells_to(goal), wave.path_to(goal)
    assert cells is not None
    assert path is not None
    along = np.hypot(np.diff(cells % grid.shape[1]), np.diff(cells // grid.shape[1]))
    assert wave.length_to_m(goal) == pytest.approx(along.sum() * grid.frame.resolution_m)
    assert path.length_m <= wave.length_to_m(goal) + 1e-6
    tightest = clearance.ravel()[cells[1:]].min()
    assert planner.terrain(grid, clearance).least_clearance(path.waypoints_in_map, 0.0) >= tightest - 0.036


def open_room(nx, ny):
    occupied = np.zeros((ny, nx), bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    return occupied


def test_across_an_open_room_the_path_is_straight():
    grid, clearance = believed(open_room(160, 120))
    path = Planner().plan(grid, clearance, (40, 40), np.array([[110, 73]]))
    assert path is not None
    assert path.length_m == pytest.approx(0.05 * np.hypot(70, 33), rel=0.01)


def wall_with_gap(gap_cells, gap_at=30):
    occupied = open_room(100, 60)
    occupied[:, 50] = True
    occupied[gap_at : gap_at + gap_cells, 50] = False
    return occupied


def test_paths_keep_their_distance_where_there_is_room():
    grid, clearance = believed(wall_with_gap(24))
    path = Planner().plan(grid, clearance, (20, 10), np.array([[80, 10]]))
    assert path is not None
    along = np.linspace(0.0, path.length_m, 500)
    points = np.column_stack([np.interp(along, path.stations_m, path.waypoints_in_map[:, k]) for k in (0, 1)])
    ix, iy = grid.frame.cell_from_map(points).T
    assert clearance[iy, ix].min() >= 0.26
    assert path.keep_clear_m == pytest.approx(0.21)


@pytest.mark.parametrize(("gap_cells", "is_passed"), [(4, False), (5, True), (6, True), (7, True), (9, True)])
def test_a_gap_painted_narrower_than_the_body_is_still_tried(gap_cells, is_passed):
    """0.44 m lose up to 6 cm on either side to painting: 6 cells are left at worst; see PlannerConfig."""
    grid, clearance = believed(wall_with_gap(gap_cells))
    path = Planner().plan(grid, clearance, (20, 30), np.array([[80, 30]]))
    assert (path is not None) == is_passed


def test_a_detour_is_preferred_to_a_gap_narrower_than_comfortable():
    occupied = wall_with_gap(7)
    occupied[45:58, 50] = False
    grid, clearance = believed(occupied)
    path = Planner().plan(grid, clearance, (30, 20), np.array([[70, 20]]))
    assert path is not None
    assert path.length_m > 2.5  # 2.0 straight
    assert path.keep_clear_m == pytest.approx(0.21)


def bodiless():
    """A planner for a point: wherever a cell is free it goes, so that pictures may be small."""
    return Planner(PlannerConfig(comfortable_margin_m=0.002, keep_margin_m=0.0), Body(radius_m=0.001))


@pytest.mark.parametrize(
    ("picture", "is_reached"),
    [
        ("""..?..
            ..?..
            ..?..""", False),  # unknown is not free
        ("""..#..
            ..#..
            ....?""", True),
        ("""..#..
            .?#..
            ...#.""", False),  # a diagonal step needs both neighbours
        ("""...?.
            .....
            ?#?..""", True),
    ],
)  # fmt: skip
def test_unknown_cells_are_not_crossed_and_corners_are_not_cut(picture, is_reached):
    grid = ascii_grid(picture)
    clearance = believed(grid.state == Belief.OCCUPIED)[1]
    wave = bodiless().flood(grid, clearance, (0, 1))
    assert np.isfinite(wave.cost_at(np.array([[4, 1]]))[0]) == is_reached


def test_a_path_outlives_noise_and_is_void_when_something_stands_on_it():
    occupied = open_room(120, 60)
    grid, clearance = believed(occupied)
    planner = Planner()
    path = planner.plan(grid, clearance, (10, 30), np.array([[105, 30]]))
    assert path is not None
    assert not planner.is_blocked(path, grid, clearance)
    beside = occupied.copy()
    beside[35, 60] = True  # 0.225 m clear: less than comfortable, more than the body and 4 cm
    assert not planner.is_blocked(path, *believed(beside))
    beside[34, 60] = True
    assert planner.is_blocked(path, *believed(beside))
    assert not planner.is_blocked(path, *believed(beside), from_m=4.0)


def test_a_start_inside_inflation_leads_out_first():
    grid, clearance = believed(open_room(80, 60))
    planner = Planner()
    wave = planner.flood(grid, clearance, (1, 30))
    assert wave.escape_cells.size
    assert clearance[wave.start_cell[1], wave.start_cell[0]] >= 0.12
    path = wave.path_to((60, 30))
    assert path is not None
    assert grid.frame.cell_at(*path.waypoints_in_map[0]) == (1, 30)
    assert 0.15 < path.escape_m < 0.35
    assert not planner.is_blocked(path, grid, clearance)
    assert np.hypot(*np.subtract(wave.start_cell, (1, 30))) < 4
    assert not planner.flood(grid, clearance, (40, 30)).escape_cells.size


def test_an_escape_does_not_lead_through_a_wall():
    occupied = open_room(80, 60)
    occupied[:, 40] = True
    grid, clearance = believed(occupied)
    wave = Planner().flood(grid, clearance, (39, 30))
    assert wave.start_cell[0] < 39
    assert not np.isfinite(wave.cost_at(np.array([[60, 30]]))[0])


def test_from_an_island_made_by_noise_the_flood_starts_on_the_mainland():
    occupied = open_room(80, 60)
    unknown = np.zeros_like(occupied)
    unknown[25:36, 35:46] = True
    unknown[29:32, 39:42] = False
    grid, clearance = believed(occupied, unknown=unknown)
    wave = Planner().flood(grid, clearance, (40, 30))
    assert wave.escape_cells.size
    assert np.isfinite(wave.cost_at(np.array([[60, 30]]))[0])


def closet_round_the_bend():
    """A passage 4 cells wide (too narrow to plan in) leads round a wall, and out into a room of 3 m x 3 m."""
    occupied = open_room(100, 60)
    occupied[:24, :40] = True
    occupied[8:12, 10:28] = False  # there
    occupied[8:18, 24:28] = False  # round the bend
    occupied[14:18, 8:28] = False  # and back
    occupied[14:24, 8:12] = False  # and out
    return occupied


def test_a_way_out_of_clutter_is_forgiven_to_its_end_however_long_it_is():
    """Its end is within a metre as the crow flies, and farther by the way."""
    grid, clearance = believed(closet_round_the_bend())
    planner = Planner()
    wave = planner.flood(grid, clearance, (12, 10))
    assert wave.escape_cells.size
    path = wave.path_to((70, 45))
    assert path is not None
    assert path.escape_m > planner.config.escape_radius_m
    assert not planner.is_blocked(path, grid, clearance)


def test_a_way_off_an_island_is_forgiven_to_the_mainland_although_the_island_is_comfortable():
    occupied = open_room(100, 60)
    occupied[:, 24] = True
    occupied[29:31, 24] = False  # a gap of 0.1 m, as noise paints them
    occupied[[18, 42], :24] = True
    grid, clearance = believed(occupied)
    planner = Planner()
    wave = planner.flood(grid, clearance, (12, 30))
    path = wave.path_to((70, 30))
    assert path is not None
    assert clearance[30, 12] > 0.26
    assert not planner.is_blocked(path, grid, clearance)


def noisy_clutter(rng, nx=70, ny=60):
    """Blobs of obstacles, and of the unknown among them: ways out of every kind."""
    occupied = open_room(nx, ny)
    occupied |= blobs(rng, occupied.shape, rng.uniform(1.0, 3.0)) > rng.uniform(0.8, 1.6)
    return occupied, (blobs(rng, occupied.shape, 1.0) > 1.8) & ~occupied


def blobs(rng, shape, size):
    """(ny, nx) smooth noise of unit variance."""
    field = gaussian_filter(rng.normal(size=shape), size)
    return field / field.std()


@pytest.mark.parametrize("seed", [11, 17, 30, 32])
def test_no_path_is_blocked_as_it_was_planned(seed):
    """Else it would be planned anew at every scan, and nobody would ever drive it."""
    rng = np.random.default_rng(seed)
    occupied, unknown = noisy_clutter(rng)
    grid, clearance = believed(occupied, unknown=unknown)
    places = np.argwhere(~occupied)[:, ::-1]
    planner = Planner()
    for start in places[rng.integers(len(places), size=8)].tolist():
        wave = planner.flood(grid, clearance, tuple(start))
        for goal in places[rng.integers(len(places), size=20)].tolist():
            path = wave.path_to(tuple(goal))
            assert path is None or not planner.is_blocked(path, grid, clearance)


def test_a_closed_closet_is_not_taken_for_an_island():
    occupied = open_room(80, 60)
    occupied[20:41, 30] = occupied[20:41, 50] = occupied[20, 30:51] = occupied[40, 30:51] = True
    grid, clearance = believed(occupied)
    wave = Planner().flood(grid, clearance, (40, 30))
    assert not wave.escape_cells.size
    assert wave.is_exhausted
    assert not np.isfinite(wave.cost_at(np.array([[10, 10]]))[0])


@pytest.mark.parametrize("resolution_m", [0.02, 0.05, 0.1, 0.2])
def test_a_doorway_is_passed_at_every_resolution(resolution_m):
    n = round(4.0 / resolution_m)
    occupied = open_room(n, n)
    occupied[:, n // 2] = True
    half = round(0.35 / resolution_m)
    occupied[n // 2 - half : n // 2 + half, n // 2] = False
    grid, clearance = believed(occupied, resolution_m)
    goal = grid.frame.cell_from_map(np.array([[3.2, 2.0]]))
    assert Planner().plan(grid, clearance, grid.frame.cell_at(0.8, 2.0), goal) is not None


def test_nonsense_is_refused():
    with pytest.raises(ValueError, match="radius_m must be positive, got -1"):
        Body(radius_m=-1.0)
    with pytest.raises(ValueError, match="keep_margin_m < comfortable_margin_m"):
        PlannerConfig(keep_margin_m=0.2)
    grid, clearance = believed(open_room(20, 20))
    with pytest.raises(ValueError, match="outside the grid"):
        Planner().flood(grid, clearance, (20, 3))
    with pytest.raises(ValueError, match="must match the grid"):
        Planner().flood(grid, clearance[1:], (3, 3))
