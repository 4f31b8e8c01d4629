import math

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization.likelihood_pyramid import LikelihoodPyramid
from occmap.localization.matcher import Matcher
from occmap.localization.submap import Submap, SubmapConfig
from occmap.localization.surfel_map import Cloud
from occmap.localization.window import Window
from occmap.localization.window_search import WindowSearch
from tests.occmap.kinematic_world import room
from tests.occmap.localization.drives import scan_at

ROOM = room(8.0, 6.0, (2, 0, 3, 1.5), (6, 4, 8, 4.4))


@pytest.fixture(scope="module")
def submap():
    rng = np.random.default_rng(0)
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    submap.insert(
        Cloud.of(scan_at(ROOM, Pose2(4.0, 3.0, 0.4), rng), Pose2.identity(), 30.0), Pose2.identity()
    )
    return submap


@pytest.fixture(scope="module")
def points():
    return Cloud.of(
        scan_at(ROOM, Pose2(3.3, 2.6, 0.7), np.random.default_rng(1)), Pose2.identity(), 30.0
    ).points


def _searched(points, raster, window, work=10**9):
    search, turns = WindowSearch(points, raster, window), 0
    while not search.is_done:
        search.step(raster, work)
        turns += 1
    return search, turns


def test_it_finds_what_the_search_at_once_finds(submap, points):
    window = Window(Pose2(0.1, -0.2, 0.1), 1.5, 0.6, 0.02, 0.1)
    search, _ = _searched(points, submap.raster, window)
    pose, score = Matcher().search(points, submap, window)
    assert search.found
    assert (search.best, search.score) == (pose, pytest.approx(score))


@pytest.mark.parametrize("work", [1, 10_000, 300_000])
def test_slices_of_any_size_find_the_same(submap, points, work):
    window = Window(Pose2.identity(), 1.5, 0.6, 0.02, 0.1)
    whole, turns = _searched(points, submap.raster, window)
    sliced, more_turns = _searched(points, submap.raster, window, work)
    assert (sliced.best, sliced.score) == (whole.best, whole.score)
    assert more_turns > turns


def test_no_slice_is_much_longer_than_asked_for(submap, points):
    """One block of shifts may be begun with the last of the work: at most 64 x 64, and their bounds."""
    search = WindowSearch(points, submap.raster, Window(Pose2.identity(), 3.0, 0.8, 0.01, 0.1))
    while not search.is_done:
        left = search.step(submap.raster, 50_000)
        assert left > -len(points) * 2 * 64 * 64


def test_nothing_is_found_below_the_least_score(submap, points):
    search, _ = _searched(points, submap.raster, Window(Pose2.identity(), 1.5, 0.6, 0.02, 0.99))
    assert not search.found
    assert not _searched(points[:0], submap.raster, Window(Pose2.identity(), 1.5, 0.6, 0.02, 0.1))[0].found


def test_a_corridor_has_rivals_and_a_room_has_none(submap, points):
    corridor = LikelihoodPyramid(0.05, 0.06, (-15.0, -5.0), (15.0, 5.0))
    x = np.linspace(-12.0, 12.0, 400)
    walls = np.concatenate([np.column_stack((x, np.full(400, y))) for y in (-1.0, 1.0)])
    corridor.insert(walls)
    piece = walls[np.abs(walls[:, 0]) < 4.0]
    for cloud, raster, has_rival in ((piece, corridor, True), (points, submap.raster, False)):
        search, _ = _searched(cloud, raster, Window(Pose2.identity(), 2.0, 0.5, 0.01, 0.3))
        elsewhere = Window(
            Pose2.identity(), 2.0, 0.5, 0.01, 0.8 * search.score, search.best, 0.5, any_will_do=True
        )
        rival, _ = _searched(cloud, raster, elsewhere)
        assert rival.found is has_rival
        if has_rival:
            off = math.hypot(rival.best.x_m - search.best.x_m, rival.best.y_m - search.best.y_m)
            assert off > 0.5
