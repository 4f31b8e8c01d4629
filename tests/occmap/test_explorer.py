"""The whole mind in small worlds: it explores all it can, ends, and says why."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from occmap import slices
from occmap.body import Body
from occmap.decision import Reason, Status
from occmap.explorer import Explorer, ExplorerConfig
from occmap.geometry import Pose2, Twist2
from occmap.goal_config import GoalConfig
from occmap.grid import Belief
from occmap.living_map import LivingMap
from occmap.localization import SlamLocalizer
from tests.occmap.explored_worlds import CELL, FLAT, TWO_ROOMS, Exploration, Sleepy, exploring


@pytest.mark.parametrize("strategy", ["nearest", "utility", "gain_per_cost", "gain_decay", "tour"])
def test_a_flat_is_explored_to_its_last_corner_without_touching_anything(strategy):
    flat = exploring(FLAT, ExplorerConfig(goals=GoalConfig(strategy=strategy)))
    last = flat.run(300.0)
    assert last.status is Status.COMPLETE
    assert flat.explored() > 0.99
    assert flat.world.least_clearance_m > 0.0
    told = {left.reason for left in last.unknown_left if "slit" not in left.why}  # a wall's crack may be one
    assert told <= {Reason.SPECK, Reason.SEALED}
    assert last.twist == Twist2.zero()


def test_a_world_taken_for_a_large_one_is_explored_to_its_last_corner_too(monkeypatch):
    monkeypatch.setattr("occmap.goal_search.LARGE_CELLS", 0)
    flat = exploring(FLAT)
    assert flat.run(300.0).status is Status.COMPLETE
    assert flat.explored() > 0.99


def test_the_same_world_is_explored_the_same_way():
    first, again = exploring(FLAT), exploring(FLAT)
    first.run(25.0)
    again.run(25.0)
    assert first.world.pose == again.world.pose
    np.testing.assert_array_equal(first.explorer.grid.log_odds, again.explorer.grid.log_odds)


def test_what_was_gone_before_the_robot_came_is_remembered_as_looked_at():
    flat = exploring(FLAT)
    mind, moments = flat.explorer, [(False, 0)]

    def was_on_its_way(_):
        (had_arrived, looks), now = moments[-1], len(mind.search.looked_at._looks)
        pursuit = mind.navigator.pursuit
        moments.append((pursuit is not None and pursuit.has_arrived, now))
        return now > looks and not had_arrived

    assert flat.run(60.0, until=was_on_its_way).status is Status.EXPLORING
    assert moments[-1][1] > moments[-2][1]


def test_a_short_sighted_robot_looks_from_no_farther_than_it_sees():
    """Looks that can show nothing would each have to be given up: 15 in this flat, and some of it unseen."""
    flat, sight_m = exploring(FLAT), 1.5
    scan = flat.world.scan
    flat.world.scan = lambda: scan(max_range_m=sight_m)
    assert flat.run(200.0).status is Status.COMPLETE
    assert flat.explored() > 0.99
    goals = [decision.goal for decision in flat.decisions if decision.goal is not None]
    away_m = [np.hypot(*(goal.watched_in_map - goal.viewpoint_in_map).T).min() for goal in goals]
    assert max(away_m) < sight_m
    assert sum("gave up" in event for event in flat.events) <= 3


def test_a_closed_room_is_complete_at_once():
    cell = exploring(CELL)
    assert cell.run(60.0).status is Status.COMPLETE
    assert cell.explored() > 0.99
    assert cell.world.time_s < 30.0


def test_having_ended_it_stands_and_says_the_same():
    cell = exploring(CELL)
    last = cell.run(60.0)
    again = cell.explorer.decide(cell.observe())
    assert (again.status, again.twist, again.activity) == (Status.COMPLETE, Twist2.zero(), "complete")
    assert again.unknown_left == last.unknown_left == cell.explorer.certificate()


def test_having_ended_it_leaves_its_map_as_it_is():
    cell = exploring(CELL)
    cell.run(60.0)
    before = cell.explorer.grid.log_odds.copy()
    for _ in range(20):
        cell.explorer.decide(cell.observe())
    np.testing.assert_array_equal(cell.explorer.grid.log_odds, before)


@pytest.mark.parametrize("nothing", [0.0, -math.inf, math.nan])
def test_a_covered_lidar_is_blindness_and_no_closed_room(nothing):
    cell = exploring(CELL)
    for _ in range(40):
        seen = cell.observe()
        covered = replace(seen.scan, ranges_m=np.full_like(seen.scan.ranges_m, nothing), min_range_m=0.0)
        last = cell.explorer.decide(replace(seen, scan=covered))
        cell.world.step(last.twist)
    assert (last.status, last.activity, last.twist) == (Status.EXPLORING, "blind", Twist2.zero())


def half_seen(exploration, robot_from_lidar):
    """Let it see by a lidar that is mounted elsewhere, and half round only."""
    world, observe = exploration.world, exploration.observe

    def see():
        here = world.pose
        world.pose = here @ robot_from_lidar
        scan = world.scan()
        world.pose = here
        ahead = np.abs(scan.bearings_rad) <= 0.5 * math.pi
        half = replace(scan, bearings_rad=scan.bearings_rad[ahead], ranges_m=scan.ranges_m[ahead])
        return replace(observe(), scan=half, robot_from_lidar=robot_from_lidar)

    exploration.observe = see


@pytest.mark.parametrize("robot_from_lidar", [Pose2(0.15, 0.0, 0.0), Pose2(-0.1, 0.0, math.pi)])
def test_a_lidar_need_not_look_over_the_robot(robot_from_lidar):
    flat = exploring(FLAT)
    half_seen(flat, robot_from_lidar)
    assert flat.run(400.0).status is Status.COMPLETE
    assert flat.explored() > 0.98
    assert flat.world.least_clearance_m > 0.0


def test_a_wall_without_an_echo_is_given_up():
    """Beams that meet the upper wall fail, so that what is behind it stays a frontier for ever."""
    hall = exploring(CELL)
    observe, wall_y_m = hall.observe, hall.world.boxes[:, 3].max() - hall.cell_m

    def see():
        seen = observe()
        angles = seen.scan.bearings_rad + hall.world.pose.yaw_rad
        to_wall_m = (wall_y_m - hall.world.pose.y_m) / np.sin(angles)
        is_dark = (to_wall_m > 0.0) & (seen.scan.ranges_m > to_wall_m - 0.15)
        return replace(
            seen, scan=replace(seen.scan, ranges_m=np.where(is_dark, math.nan, seen.scan.ranges_m))
        )

    hall.observe = see
    last = hall.run(120.0)
    assert last.status is Status.COMPLETE
    assert Reason.GAVE_UP in {left.reason for left in last.unknown_left}


def test_a_body_wider_than_the_clearances_that_others_ask_for_explores_too():
    halls = Exploration(TWO_ROOMS, Explorer(body=Body(radius_m=1.2)), cell_m=1.2)
    assert halls.run(300.0).status is Status.COMPLETE
    assert halls.explored() > 0.98


def test_clocks_may_be_set_back():
    cell = exploring(CELL)
    assert cell.run(1.0).status is Status.EXPLORING
    ahead = cell.observe
    cell.observe = lambda: replace(ahead(), time_s=ahead().time_s - 1000.0)
    assert cell.run(60.0).status is Status.COMPLETE


def test_clocks_may_stand():
    cell = exploring(CELL)
    ticking = cell.observe
    cell.observe = lambda: replace(ticking(), time_s=0.0)
    assert cell.run(60.0).status is Status.COMPLETE


def test_without_odometry_a_robot_is_no_more_stuck_than_with():
    flat = exploring(FLAT, localizer=SlamLocalizer())
    sensed = flat.observe
    flat.observe = lambda: replace(sensed(), odom_from_robot=Pose2(7.0, -3.0, 1.0))
    assert flat.run(300.0).status is Status.COMPLETE
    assert flat.explored() > 0.99
    assert flat.world.least_clearance_m > 0.0
    assert not [event for event in flat.events if "does not move" in event]


def test_without_odometry_a_robot_that_is_held_is_stuck():
    flat = exploring(FLAT, localizer=SlamLocalizer())
    sensed = flat.observe
    flat.observe = lambda: replace(sensed(), odom_from_robot=Pose2.identity())
    flat.run(10.0)
    flat.is_held = True
    assert flat.run(60.0).status is Status.STUCK


def test_long_thoughts_are_thought_in_turns(monkeypatch):
    """Standing, about one map: scans of the meantime are spent on it afterwards, each of them."""
    monkeypatch.setattr(slices, "TURN_CELLS", 4_000)
    insert, spent = LivingMap.insert, []
    monkeypatch.setattr(LivingMap, "insert", lambda *all_: (spent.append(1), insert(*all_)))
    flat, moments = exploring(FLAT), [(False, 0)]

    def remember(decision):
        is_thinking = decision.activity == "thinking"
        assert not is_thinking or decision.twist == Twist2.zero()
        moments.append((is_thinking, len(spent)))
        return False

    assert flat.run(300.0, until=remember).status is Status.COMPLETE
    assert flat.explored() > 0.99
    spent_since = [after - before for (was_thinking, before), (_, after) in pairwise(moments) if was_thinking]
    assert spent_since.count(0) > 10
    awake = [k for k in range(1, len(moments) - 1) if not moments[k - 1][0] and not moments[k][0]]
    assert all(moments[k][1] == k for k in awake)


def test_to_be_asked_for_the_certificate_in_the_middle_of_a_thought_is_no_harm(monkeypatch):
    monkeypatch.setattr(slices, "TURN_CELLS", 4_000)
    flat, asked = exploring(FLAT), []

    def ask(decision):
        if decision.activity == "thinking" and len(asked) < 5:
            asked.append(flat.explorer.certificate())
        return False

    assert flat.run(300.0, until=ask).status is Status.COMPLETE
    assert len(asked) == 5
    assert all(asked)
    assert flat.explored() > 0.99


def test_a_slot_too_narrow_for_the_body_is_named():
    """The slot of 0.2 m shows a part of the room behind."""
    picture = """#####################################
                 #.............#.....................#
                 #.............#.....................#
                 #.............#.....................#
                 #.............#.....................#
                 #.....@.............................#
                 #.............#.....................#
                 #.............#.....................#
                 #.............#.....................#
                 #.............#.....................#
                 #####################################"""
    slot = exploring(picture, cell_m=0.2)
    assert slot.run(240.0).status is Status.COMPLETE
    assert Reason.TOO_NARROW in slot.reasons()
    assert not slot.reasons() & {Reason.UNSAFE, Reason.UNVISITED}
    assert slot.world.least_clearance_m > 0.0


def closing_behind(is_closing):
    """The door closes, or not, as soon as the robot is well inside the other room, to look round a corner."""
    rooms = exploring(TWO_ROOMS)
    rooms.run(120.0, until=lambda _: rooms.world.pose.x_m > 11.8 * rooms.cell_m)
    if is_closing:
        rooms.close_doors()
    return rooms, rooms.run(240.0)


def test_a_door_that_closes_behind_the_robot_seals_it_in():
    rooms, last = closing_behind(is_closing=True)
    assert last.status is Status.SEALED_IN
    assert rooms.world.least_clearance_m > 0.0


def test_a_door_that_stays_open_does_not():
    rooms, last = closing_behind(is_closing=False)
    assert last.status is Status.COMPLETE
    assert rooms.explored() > 0.99


def test_a_door_that_opens_late_is_noticed():
    """The robot has seen it closed, and sees the room behind when it passes by again."""
    flat = exploring(FLAT.replace("######...########...#####", "######DDD########...#####"))
    open_boxes = flat.world.boxes
    flat.close_doors()
    flat.run(5.0)
    assert flat.explored() < 0.8
    flat.world.boxes = open_boxes
    assert flat.run(240.0).status is Status.COMPLETE
    assert flat.explored() > 0.99


def test_wheels_held_for_good_end_in_stuck_after_all_manoeuvres():
    flat = exploring(FLAT)
    flat.run(8.0)
    flat.is_held = True
    last = flat.run(240.0)
    assert last.status is Status.STUCK
    assert sum(event.startswith("the robot does not move") for event in flat.events) == 6
    assert {decision.activity for decision in flat.decisions} >= {"recovering", "stuck"}
    assert Reason.UNVISITED in flat.reasons()
    assert not flat.reasons() & {Reason.TOO_NARROW, Reason.GAVE_UP, Reason.UNSAFE}


def test_wheels_held_now_and_then_do_not_end_the_run():
    flat = exploring(FLAT)
    for _ in range(3):
        flat.run(8.0)
        flat.is_held = True
        flat.run(5.0)
        flat.is_held = False
    assert sum(event.startswith("the robot does not move") for event in flat.events) >= 3
    assert flat.run(300.0).status is Status.COMPLETE
    assert flat.explored() > 0.99


CORRIDOR = "\n".join(
    ["#" * 60, "#" + "." * 58 + "#", "#...@" + "." * 54 + "#", "#" + "." * 58 + "#", "#" * 60]
)


def test_what_bars_the_way_but_is_not_in_the_map_is_unsafe_and_not_touched():
    """The corridor is longer than the lidar sees; three metres ahead something has come down."""
    hall = exploring(CORRIDOR, localizer=Sleepy(from_s=1.0))
    hall.run(1.0)
    hall.world.boxes = np.vstack((hall.world.boxes, [(4.5, 0.0, 4.6, 1.5)]))
    last = hall.run(300.0)
    assert last.status is Status.COMPLETE
    assert Reason.UNSAFE in hall.reasons()
    assert any("bars the way" in left.why for left in last.unknown_left)
    assert hall.world.least_clearance_m > 0.0


def test_glass_that_is_seen_from_near_only_is_not_touched():
    hall = exploring(CORRIDOR)
    hall.run(2.0)
    walls, look = hall.world.boxes, hall.world.scan

    def scan(beams=360, max_range_m=12.0):
        hall.world.boxes = np.vstack((walls, [(4.5, 0.0, 4.55, 1.5)]))
        near = look(beams, max_range_m)
        hall.world.boxes = walls
        return replace(near, ranges_m=np.where(near.ranges_m < 0.5, near.ranges_m, look().ranges_m))

    hall.world.scan = scan
    assert hall.run(400.0).status in (Status.COMPLETE, Status.SEALED_IN)
    assert hall.world.pose.x_m < 4.5 - 0.17


def test_certificate_before_the_end_lists_what_is_yet_to_be_visited():
    flat = exploring(FLAT)
    assert flat.explorer.certificate() == ()
    flat.run(3.0)
    assert Reason.UNVISITED in flat.reasons()
    before = flat.run(3.0)
    assert before.unknown_left == ()
    assert len(flat.explorer.certificate()) == len(flat.explorer.map.frontiers)


def test_a_blind_robot_stands():
    flat = exploring(FLAT)
    flat.run(5.0)
    seen = flat.observe()
    nothing = replace(seen.scan, ranges_m=np.full(360, math.nan))
    decision = flat.explorer.decide(replace(seen, scan=nothing))
    assert (decision.activity, decision.twist) == ("blind", Twist2.zero())


def test_a_goal_is_dropped_in_the_scan_in_which_its_frontier_is_gone():
    flat = exploring(FLAT)
    goal = flat.run(30.0, until=lambda decision: decision.goal is not None).goal
    grid = flat.explorer.grid
    grid.log_odds[grid.state == Belief.UNKNOWN] = -3.0  # all is known of a sudden
    grid.state[grid.state == Belief.UNKNOWN] = Belief.FREE
    flat.explorer.map.replace(grid, Pose2.identity())
    decision = flat.explorer.decide(flat.observe())
    assert goal is not None
    assert decision.goal is None or decision.goal.distance_m(goal) > 0.5  # the wall's own flicker


def test_paths_end_at_viewpoints_and_goals_are_told():
    flat = exploring(FLAT)
    flat.run(20.0)
    under_way = [d for d in flat.decisions if d.goal is not None and d.path is not None]
    assert under_way
    for decision in under_way:
        assert math.dist(decision.path.goal, decision.goal.viewpoint_in_map) < 0.35
    assert any(event.startswith("frontier at (") for event in flat.events)
    assert under_way[0].stage_s.keys() >= {"localization", "mapping", "frontiers", "planning"}
