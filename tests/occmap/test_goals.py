"""What is worth a look, from where, and until when."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap import goals_kernels as kernels
from occmap.frontiers import Frontier
from occmap.geometry import Pose2
from occmap.goal_config import GoalConfig
from occmap.goals import GoalChooser, best_of
from occmap.grid import Belief
from occmap.strategies import utility
from tests.occmap.goal_scenes import Scene, goal_at

LESSON = {"A": (8, 5), "B": (20, 12), "C": (30, 28)}  # gain and cost


def picked(lambda_):
    return max(LESSON, key=lambda name: utility(*LESSON[name], lambda_))


def test_the_lessons_utilities():
    assert [utility(*LESSON[name], 1.0) for name in "ABC"] == [3, 8, 2]
    assert picked(1.0) == "B"
    assert utility(*LESSON["C"], 2.0) == 32
    assert picked(2.0) == "C"
    assert picked(0.0) == "A"  # lambda 0 is the nearest frontier


def test_of_equal_goals_the_first_is_taken():
    goals = [goal_at(0, 0, utility=1.0), goal_at(5, 0, utility=2.0), goal_at(9, 0, utility=2.0)]
    assert best_of(goals) is goals[1]
    assert best_of([]) is None


ROOM_WITH_A_DOORWAY = """###########
                         #....#?????
                         #....#?????
                         #.....?????
                         #....#?????
                         #....#?????
                         ###########"""


def test_a_viewpoint_is_in_reach_and_sees_into_the_unknown():
    scene = Scene(ROOM_WITH_A_DOORWAY)
    goal = scene.goal()
    ix, iy = scene.grid.frame.cell_at(*goal.viewpoint_in_map)
    assert scene.grid.state[iy, ix] == Belief.FREE
    assert goal.cost_m == pytest.approx(float(scene.flood().cost_at(np.array([(ix, iy)]))[0]), abs=0.02)
    assert kernels.sees(scene.grid.state, ix, iy, 7, 3, 3)  # two cells deep past the doorway
    assert not kernels.sees(scene.grid.state, *scene.start, 7, 3, 3)


@pytest.mark.parametrize("seed", range(6))
def test_never_is_a_goal_in_a_wall_or_the_unknown_or_out_of_reach(seed):
    rng = np.random.default_rng(seed)
    picture = "\n".join("".join(rng.choice(list("..........?#"), 40)) for _ in range(40))
    scene = Scene(picture, start=(20, 20))
    scene.grid.state[18:23, 18:23] = Belief.FREE
    scene.clearance.rebuild(scene.grid)
    wave = scene.flood()
    goals = [scene.chooser.goal_for(frontier, scene.grid, wave, 1.0, 0.25) for frontier in scene.frontiers]
    places = [scene.grid.frame.cell_at(*goal.viewpoint_in_map) for goal in goals if goal]
    assert len(places) > 5
    for ix, iy in places:
        assert scene.grid.state[iy, ix] == Belief.FREE
        assert np.isfinite(wave.cost_at(np.array([[ix, iy]]))[0])


def test_a_room_out_of_reach_offers_no_goal():
    scene = Scene("""###########
                     #....#....?
                     #....#....?
                     #....#....?
                     ###########""")
    assert scene.frontiers
    assert scene.goal() is None


def test_a_look_that_only_grazes_is_refused():
    """Along the edge of the unknown the robot sees all of the frontier, and would learn next to nothing."""
    scene = Scene(
        """#################
           #...............#
           #...............#
           #....???????????#
           #....???????????#
           #....???????????#
           #....???????????#
           #....???????????#
           #....???????????#
           #################""",
        start=(1, 8),
    )
    far_end = np.array([[x, 7] for x in range(11, 16)])
    goal = scene.goal(Frontier(far_end, (3.4, 1.9), 5), from_m=9.0, into_m=1.0)
    assert goal.cost_m > 0.4
    assert kernels.sees(scene.grid.state, *scene.start, 13, 7, 0)  # though all of it is in plain sight


def test_looks_that_fail_go_nearer():
    scene = Scene("""####################
                     #.........?????????#
                     #.........?????????#
                     #.........?????????#
                     ####################""")
    assert scene.goal(from_m=2.0).cost_m < 0.5
    assert scene.goal(from_m=0.25).cost_m > 1.5


def test_a_long_frontier_is_looked_into_from_near_though_half_of_it_is_in_nobodys_reach():
    """Two looks at a corner's shadow, from where it was cast, and a third of a maze was left."""
    rows = ["#" * 20, *["#" + "." * 9 + "?" * 9 + "#"] * 16, "#" * 20]
    scene = Scene("\n".join(rows))
    edge = Frontier(np.array([[9, y] for y in range(1, 17)]), (2.4, 2.1), 16)
    goal = scene.goal(edge, from_m=scene.chooser.config.look_from_m[-1], into_m=0.2)
    assert goal is not None
    assert abs(goal.viewpoint_in_map[0] - 2.375) <= scene.chooser.config.look_from_m[-1]


def test_gain_is_the_unknown_area_in_sight():
    closed_in = """#########
                   #....???#
                   #....???#
                   #....???#
                   #########"""
    scene = Scene(closed_in, config=GoalConfig(strategy="utility", lambda_m_per_m2=2.0))
    goal = scene.goal()
    assert goal.gain_m2 == pytest.approx(9 * 0.25**2, rel=0.25)
    assert goal.utility == pytest.approx(2.0 * goal.gain_m2 - goal.cost_m)


def test_gain_by_size_is_the_frontiers_length_times_a_metre():
    scene = Scene(ROOM_WITH_A_DOORWAY, config=GoalConfig(strategy="utility", gain="size", lambda_m_per_m2=3))
    goal = scene.goal()
    assert goal.gain_m2 == pytest.approx(0.25)
    assert goal.utility == pytest.approx(0.75 - goal.cost_m)


def test_a_goal_is_gone_when_its_frontier_is():
    scene = Scene(ROOM_WITH_A_DOORWAY)
    goal = scene.goal()
    assert not scene.chooser.is_gone(goal, scene.grid, scene.edges.mask)
    scene.grid.state[1:6, 6:9] = Belief.FREE  # seen through: the frontier has moved on
    scene.edges.rebuild(scene.grid)
    assert scene.edges.mask.any()
    assert scene.chooser.is_gone(goal, scene.grid, scene.edges.mask)


def test_the_successor_of_a_goal_is_the_nearest_if_it_is_near():
    chooser = GoalChooser(GoalConfig())
    goals = [goal_at(3.0, 0.0), goal_at(0.4, 0.0), goal_at(-0.8, 0.0)]
    assert chooser.successor(goal_at(0.0, 0.0), goals) is goals[1]
    assert chooser.successor(goal_at(1.7, 0.0), goals[:1]) is None
    assert chooser.successor(goal_at(0.0, 0.0), []) is None


def test_bounds_tell_when_no_goal_beyond_can_be_better():
    nearest = GoalChooser(GoalConfig())
    assert nearest.may_be_beaten_beyond(4.0, utility_m=-5.0)
    assert not nearest.may_be_beaten_beyond(4.0, utility_m=-3.0)
    by_utility = GoalChooser(GoalConfig(strategy="utility", gain_range_m=2.0, lambda_m_per_m2=2.0))
    most = 2.0 * math.pi * 2.0**2
    assert by_utility.may_be_beaten_beyond(4.0, utility_m=most - 4.1)
    assert not by_utility.may_be_beaten_beyond(4.0, utility_m=most - 3.9)


def test_a_goal_follows_a_correction_of_the_map():
    others = (np.array([[3.0, 1.0]]), np.array([[2.0, 0.0], [1.0, 0.0]]))
    goal = goal_at(2.0, 1.0, also_watched_in_map=others).carried(Pose2(0.5, 0.0, math.pi / 2))
    np.testing.assert_allclose(goal.viewpoint_in_map, (-0.5, 2.0), atol=1e-12)
    np.testing.assert_allclose(goal.frontier.centroid_in_map, (-0.5, 2.0), atol=1e-12)
    np.testing.assert_allclose(goal.watched_in_map, [(-0.5, 2.0)], atol=1e-12)
    np.testing.assert_allclose(
        np.concatenate(goal.also_watched_in_map), [(-0.5, 3.0), (0.5, 2.0), (0.5, 1.0)], atol=1e-12
    )


def test_a_goal_says_what_it_is_worth():
    assert str(goal_at(1, 2, gain_m2=1.03, cost_m=6.1, utility=-5.07)) == (
        "frontier at (1.0, 2.0): gain 1.03 m², cost 6.1 m, U = -5.07"
    )
    assert str(goal_at(1, 2, cost_m=6.1)) == "frontier at (1.0, 2.0): cost 6.1 m"


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("strategy", "best"),
        ("gain", "guess"),
        ("lambda_m_per_m2", -1.0),
        ("gain_range_m", math.nan),
        ("look_from_m", ()),
        ("look_from_m", (1.0,)),
        ("look_into_m", (1.0, 0.5, math.nan)),
        ("hysteresis_m", -0.1),
    ],
)
def test_nonsense_is_refused(field, value):
    with pytest.raises(ValueError, match=field.split("_")[0]):
        GoalConfig(**{field: value})


def test_the_shorter_a_frontier_the_deeper_the_look():
    """A dent of a wall is short and shallow: what is short has to open onto something."""
    chooser, grid = GoalChooser(GoalConfig()), Scene("###\n#.#\n###").grid
    long, short = (Frontier(np.zeros((n, 2), int), (0.0, 0.0), n) for n in (2, 1))  # of 0.25 m each
    assert chooser.looks_at(long, grid) == ((2.5, 0.2), (1.2, 0.2), (0.5, 0.2))
    assert [into_m for _, into_m in chooser.looks_at(short, grid)] == pytest.approx([1.0, 0.48, 0.2])
