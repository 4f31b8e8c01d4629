"""Tiles, snapshots and pictures: nothing lost, nothing mirrored, bounded in memory."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from experiments.recorders import palette
from experiments.recorders.belief_tiles import ROS_FROM_BELIEF, BeliefTiles
from experiments.recorders.frontiers import cells_in_map, chosen_frontier, frontier_colour
from experiments.recorders.growth_picture import GrowthPicture, evenly_grown
from experiments.recorders.snapshots import PackedBelief, SnapshotLog
from experiments.recorders.top_view import OVERSAMPLING, TopView, outline
from occmap.frontiers import Frontier
from occmap.grid import Belief, GridConfig, OccupancyGrid
from sim.building import Box, Cylinder
from tests.experiments.fake_episode import START, FakeCurve, building, fake_episode, setting


def grid_over(low_m: tuple[float, float], high_m: tuple[float, float]) -> OccupancyGrid:
    grid = OccupancyGrid(GridConfig(resolution_m=0.5))
    grid.grow_to_contain(low_m, high_m)
    return grid


def put(grid: OccupancyGrid, x_m: float, y_m: float, belief: Belief) -> None:
    ix, iy = grid.frame.cell_at(x_m, y_m)
    grid.state[iy, ix] = belief


def test_a_tile_is_shown_once_and_again_only_when_it_changed():
    grid, tiles = grid_over((-3.0, -3.0), (3.0, 3.0)), BeliefTiles(side_cells=4)
    put(grid, 0.1, 0.1, Belief.FREE)
    put(grid, -2.9, -2.9, Belief.OCCUPIED)
    assert {tile.index for tile in tiles.changed(grid)} == {(0, 0), (-2, -2)}
    assert not list(tiles.changed(grid))
    put(grid, 0.1, 0.6, Belief.FREE)
    assert [tile.index for tile in tiles.changed(grid)] == [(0, 0)]
    put(grid, 0.1, 0.6, Belief.UNKNOWN)
    put(grid, 0.1, 0.1, Belief.UNKNOWN)
    assert [tile.state.any() for tile in tiles.changed(grid)] == [False]  # forgotten, but must be wiped


def test_tiles_stay_where_they_are_when_the_grid_grows():
    grid, tiles = grid_over((-1.0, -1.0), (1.0, 1.0)), BeliefTiles(side_cells=4)
    put(grid, 0.1, 0.6, Belief.OCCUPIED)
    (before,) = tiles.changed(grid)
    assert grid.grow_to_contain((-9.0, -7.0), (1.0, 1.0))
    assert not list(tiles.changed(grid))
    assert before.low_m == (0.0, 0.0)
    assert before.state[1, 0] == Belief.OCCUPIED
    assert before.image()[-2, 0] == ROS_FROM_BELIEF[Belief.OCCUPIED]  # rows of an image run downwards


def test_a_packed_belief_unpacks_to_the_known_part_of_the_grid():
    grid = grid_over((-4.0, -3.0), (5.0, 6.0))
    assert PackedBelief.of(grid).shape == (0, 0)
    put(grid, 1.1, 2.1, Belief.FREE)
    put(grid, 3.1, -0.4, Belief.OCCUPIED)
    packed = PackedBelief.of(grid)
    assert packed.offset == (2, -1)
    assert packed.known_cells == 2
    assert packed.state().tolist() == [[0, 0, 0, 0, 2], *[[0] * 5] * 4, [1, 0, 0, 0, 0]]


def log_of(steps: int, capacity: int = 8, stride: int = 1) -> SnapshotLog:
    (step,) = fake_episode(1, beams=12)
    log = SnapshotLog(START, FakeCurve([]), capacity, stride)  # pyright: ignore[reportArgumentType]
    for k in range(steps):
        log.record(replace(step, observation=replace(step.observation, time_s=float(k))))
    log.finish()
    return log


@pytest.mark.parametrize("steps", [1, 2, 7, 8, 9, 16, 17, 100, 1001])
def test_snapshots_are_even_bounded_and_reach_both_ends(steps):
    times = [shot.time_s for shot in log_of(steps).snapshots]
    assert times[0] == 0.0
    assert times[-1] == steps - 1
    assert min(steps, 4) <= len(times) <= 9  # the last one may come on top
    gaps = np.diff(times)
    assert len(set(gaps[:-1])) <= 1
    assert len(gaps) < 2 or 0 < gaps[-1] <= gaps[0]


def test_a_snapshot_remembers_the_way_so_far():
    log = log_of(40)
    assert [len(log.trail(shot)) for shot in log.snapshots] == [shot.time_s + 1 for shot in log.snapshots]


def test_a_picture_shows_each_cell_where_it_is_in_the_world():
    """Occupied pixels of the drawn belief lie on solids, the map turned against the world as it is."""
    *_, last = fake_episode(30)
    view = TopView(building(), (300, 200))
    fine = np.asarray(view.belief(PackedBelief.of(last.grid), START))
    mask = view.blank()
    view.draw_building(mask, building())
    solid = (np.asarray(mask) != palette.FLOOR).any(axis=2)
    rows, columns = np.nonzero((fine == palette.OCCUPIED).all(axis=2))
    assert len(rows) > 500
    near = [
        solid[max(r - 5, 0) : r + 6, max(c - 5, 0) : c + 6].any() for r, c in zip(rows, columns, strict=True)
    ]
    assert np.mean(near) > 0.99
    mirrored = solid[::-1]
    wrong = [
        mirrored[max(r - 5, 0) : r + 6, max(c - 5, 0) : c + 6].any()
        for r, c in zip(rows, columns, strict=True)
    ]
    assert np.mean(wrong) < 0.95


def test_the_building_fits_the_picture_upright():
    view = TopView(building(), (300, 200))
    (left, bottom), (right, top) = view.pixels(np.array([building().low_m, building().high_m]))
    assert 0 < left < right < 300 * OVERSAMPLING
    assert 0 < top < bottom < 200 * OVERSAMPLING
    assert (right - left) / (bottom - top) == pytest.approx(12.0 / 8.0)


def test_outlines_turn_with_their_solids():
    corners = outline(Box(1.0, 2.0, 0.5, 0.1, yaw_rad=np.pi / 2))
    assert np.allclose(corners.min(axis=0), (0.9, 1.5))
    assert np.allclose(np.hypot(*(outline(Cylinder(1.0, 1.0, 0.3)) - 1.0).T), 0.3)


def test_a_frontier_keeps_its_colour_and_the_chosen_one_is_found_by_place():
    here, there = (SimpleNamespace(centroid_in_map=at, cells=[]) for at in ((1.0, 1.0), (5.0, 5.0)))
    assert frontier_colour(here) == frontier_colour(SimpleNamespace(centroid_in_map=(1.2, 1.3)))
    goal = SimpleNamespace(frontier=SimpleNamespace(centroid_in_map=(4.8, 5.3)))
    assert chosen_frontier(SimpleNamespace(goal=goal, frontiers=(here, there))) is there
    assert chosen_frontier(SimpleNamespace(goal=goal, frontiers=(here,))) is None
    assert chosen_frontier(SimpleNamespace(goal=None, frontiers=(here,))) is None


def test_a_frontier_stays_in_its_place_when_the_grid_has_grown_since():
    grid = grid_over((-1.0, -1.0), (2.0, 2.0))
    places = np.array([(0.25, 0.25), (0.75, 0.75), (0.75, 1.25)])
    frontier = Frontier(grid.frame.cell_from_map(places), tuple(places.mean(axis=0)), 3)
    grid.grow_to_contain((-9.0, -7.0), (1.0, 1.0))
    assert np.allclose(cells_in_map(frontier, 0.5), places)


@pytest.mark.parametrize("suffix", [".png", ".gif"])
def test_a_growth_picture_is_drawn(tmp_path, suffix):
    from PIL import Image

    curve = FakeCurve([])
    growth = GrowthPicture(tmp_path / f"growth{suffix}", setting(), curve, panel_width_px=120)
    for step in fake_episode(40, curve, beams=60):
        growth.record(step)
    growth.close()
    picture = Image.open(tmp_path / f"growth{suffix}")
    assert picture.width >= 120
    assert getattr(picture, "n_frames", 1) == (1 if suffix == ".png" else 9)
    with pytest.raises(ValueError, match=r"growth\.jpg"):
        GrowthPicture(tmp_path / "growth.jpg", setting(), curve)


def test_panels_grow_by_equal_steps():
    shots = [SimpleNamespace(belief=SimpleNamespace(known_cells=n)) for n in (0, 10, 50, 52, 75, 99, 100)]
    assert [s.belief.known_cells for s in evenly_grown(shots, 5)] == [0, 50, 75, 100]


def test_a_pose_is_a_pixel():
    view = TopView(building(), (300, 200))
    (x, y), (x2, y2) = view.pixels(np.array([(6.0, 4.0), (7.0, 5.0)]))
    assert (x, y) == (300.0, 200.0)
    assert x2 > x
    assert y2 < y
