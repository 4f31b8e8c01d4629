"""The scores on small maps whose faults are known."""

import numpy as np
import pytest

from experiments import scoring
from experiments.scoring import Scorer
from occmap.geometry import Pose2
from occmap.grid import Belief, GridConfig, OccupancyGrid
from sim.truth import TruthGrid

RESOLUTION_M = 0.1


def room(n: int = 20) -> np.ndarray:
    """A square room with walls one cell thick."""
    wall = np.ones((n, n), bool)
    wall[1:-1, 1:-1] = False
    return wall


def map_of(belief: np.ndarray) -> OccupancyGrid:
    grid = OccupancyGrid(GridConfig(resolution_m=RESOLUTION_M))
    ny, nx = belief.shape
    grid.grow_to_contain((0.0, 0.0), ((nx - 0.5) * RESOLUTION_M, (ny - 0.5) * RESOLUTION_M))
    grid.state[:ny, :nx] = belief
    return grid


def scorer(wall: np.ndarray, start: Pose2 | None = None) -> Scorer:
    start = start or Pose2.identity()
    return Scorer(TruthGrid(RESOLUTION_M, start.position, wall), ~wall, start)


def perfect(wall: np.ndarray) -> np.ndarray:
    return np.where(wall, Belief.OCCUPIED, Belief.FREE).astype(np.uint8)


def test_a_perfect_map_scores_perfectly():
    score = scorer(room()).score(map_of(perfect(room())))
    assert (score.explored, score.known, score.wrong, score.wall_recall) == (1.0, 1.0, 0.0, 1.0)
    assert (score.wall_error_mean_m, score.wall_error_p95_m) == (0.0, 0.0)


def test_an_empty_map_has_explored_nothing():
    score = scorer(room()).score(map_of(np.zeros((20, 20), np.uint8)))
    assert (score.explored, score.known, score.wrong, score.wall_recall) == (0.0, 0.0, 0.0, 0.0)
    assert np.isnan(score.wall_error_mean_m)


def test_the_map_is_placed_in_the_world_by_the_start():
    score = scorer(room(), Pose2(3.0, -7.0, 0.0)).score(map_of(perfect(room())))
    assert score.explored == 1.0
    assert score.wall_error_p95_m == 0.0


def test_a_belief_is_the_same_however_wide_the_building_is_taken_to_be(monkeypatch):
    start, belief = Pose2(0.62, 0.4, 0.7), map_of(perfect(room()))
    small = scorer(room(), start).belief(belief)
    monkeypatch.setattr(scoring, "SMALL_CELLS", 0)
    np.testing.assert_array_equal(scorer(room(), start).belief(belief), small)


def test_either_answer_counts_on_the_rim_and_only_there():
    belief = perfect(room())
    belief[1, 5] = Belief.OCCUPIED  # on the rim: a wall that came out thick
    belief[10, 10] = Belief.OCCUPIED  # in the open: wrong
    score = scorer(room()).score(map_of(belief))
    assert score.explored == pytest.approx(1 - 1 / 18**2)
    assert score.wrong == pytest.approx(1 / 18**2)
    assert score.wrong_cells == 1


def test_an_erased_wall_is_missed_and_wrong():
    belief = perfect(room())
    belief[0, :] = Belief.FREE
    score = scorer(room()).score(map_of(belief))
    # of its 20 cells the outer two on each side still have the side walls within one cell
    assert score.wall_recall == pytest.approx(1 - 16 / 76)
    assert score.wrong == pytest.approx(16 / 18**2)


def test_a_shifted_map_shows_in_the_wall_error():
    shifted = np.roll(perfect(room()), 2, axis=1)
    score = scorer(room()).score(map_of(shifted))
    assert score.wall_error_p95_m == pytest.approx(2 * RESOLUTION_M)
