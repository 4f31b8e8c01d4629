"""Frontiers: the free edge of the unknown, whole and kept in step."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from occmap.frontiers import Frontier, FrontierConfig, FrontierMap
from occmap.grid import SOLID_HITS, Belief, OccupancyGrid
from occmap.mapper import GridChange
from tests.ascii_maps import ascii_grid, cells, grid_of

TEXTBOOK = FrontierConfig(ignore_rim=False)
UNSPLIT = FrontierConfig(max_extent_m=np.inf)


def frontier_twin(grid: OccupancyGrid, ignore_rim: bool, ignore_struck: bool) -> np.ndarray:
    """The NumPy twin of the mask: free cells with an unknown 4-neighbour; beyond the array all is unknown."""
    padded = np.pad(grid.state, 2, constant_values=Belief.UNKNOWN)
    square, hits = np.ones((3, 3), int), np.pad(grid.hits, 2)
    in_a_row = (hits > 0) & (ndimage.convolve((hits > 0).astype(int), square, mode="constant") >= 3)
    struck = (hits >= SOLID_HITS) | (in_a_row & ignore_struck)
    unknown = (padded == Belief.UNKNOWN) & ~struck
    if ignore_rim:
        unknown &= ~ndimage.binary_dilation((padded == Belief.OCCUPIED) | struck, square)
        blank = (padded == Belief.UNKNOWN).astype(int)
        unknown &= ndimage.convolve(blank, square, mode="nearest") > 3
    edge = ndimage.binary_dilation(unknown, ndimage.generate_binary_structure(2, 1))
    return (edge & (padded == Belief.FREE) & ~struck)[2:-2, 2:-2]


def mapped(grid: OccupancyGrid, config: FrontierConfig | None = None) -> FrontierMap:
    frontiers = FrontierMap(config)
    frontiers.rebuild(grid)
    return frontiers


def neighbours(cell: tuple[int, int]) -> set[tuple[int, int]]:
    ix, iy = cell
    return {(ix - 1, iy), (ix + 1, iy), (ix, iy - 1), (ix, iy + 1)}


def partition(found: list[Frontier]) -> set[frozenset[tuple[int, int]]]:
    return {frozenset(map(tuple, frontier.cells.tolist())) for frontier in found}


def test_lesson_example_three_cells_one_region():
    # rows and columns as in the lesson's table: (row, column), row 0 on top
    grid = ascii_grid("""###??
                         #..??
                         #...?
                         #..??
                         ###??""")
    frontiers = mapped(grid, TEXTBOOK)
    row_column = {(4 - iy, ix) for ix, iy in cells(frontiers.mask)}
    assert row_column == {(1, 2), (2, 3), (3, 2)}
    (region,) = frontiers.clusters(grid)
    assert region.size == 3
    x_m, y_m = region.centroid_in_map
    column, row = x_m / 0.05 - 0.5, 4 - (y_m / 0.05 - 0.5)
    assert (row, column) == pytest.approx((2.0, 7.0 / 3.0))


def test_unknown_beside_a_wall_makes_no_frontier():
    grid = ascii_grid("""########
                         #......#
                         #..??..#
                         #..??..#
                         #......#
                         #.....?#
                         #......#
                         ########""")
    in_the_open, on_the_wall = {(3, 4), (4, 4), (3, 5), (4, 5)}, (6, 2)
    assert all(grid.state[iy, ix] == Belief.UNKNOWN for ix, iy in (*in_the_open, on_the_wall))
    around = set().union(*map(neighbours, in_the_open)) - in_the_open
    assert cells(mapped(grid).mask) == around
    assert cells(mapped(grid, TEXTBOOK).mask) == around | neighbours(on_the_wall) - {(7, 2)}


def test_what_beams_left_out_between_them_makes_no_frontier():
    """Far off, beams lie more than a cell apart: unknown lines one cell wide are left, and specks."""
    grid = ascii_grid("""#########
                         #.......#
                         #.?.....#
                         #....???#
                         #.......#
                         #########""")
    assert cells(mapped(grid).mask) == set()
    assert neighbours((2, 3)) <= cells(mapped(grid, TEXTBOOK).mask)


def test_a_wall_one_cell_thick_leaks_no_frontier():
    grid = ascii_grid("""????????
                         ??####??
                         ??#..#??
                         ??#..#??
                         ??####??
                         ????????""")
    assert not mapped(grid).mask.any()
    assert not mapped(grid, TEXTBOOK).mask.any()


def test_a_wall_one_cell_thick_and_slanted_leaks_no_frontier():
    grid = ascii_grid("""#####???
                         #..#????
                         #.#?????
                         ##??????
                         ????????""")
    assert not mapped(grid).mask.any()
    assert not mapped(grid, TEXTBOOK).mask.any()


def test_a_doorway_of_three_cells_is_a_frontier():
    grid = ascii_grid("""########???
                         #......#???
                         #..........
                         #.........?
                         #..........
                         #......#???
                         ########???""")
    assert (9, 3) in cells(mapped(grid).mask)


def test_a_wall_that_grazing_beams_have_eaten_away_makes_no_frontier():
    """Beams along a wall free the cells that it only enters: a hole opens on what no beam will ever reach."""
    grid = ascii_grid("""???????????
                         ####....###
                         ...........
                         ...........
                         ###########""")
    assert cells(mapped(grid).mask) == {(5, 3), (6, 3)}
    for hits in (SOLID_HITS, 1):
        grid.hits[3, 4:8] = hits
        assert cells(mapped(grid).mask) == set()
    grid.hits[3, 4:8] = 0, 0, SOLID_HITS - 1, 0  # a stray return now and then does not close a door
    assert cells(mapped(grid).mask) == {(5, 3), (6, 3)}


def test_beyond_the_array_everything_is_unknown():
    assert cells(mapped(grid_of(np.full((3, 3), Belief.FREE, np.uint8))).mask) == {
        (x, y) for x in range(3) for y in range(3)
    } - {(1, 1)}


@pytest.mark.parametrize(("ignore_rim", "ignore_struck"), [(False, False), (False, True), (True, True)])
def test_kernel_equals_its_twin_and_updates_equal_a_fresh_start(ignore_rim: bool, ignore_struck: bool):
    rng = np.random.default_rng(1)
    config = FrontierConfig(ignore_rim, ignore_struck, max_extent_m=np.inf)
    grid = grid_of(rng.choice(3, (40, 50), p=[0.2, 0.7, 0.1]).astype(np.uint8))
    frontiers = mapped(grid, config)
    np.testing.assert_array_equal(frontiers.mask, frontier_twin(grid, ignore_rim, ignore_struck))
    for _ in range(20):
        flat = rng.choice(grid.state.size, 30, replace=False).astype(np.int32)
        was = grid.state.ravel()[flat]
        grid.state.ravel()[flat] = rng.integers(0, 3, 30)
        now_struck = rng.choice(np.flatnonzero(grid.hits.ravel() == 0), 40, replace=False).astype(np.int32)
        grid.hits.ravel()[now_struck] = rng.choice([1, SOLID_HITS], 40, p=[0.9, 0.1])
        frontiers.update(grid, GridChange(False, flat, was, grid.state, now_struck))
        np.testing.assert_array_equal(frontiers.mask, frontier_twin(grid, ignore_rim, ignore_struck))
        assert partition(frontiers.clusters(grid)) == partition(mapped(grid, config).clusters(grid))


def test_clusters_are_the_8_connected_components():
    rng = np.random.default_rng(2)
    grid = grid_of(rng.choice(3, (60, 60), p=[0.1, 0.85, 0.05]).astype(np.uint8))
    frontiers = mapped(grid, UNSPLIT)
    found = frontiers.clusters(grid)
    labels, count = ndimage.label(frontiers.mask, np.ones((3, 3)))
    assert partition(found) == {frozenset(cells(labels == k)) for k in range(1, count + 1)}
    for frontier in found:
        assert frontier.size == len(frontier.cells)
        np.testing.assert_allclose(
            frontier.centroid_in_map, grid.frame.map_from_cell(frontier.cells).mean(axis=0), atol=1e-9
        )


def test_clustering_leaves_the_mask_as_it_was():
    grid = grid_of(np.random.default_rng(3).choice(3, (30, 200), p=[0.3, 0.6, 0.1]).astype(np.uint8))
    frontiers = mapped(grid, FrontierConfig(max_extent_m=0.5))
    before = frontiers.mask.copy()
    frontiers.clusters(grid)
    np.testing.assert_array_equal(frontiers.mask, before)


def test_long_frontiers_are_cut_into_connected_pieces_none_too_long():
    state = np.full((300, 300), Belief.UNKNOWN, np.uint8)
    iy, ix = np.indices(state.shape)
    state[np.hypot(ix - 150, iy - 150) < 120] = Belief.FREE  # one ring of frontier, 37 m around
    grid = grid_of(state)
    found = mapped(grid, FrontierConfig(max_extent_m=3.0)).clusters(grid)
    assert 12 <= len(found) <= 40
    assert sum(frontier.size for frontier in found) == int(mapped(grid).mask.sum())
    for frontier in found:
        assert np.ptp(frontier.cells, axis=0).max() < 60
        piece = np.zeros(state.shape)
        piece[frontier.cells[:, 1], frontier.cells[:, 0]] = 1
        assert ndimage.label(piece, np.ones((3, 3)))[1] == 1


def test_groups_that_nothing_touched_are_kept_and_all_cells_stay_grouped_once():
    rng = np.random.default_rng(4)
    grid = grid_of(rng.choice(3, (80, 120), p=[0.1, 0.85, 0.05]).astype(np.uint8))
    frontiers = mapped(grid, FrontierConfig(max_extent_m=0.5))
    found = frontiers.clusters(grid)
    for _ in range(10):
        x, y = rng.integers(0, 110), rng.integers(0, 70)
        flat = ((y + np.arange(8))[:, None] * 120 + x + np.arange(8)).ravel().astype(np.int32)
        was = grid.state.ravel()[flat]
        grid.state.ravel()[flat] = rng.choice(3, 64, p=[0.2, 0.75, 0.05])
        frontiers.update(grid, GridChange(False, flat, was, grid.state))
        before, found = found, frontiers.clusters(grid)
        assert len({id(frontier) for frontier in before} & {id(frontier) for frontier in found}) > 20
        gathered = np.concatenate([frontier.cells for frontier in found])
        assert len(gathered) == len({tuple(cell) for cell in gathered.tolist()}) == int(frontiers.mask.sum())
        assert all(frontiers.mask[frontier.cells[:, 1], frontier.cells[:, 0]].all() for frontier in found)
        assert all(np.ptp(frontier.cells, axis=0).max() < 10 for frontier in found)
