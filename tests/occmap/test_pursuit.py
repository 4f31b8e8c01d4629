"""A goal is pursued as long as that leads somewhere, and not a moment longer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from occmap.body import Body
from occmap.decision import Reason
from occmap.follower import Steering
from occmap.geometry import Pose2, Twist2
from occmap.grid import Belief, OccupancyGrid
from occmap.path import Path
from occmap.pursuit import Learning, Pursuit, PursuitConfig
from tests.occmap.goal_scenes import goal_at

HERE = Pose2(1.0, 2.0, 0.0)
AHEAD = Twist2(0.4, 0.0)
CONFIG = PursuitConfig(look_s=0.5, held_up_s=4.0, patience_s=10.0)


def steering(progress_m=0.0, *, off_m=0.0, arrived=False, held_up_s=0.0):
    return Steering(Twist2.zero() if arrived else AHEAD, progress_m, off_m, arrived, held_up_s)


@pytest.fixture
def pursuit():
    path = Path.through(np.array([[0.0, 0.0], [3.0, 0.0]]))
    return Pursuit(CONFIG, goal_at(3.0, 0.0), path, OccupancyGrid(), now_s=0.0)


def test_while_it_gets_nearer_it_drives_on(pursuit):
    for k in range(300):
        now_s = 0.1 * k
        assert pursuit.advance(steering(0.01 * k), now_s) == AHEAD
        assert pursuit.failure(HERE, now_s) is None


def test_no_nearer_for_too_long_is_unsafe(pursuit):
    pursuit.advance(steering(1.0), 1.0)
    pursuit.advance(steering(1.04), 10.9)  # a little is nothing
    assert pursuit.failure(HERE, 10.9) is None
    failure = pursuit.failure(HERE, 11.1)
    assert (failure.reason, failure.why) == (Reason.UNSAFE, "came no nearer than 2.00 m")


def test_what_bars_the_way_for_too_long_is_unsafe(pursuit):
    pursuit.advance(steering(held_up_s=3.9), 3.9)
    assert pursuit.failure(HERE, 3.9) is None
    pursuit.advance(steering(held_up_s=4.1), 4.1)
    failure = pursuit.failure(HERE, 4.1)
    assert (failure.reason, failure.why) == (Reason.UNSAFE, "something bars the way at (1.00, 2.00)")


def test_what_bars_the_way_in_a_gap_is_the_gap():
    path = Path.through(np.array([[0.0, 0.0], [3.0, 0.0]]))
    gap = Pursuit(CONFIG, goal_at(3.0, 0.0), path, OccupancyGrid(), now_s=0.0, is_tight=True)
    gap.advance(steering(held_up_s=4.1), 4.1)
    assert gap.failure(HERE, 4.1).reason is Reason.TOO_NARROW


def test_arrived_it_looks_around_for_a_while_and_then_gives_up(pursuit):
    twist = pursuit.advance(steering(3.0, arrived=True), 7.0)
    assert twist == Twist2(0.0, CONFIG.look_turn_radps)
    assert pursuit.has_arrived
    assert pursuit.failure(HERE, 7.4) is None
    assert pursuit.failure(HERE, 7.5).reason is Reason.GAVE_UP


def test_a_path_leads_to_viewpoints_near_its_end_until_the_robot_strays(pursuit):
    assert pursuit.leads_to(goal_at(3.2, 0.0))
    assert not pursuit.leads_to(goal_at(3.4, 0.0))
    pursuit.advance(steering(0.5, off_m=0.5), 1.0)
    assert not pursuit.leads_to(goal_at(3.0, 0.0))


def test_a_goal_survives_a_correction_of_the_map_and_its_path_is_planned_anew(pursuit):
    pursuit.carry_over(Pose2(0.0, 1.0, 0.0))
    assert pursuit.goal.viewpoint_in_map == (3.0, 1.0)
    pursuit.advance(steering(0.5), 1.0)
    assert pursuit.is_void  # until there is another


def test_learning_nothing_for_too_long_is_a_failure_however_often_goals_change():
    learning = Learning(PursuitConfig(fruitless_s=60.0, slowest_mps=0.25), Body())
    learning.note(known_m2=20.0, way_m=5.0, now_s=3.0)
    for k in range(8):
        learning.note(20.2, 5.0 + k % 2, 3.0 + 10.0 * k)  # noise, to and fro between two goals
        assert learning.failure(3.0 + 10.0 * k) is None
    assert learning.failure(3.0 + 84.0) is None  # 60 s and 6 m at 0.25 m/s
    assert learning.failure(3.0 + 84.1).reason is Reason.GAVE_UP


def test_a_slow_base_gets_the_time_that_it_needs():
    learning = Learning(PursuitConfig(fruitless_s=60.0, slowest_mps=0.25), Body(max_speed_mps=0.2))
    learning.note(known_m2=20.0, way_m=6.0, now_s=0.0)
    assert learning.failure(120.0) is None  # 60 s and 6 m at 0.1 m/s
    assert learning.failure(120.1) is not None


def test_a_corrected_map_may_hold_less_and_what_is_learnt_from_then_on_counts():
    learning = Learning(PursuitConfig(fruitless_s=60.0, turns_back=2), Body())
    learning.note(100.0, 0.0, 0.0)
    turned_back_from(learning, (5.0, 0.0))
    learning.carry_over(Pose2(0.0, 4.0, 0.0), known_m2=70.0)
    assert learning.failure(60.1) is not None  # the correction alone taught it nothing
    assert turned_back_from(learning, (5.0, 4.0)).reason is Reason.GAVE_UP
    learning.note(71.0, 0.0, 50.0)
    assert learning.failure(110.0) is None


def test_having_learnt_or_given_up_it_starts_afresh():
    learning = Learning(PursuitConfig(fruitless_s=60.0), Body())
    learning.note(20.0, 0.0, 0.0)
    learning.note(20.3, 0.0, 50.0)
    assert learning.failure(110.0) is None
    assert learning.failure(110.1) is not None
    learning.begin(110.1)
    assert learning.failure(170.0) is None


def test_a_look_that_made_cells_known_was_not_in_vain():
    grid = OccupancyGrid()
    grid.grow_to_contain((-5.0, -5.0), (5.0, 5.0))
    pursuit = Pursuit(CONFIG, goal_at(3.0, 0.0), Path.through(np.array([[0.0, 0.0], [3.0, 0.0]])), grid, 0.0)
    ix, iy = grid.frame.cell_at(3.0, 0.0)
    grid.state[iy, ix : ix + 7] = Belief.FREE  # of 25 cm² each
    assert not pursuit.has_shown_something(grid)
    grid.state[iy + 1, ix] = Belief.OCCUPIED
    assert pursuit.has_shown_something(grid)


def turned_back_from(learning, place, is_tight=False):
    path = Path.through(np.array([[0.0, 0.0], [3.0, 0.0]]))
    return learning.turned_back(Pursuit(CONFIG, goal_at(*place), path, OccupancyGrid(), 0.0, is_tight))


def test_to_and_fro_between_two_goals_ends_with_both_given_up():
    learning = Learning(PursuitConfig(turns_back=3), Body())
    for _ in range(2):
        assert turned_back_from(learning, (5.0, 0.0)) is None
        assert turned_back_from(learning, (-5.0, 0.0)) is None
    assert turned_back_from(learning, (5.2, 0.1), is_tight=True).reason is Reason.TOO_NARROW
    assert turned_back_from(learning, (-5.0, 0.0)).reason is Reason.GAVE_UP
    assert turned_back_from(learning, (5.0, 0.0)) is None  # counted afresh


def test_a_goal_with_gap_after_gap_on_the_way_is_given_up():
    learning = Learning(PursuitConfig(gaps_tried=4), Body())
    path = Path.through(np.array([[0.0, 0.0], [3.0, 0.0]]))
    there, elsewhere = (
        Pursuit(CONFIG, goal_at(x, 0.0), path, OccupancyGrid(), 0.0, is_tight=True) for x in (5.0, -5.0)
    )
    assert [learning.is_barred(there) for _ in range(3)] == [False, False, False]
    assert not learning.is_barred(elsewhere)
    assert learning.is_barred(there)
    assert not learning.is_barred(there)  # counted afresh
    learning.note(known_m2=10.0, way_m=1.0, now_s=1.0)
    assert [learning.is_barred(there) for _ in range(3)] == [False, False, False]


def test_who_learns_something_meanwhile_may_turn_back_as_often_as_it_likes():
    learning = Learning(PursuitConfig(turns_back=3), Body())
    for k in range(10):
        learning.note(known_m2=10.0 + k, way_m=1.0, now_s=float(k))
        assert turned_back_from(learning, (5.0, 0.0)) is None


@pytest.mark.parametrize(("field", "value"), [("look_s", -1.0), ("patience_s", math.nan), ("slowest_mps", 0)])
def test_nonsense_is_refused(field, value):
    with pytest.raises(ValueError, match=field):
        PursuitConfig(**{field: value})
