import math
from types import SimpleNamespace

import numpy as np
import pytest

from occmap.geometry import Pose2
from occmap.localization import SlamLocalizer
from occmap.localization.loop_candidates import Candidate, uncertainty_from
from occmap.localization.loop_closure import Loop, LoopCloser, LoopClosureConfig
from occmap.localization.loop_comparison import Comparison, ComparisonConfig, closer_look
from occmap.localization.matcher import Match, Matcher
from occmap.localization.pose_graph import Loss, PoseGraph
from occmap.localization.submap import Submap, SubmapConfig, View
from occmap.localization.surfel_map import Cloud
from tests.occmap.kinematic_world import room
from tests.occmap.localization.drives import RING, RING_LAP, drive, errors_m, observe, scan_at

TIGHT = np.diag([1e4, 1e4, 1e6])


def _chain(nodes, length_m=1.0):
    graph = PoseGraph()
    step = Pose2(length_m, 0.0, 0.0)
    graph.add_node(Pose2.identity())
    for k in range(1, nodes):
        graph.add_node(graph.pose(k - 1) @ step)
        graph.add_edge(k - 1, k, step, TIGHT)
    return graph


def test_uncertainty_grows_along_a_chain_and_heading_errors_lever_out():
    """Sum over the edges of sigma^2 + (distance of the edge's middle)^2 sigma_yaw^2."""
    graph = _chain(11)
    position, yaw = uncertainty_from(graph, 0)
    levers = np.arange(10) + 0.5
    assert position[10] == pytest.approx((2e-4 + 1e-6 * levers**2).sum(), rel=1e-3)
    assert yaw[10] == pytest.approx(10e-6, rel=1e-3)
    assert np.all(np.diff(position) > 0.0)


def test_a_loop_makes_what_it_joins_certain():
    graph = _chain(11)
    before, _ = uncertainty_from(graph, 10)
    graph.add_edge(0, 10, Pose2(10.0, 0.0, 0.0), TIGHT)
    after, _ = uncertainty_from(graph, 10)
    assert after[0] < 0.2 * before[0]
    assert after[5] <= before[5]


def test_an_edge_that_is_not_believed_makes_nothing_certain():
    graph = _chain(11)
    before = uncertainty_from(graph, 10)[0][0]
    graph.add_edge(0, 10, Pose2(3.0, 2.0, 1.0), TIGHT, Loss.DCS, 6.0)
    assert uncertainty_from(graph, 10)[0][0] == before


def test_headings_that_a_compass_knows_do_not_lever_out():
    """Every edge then sways by its own length times the compass's error; unless that is not believed."""
    graph, compass = _chain(11, length_m=10.0), np.diag([0.0, 0.0, 1e8])
    plain = uncertainty_from(graph, 10)[0][0]
    for k in range(1, 11):
        graph.add_edge(0, k, graph.pose(k), compass, Loss.DCS, 1.0)
    position, yaw = uncertainty_from(graph, 10, compass_rad=3e-4)
    assert position[0] == pytest.approx(10 * (2e-4 + 9e-8 * 10.0**2), rel=0.1)
    assert position[0] < 0.7 * plain
    assert yaw[0] == pytest.approx(2 * 9e-8)
    askew = _chain(11, length_m=10.0)
    for k in range(1, 11):
        askew.add_edge(0, k, Pose2(0.0, 0.0, 0.1), compass, Loss.DCS, 1.0)
    assert uncertainty_from(askew, 10, compass_rad=3e-4)[0][0] == plain


def test_a_robot_that_stays_in_place_knows_where_it_is():
    """Two submaps at one place, a turn apart: an edge without length, and a heading that no compass knows."""
    graph = _chain(2, length_m=0.0)
    position, yaw = uncertainty_from(graph, 1, compass_rad=3e-4)
    assert position[0] == pytest.approx(2e-4, rel=1e-3)
    assert yaw[0] == pytest.approx(1e-6, rel=1e-3)


def test_errors_in_common_add_up():
    """Standard deviations do, where variances would of errors that average out."""
    graph = _chain(11)
    yaw = 1e-3
    assert uncertainty_from(graph, 0, common_share=1.0)[1][10] == pytest.approx((10 * yaw) ** 2, rel=1e-3)
    assert uncertainty_from(graph, 0, common_share=0.5)[1][10] == pytest.approx(
        0.5 * (10 * yaw) ** 2 + 0.5 * 10 * yaw**2, rel=1e-3
    )


def test_a_planted_false_loop_does_not_fold_the_map():
    poses = drive([*RING_LAP, *RING_LAP, RING_LAP[0]])
    slam = SlamLocalizer()
    stream = observe(RING, poses, np.random.default_rng(0))
    for k, seen in enumerate(stream):
        slam.update(seen)
        if k == 2 * len(stream) // 3:
            last = len(slam.graph.poses) - 3
            slam.graph.add_edge(
                2, last, Pose2(2.0, -1.0, 1.0), 0.1 * TIGHT, Loss.DCS, slam.config.loops.dcs_chi2
            )
    slam.finish()
    assert errors_m(poses, [pose for _, pose in slam.trajectory()]).max() < 0.1


def test_a_loop_is_borne_out_by_other_views_only():
    """In a maze a place looks like the next one, from all submaps that saw it: a pitch of the maze aside."""
    graph = _chain(40)
    closer = LoopCloser(LoopClosureConfig(), Matcher(), graph, [])
    aside = Pose2(0.0, 1.7, 0.0)

    def loop(older, younger, *, is_surprise):
        older_from_younger = graph.pose(older).inverse() @ aside @ graph.pose(younger)
        return Loop(older, younger, older_from_younger, TIGHT, is_sure=False, is_surprise=is_surprise)

    surprising = loop(0, 30, is_surprise=True)
    assert not closer.agree(surprising, loop(2, 30, is_surprise=True))
    assert not closer.agree(surprising, loop(0, 31, is_surprise=True))
    assert closer.agree(surprising, loop(0, 32, is_surprise=True))
    expected = loop(0, 30, is_surprise=False)
    assert not closer.agree(expected, loop(2, 30, is_surprise=False))
    assert closer.agree(expected, loop(2, 31, is_surprise=False))


@pytest.mark.parametrize(("off_m", "is_believed"), [(1.0, True), (1.77, False)])
def test_a_place_a_pitch_of_the_maze_off_waits_for_a_witness(off_m, is_believed):
    """Four standard deviations, once, let one through that was predicted to 0.46 m, and right to 0.02 m."""
    graph = _chain(40)
    closer = LoopCloser(LoopClosureConfig(), Matcher(), graph, [])
    pair = Candidate(0, 30, sigma_m=0.46, sigma_rad=0.014)
    predicted = graph.pose(0).inverse() @ graph.pose(30)
    match = Match(predicted @ Pose2(0.0, off_m, 0.0), TIGHT, TIGHT, fit=0.64)
    assert closer._judge(SimpleNamespace(pair=pair, predicted=predicted), match) == is_believed
    assert len(closer.believed) == int(is_believed)
    assert len(closer.unwitnessed) == int(not is_believed)


def test_a_pair_that_is_compared_again_waits_once():
    """As it is in the end, if it is far from any loop; with its witness it is believed once."""
    graph = _chain(40)
    closer = LoopCloser(LoopClosureConfig(), Matcher(), graph, [])

    def judged(older, younger):
        predicted = graph.pose(older).inverse() @ graph.pose(younger)
        match = Match(predicted, TIGHT.copy(), TIGHT.copy(), fit=0.64)
        pair = Candidate(older, younger, sigma_m=0.6, sigma_rad=0.014)
        return closer._judge(SimpleNamespace(pair=pair, predicted=predicted), match)

    assert not judged(0, 30)
    assert not judged(0, 30)
    assert len(closer.unwitnessed) == 1
    assert judged(2, 31)
    assert [(loop.older, loop.younger) for loop in closer.believed] == [(2, 31), (0, 30)]
    assert not closer.unwitnessed


def test_rooms_that_look_alike_are_not_taken_for_one():
    """Two equal rooms, one behind the other, joined by a plain corridor."""
    boxes = np.array(
        [
            (0, -0.2, 4, 0), (0, 3, 4, 3.2), (-0.2, -0.2, 0, 3.2), (4, -0.2, 4.2, 1), (4, 2, 4.2, 3.2),
            (1, 2.4, 1.6, 3),
            (4.2, 0.8, 12, 1), (4.2, 2, 12, 2.2),
            (12, -0.2, 16, 0), (12, 3, 16, 3.2), (11.8, -0.2, 12, 1), (11.8, 2, 12, 3.2),
            (16, -0.2, 16.2, 3.2),
            (13, 2.4, 13.6, 3),
        ]
    )  # fmt: skip
    poses = drive([(1.0, 1.5), (14.5, 1.5), (14.6, 1.0), (2.5, 1.5), (14.5, 1.6)])
    slam = SlamLocalizer()
    for seen in observe(boxes, poses, np.random.default_rng(4), max_range_m=6.0):
        slam.update(seen)
    slam.finish()
    assert errors_m(poses, [pose for _, pose in slam.trajectory()]).max() < 0.2
    for loop in slam.loops.believed:
        apart = slam.graph.pose(loop.older).inverse() @ slam.graph.pose(loop.younger)
        error = loop.older_from_younger.inverse() @ apart
        assert math.hypot(error.x_m, error.y_m) < 0.2


def _growing(boxes, poses, rng, **scan):
    """What is seen of a world, or of one world a pose, on the way; in the frame of the first pose."""
    submap = Submap(SubmapConfig(), Pose2.identity(), np.eye(3), 12.0)
    for k, pose in enumerate(poses):
        submap_from_robot = poses[0].inverse() @ pose
        seen = scan_at(boxes[k] if isinstance(boxes, list) else boxes, pose, rng, **scan)
        submap.views.append(View.of(seen, submap_from_robot))
        submap.insert(Cloud.of(seen, Pose2.identity(), 30.0), submap_from_robot)
    return submap


def _finished(*args, **scan):
    submap = _growing(*args, **scan)
    submap.finish()
    return submap


def test_people_who_walk_along_do_not_hide_a_place_seen_again():
    """They leave trails in both submaps; each submap has itself looked through its own."""
    rng = np.random.default_rng(5)

    def with_a_walker(way):
        places = [way(k // 2) for k in range(24)]
        worlds = [room(8.0, 6.0, (6, 4, 8, 4.4), (x, y, x + 0.4, y + 0.4)) for x, y in places]
        return _finished(worlds, 24 * [Pose2(2.0, 2.0, 0.0)], rng)

    before = with_a_walker(lambda k: (3.0 + 0.3 * k, 1.0 + 0.2 * k))
    after = with_a_walker(lambda k: (3.2, 0.3 + 0.4 * k))
    match = closer_look(ComparisonConfig(), before, after, Matcher(), Pose2.identity())
    assert match is not None
    assert match.submap_from_robot.distance_to(Pose2.identity()) < 0.02


def test_what_is_grazed_now_and_then_stays():
    """Walls, jambs and posts are met by more views than look past them."""
    boxes = room(20.0, 2.4, (6, 0, 6.2, 0.9), (9, 1.5, 9.2, 2.4), (12, 0, 12.2, 0.9), (14, 1.2, 14.1, 1.3))
    poses = [Pose2(5.0 + 0.3 * k, 1.2 + 0.1 * math.sin(k), 0.1 * math.sin(k)) for k in range(20)]
    submap = _growing(boxes, poses, np.random.default_rng(0))
    surfels = submap.surfels.size
    submap.finish()
    assert submap.cloud is not None
    assert len(submap.cloud) > 0.98 * surfels


def _compared(boxes, sigma_m):
    """The error of what comes of comparing two passes of a corridor whose ends are out of sight; or None."""
    rng = np.random.default_rng(1)
    passes = [[Pose2(start + 0.3 * k, 1.2, 0.0) for k in range(20)] for start in (17.0, 17.8)]
    older, younger = (_finished(boxes, poses, rng, max_range_m=8.0) for poses in passes)
    true = passes[0][0].inverse() @ passes[1][0]
    predicted = Pose2(true.x_m + 0.7, true.y_m, 0.005)
    comparison = Comparison(ComparisonConfig(), Candidate(0, 1, sigma_m, 0.01), younger, predicted)
    matcher = Matcher()
    while not comparison.step(older, younger, matcher, 10**9):
        pass
    return None if comparison.match is None else comparison.match.submap_from_robot.distance_to(true)


def test_a_few_niches_tell_where_along_a_corridor():
    """The walls alone give any place along it most of the best score."""
    niches = room(
        40.0, 2.4, (15, 0, 15.6, 0.2), (18.5, 2.15, 19.3, 2.4), (22, 0, 22.9, 0.15), (25.4, 2.2, 26, 2.4)
    )
    error_m = _compared(niches, 0.6)
    assert error_m is not None
    assert error_m < 0.05


def test_a_corridor_of_equal_doors_is_not_told():
    doors = room(40.0, 2.4, *[(x, 0, x + 0.4, 0.2) for x in np.arange(0.5, 39.5, 1.5)])
    assert _compared(doors, 0.6) is None
    assert _compared(room(40.0, 2.4), 0.6) is None
