"""The search for the next goal: nearest by the way there, with hysteresis, and nothing overlooked."""

from __future__ import annotations

import math

import pytest

from occmap.decision import Reason
from occmap.goal_config import GoalConfig
from occmap.goal_search import GoalSearch
from occmap.grid import Belief
from occmap.memory import FailedLooks
from occmap.slices import finish
from tests.occmap.goal_scenes import Scene

MAX_RANGE_M = 12.0
NEAREST = GoalConfig(strategy="nearest")


class Searching(Scene):
    """A scene with a search in it, which counts its floods."""

    def __init__(self, picture, start=(1, 1), **options):
        super().__init__(picture, start, **options)
        self.looks = FailedLooks()
        self.search = GoalSearch(self.chooser, self.looks)
        self.chooser.sight_m = MAX_RANGE_M
        self.bounds_m = []

    def flood_within(self, bound_m):
        self.bounds_m.append(bound_m)
        yield 0
        return self.flood(bound_m)

    def run(self, pursued=None, way_left_m=0.0):
        self.bounds_m = []
        flood = self.flood_within
        return finish(self.search.run(self.frontiers, self.grid, flood, pursued, way_left_m))

    def unvisited(self, wave):
        return finish(self.search.unvisited(self.frontiers, self.grid, wave))

    def slits_left(self):
        return finish(self.search.slits_left(self.grid, self.flood()))

    def fail(self, goal, times=1):
        for _ in range(times):
            self.looks.note(goal, Reason.GAVE_UP, "in vain", self.grid)


DETOUR = """#########################
            #...........#...........#
            #...........#...........#
            ?...........#...........#
            ?...........#...........#
            ?...........#...........#
            #...........#...........#
            #...........#....########
            #...........#....?????..#
            #...........#....?????..#
            #...........#....########
            #...........#...........#
            #.......................#
            #.......................#
            #########################"""


def test_nearest_is_by_the_way_and_not_by_the_crow():
    """The frontier behind the wall is 1.5 m away as the crow flies and the other one 2.5 m."""
    scene = Searching(DETOUR, start=(11, 7), config=NEAREST)
    best = scene.run().best
    assert best is not None
    assert best.frontier.centroid_in_map[0] < 1.0


def test_a_flood_is_no_wider_than_proves_the_best():
    scene = Searching(DETOUR, start=(3, 10), config=NEAREST)
    assert scene.run().best is not None
    assert scene.bounds_m == [4.0]


def test_utility_prefers_a_large_gain_far_away_to_a_small_one_near():
    room = """########################################
              #.................................??????
              #?................................??????
              #?................................??????
              #.................................??????
              #.................................??????
              ########################################"""
    near = Searching(room, start=(3, 3), config=GoalConfig(gain_range_m=1.0)).run().best
    far = Searching(room, start=(3, 3), config=GoalConfig(strategy="utility", lambda_m_per_m2=20)).run().best
    assert near is not None
    assert far is not None
    assert near.frontier.centroid_in_map[0] < 1.0 < 8.0 < far.frontier.centroid_in_map[0]


TWO_ENDS = """############################
              ?..........................?
              ?..........................?
              ?..........................?
              ############################"""


@pytest.mark.parametrize(("start", "stays"), [((11, 2), True), ((6, 2), False)])
def test_a_goal_is_kept_unless_another_is_better_by_the_hysteresis(start, stays):
    config = GoalConfig("nearest", hysteresis_m=2.0, look_from_m=(1.0,), look_into_m=(0.25,))
    scene = Searching(TWO_ENDS, start=(13, 2), config=config)
    right = max(scene.run().goals, key=lambda goal: goal.viewpoint_in_map)
    scene.start = start
    chosen = scene.run(pursued=right).best
    assert (chosen.frontier.centroid_in_map[0] > 4.0) == stays
    assert scene.run().best.frontier.centroid_in_map[0] < 1.0  # without it the left is nearer


def test_hysteresis_holds_across_the_bound_of_a_flood():
    """The pursued goal lies just beyond 4 m, its rival just within: a flood of 4 m knows only the latter."""
    corridor = "?" + 34 * "." + "?"
    picture = "\n".join([36 * "#", corridor, corridor, corridor, 36 * "#"])
    config = GoalConfig("nearest", look_from_m=(0.25,), look_into_m=(0.25,))
    scene = Searching(picture, config=config, start=(17, 2))
    right = max(scene.run().goals, key=lambda goal: goal.viewpoint_in_map)
    scene.start = (16, 2)
    left, right_now = sorted(scene.run(pursued=right).goals, key=lambda goal: goal.viewpoint_in_map)
    assert left.cost_m < 4.0 < right_now.cost_m < left.cost_m + config.hysteresis_m
    chosen = scene.run(pursued=right).best
    assert chosen is not None
    assert chosen.viewpoint_in_map == right_now.viewpoint_in_map


NEAREST_IN_BETWEEN = """##############################??################################
                        ?..............................................................?
                        ?..............................................................?
                        ?..............................................................?
                        ################################################################"""


def test_a_tour_passes_the_nearest_by_if_it_comes_by_again():
    """The niche is 2.8 m to the right, the short end 4.8 m to the left; the long end beyond the niche."""
    on_tour, greedy = (
        Searching(
            NEAREST_IN_BETWEEN, (19, 2), config=GoalConfig(strategy, look_from_m=(0.5,), look_into_m=(0.25,))
        )
        for strategy in ("tour", "nearest")
    )
    best = on_tour.run().best
    assert best is not None
    assert best.frontier.centroid_in_map[0] < 1.0
    assert greedy.run().best.frontier.centroid_in_map[0] > 7.0
    on_tour.fail(best)
    assert on_tour.run().best.frontier.centroid_in_map[0] > 7.0


def test_what_no_tour_gets_to_is_sought_without_one():
    scene = Searching(
        slot_room(), (10, 10), resolution_m=0.05, body=None, config=GoalConfig("tour", min_nook_m=9.0)
    )
    assert scene.run().best.viewpoint_in_map[0] < 1.0


def test_specks_never_attract():
    picture = """############
                 #..........#
                 #....?.....#
                 #..........#
                 ############"""
    assert Searching(picture, config=GoalConfig(min_frontier_m=1.1, min_nook_m=9.0)).run().best is None
    assert Searching(picture, config=GoalConfig(min_frontier_m=0.9)).run().best is not None


CELL = """##########
          #.....????
          #.....????
          #.....????
          ##########"""


def test_a_frontier_is_given_up_after_as_many_looks_as_there_are_and_then_no_more():
    scene = Searching(CELL)
    looks = 0
    while (best := scene.run().best) is not None and looks < 9:
        scene.fail(best)
        looks += 1
    assert looks == len(scene.chooser.config.look_from_m)
    assert scene.run().wave.is_exhausted  # no goal means none in all that can be reached


def test_failed_looks_are_forgotten_when_the_map_changes_and_the_goal_is_back():
    scene = Searching(CELL)
    scene.fail(scene.run().best, times=3)
    assert scene.run().best is None
    scene.grid.state[:, 6:9] = scene.grid.state[:, 3:6]
    scene.edges.rebuild(scene.grid)
    scene.frontiers = scene.edges.clusters(scene.grid)
    assert scene.run().best is not None


def slot_room(rows=21, slot_row=10):
    """A room of 1 m x 1 m, beside it another of which only what a slot of one cell shows is known."""
    lines = ["#" * 60]
    for row in range(1, rows - 1):
        lines.append("#" + "." * 20 + ("." if row == slot_row else "#") + "." * 12 + "?" * 25 + "#")
    return "\n".join([*lines, "#" * 60])


def test_what_cannot_be_looked_at_from_near_is_looked_at_through_the_slot():
    scene = Searching(slot_room(), (10, 10), resolution_m=0.05, body=None, config=GoalConfig(min_nook_m=9.0))
    assert scene.flood().cost_at(scene.frontiers[0].cells).min() == math.inf
    found = scene.run()
    assert found.best is not None
    assert found.best.viewpoint_in_map[0] < 1.0
    scene.fail(found.best)
    scene.fail(scene.run().best)
    assert scene.run().best is None  # a look from afar is worth two tries


def test_when_nothing_else_is_left_nooks_are_looked_into_once():
    upper = ["#" * 11 + "??????" + "#" * 5] * 12
    picture = "\n".join(["#" * 22, *upper, *["#" + "." * 20 + "#"] * 20, "#" * 22])
    scene = Searching(picture, (10, 10), resolution_m=0.05, body=None)
    scene.frontiers = []  # the frontier map leaves rims out
    best = scene.run().best
    assert best is not None
    assert best.is_nook
    scene.fail(best)
    assert scene.run().best is None


@pytest.mark.parametrize(("gap_cells", "is_looked_into"), [(8, True), (5, False)])
def test_a_gap_as_wide_as_the_robot_is_looked_into_once_though_beams_have_been_there(
    gap_cells, is_looked_into
):
    upper = ["#" * 7 + "?" * gap_cells + "#" * (15 - gap_cells)] * 12
    picture = "\n".join(["#" * 22, *upper, *["#" + "." * 20 + "#"] * 20, "#" * 22])
    scene = Searching(picture, (10, 10), resolution_m=0.05, body=None)
    scene.grid.log_odds[scene.grid.state == Belief.UNKNOWN] = -0.4  # a beam went in: this is no slit
    scene.frontiers = []  # clutter in the gap left nothing but rims
    best = scene.run().best
    assert (best is not None) == is_looked_into
    if best is not None:
        assert best.is_nook
        scene.search.looked_at.note(best, scene.grid)
        assert scene.run().best is None


@pytest.mark.parametrize(("gap_cells", "is_worth_the_way"), [(18, True), (12, False)])
def test_a_wide_gap_is_come_back_for_from_afar(gap_cells, is_worth_the_way):
    """A corner in the shadow of nothing in particular, whose frontier noise has broken up into specks."""
    upper = ["#" * 230 + "?" * gap_cells + "#" * (30 - gap_cells)] * 6
    picture = "\n".join(["#" * 260, *upper, *["#" + "." * 258 + "#"] * 20, "#" * 260])
    scene = Searching(picture, (10, 10), resolution_m=0.05, body=None)
    scene.grid.log_odds[scene.grid.state == Belief.UNKNOWN] = -0.4
    scene.frontiers = []
    best = scene.run().best
    assert (best is not None) == is_worth_the_way
    assert best is None or best.cost_m > scene.search.chooser.config.worth_way_m


def corridor_with_far_recess():
    """15 m x 0.8 m in cells of 0.1 m; beside its far end a recess of 0.4 m x 0.2 m has not been seen."""
    recess = ["#" * 145 + "????" + "###"] * 2
    return "\n".join(["#" * 152, *recess, *["#" + "." * 150 + "#"] * 8, "#" * 152])


@pytest.mark.parametrize(
    ("start", "worth_gain_m2", "is_worth"), [(5, 0.1, False), (120, 0.1, True), (5, 0, True)]
)
def test_what_hides_next_to_nothing_is_looked_into_in_passing_only(start, worth_gain_m2, is_worth):
    config = GoalConfig(worth_gain_m2=worth_gain_m2, min_nook_m=9.0)
    scene = Searching(corridor_with_far_recess(), (start, 4), resolution_m=0.1, config=config)
    assert (scene.run().best is not None) == is_worth
    wave = scene.flood()
    assert scene.unvisited(wave) == scene.frontiers


@pytest.mark.parametrize(
    ("start", "worth_nook_m2", "is_worth"), [(5, 9.0, False), (180, 9.0, True), (5, 0.0, True)]
)
def test_a_slit_far_away_that_promises_little_is_left_and_told(start, worth_nook_m2, is_worth):
    slit = ["#" * 190 + "??????" + "#" * 46] * 12
    picture = "\n".join(["#" * 242, *slit, *["#" + "." * 240 + "#"] * 20, "#" * 242])
    config = GoalConfig(worth_nook_m2=worth_nook_m2)
    scene = Searching(picture, (start, 16), resolution_m=0.05, body=None, config=config)
    scene.frontiers = []  # the frontier map leaves rims out
    best = scene.run().best
    assert (best is not None) == is_worth
    (mouth,) = scene.slits_left()
    assert abs(mouth.centroid_in_map[0] - 9.7) < 0.2


def corridor_with_far_slot():
    """12 m x 0.65 m in cells of 0.05 m; through a slot in its far end half a closet is in sight."""
    lines = ["#" * 251]
    for row in range(13):
        closet = "......??" if 2 <= row <= 10 else "#" * 8
        lines.append("#" + "." * 240 + ("." if row == 6 else "#") + closet + "#")
    return "\n".join([*lines, "#" * 251])


@pytest.mark.parametrize(("start", "is_worth"), [(5, False), (120, True)])
def test_what_is_in_sight_from_afar_alone_may_not_be_worth_the_way_and_yet_is_told(start, is_worth):
    scene = Searching(
        corridor_with_far_slot(), (start, 7), resolution_m=0.05, body=None, config=GoalConfig(min_nook_m=9.0)
    )
    assert (scene.run().best is not None) == is_worth
    wave = scene.flood()
    assert scene.unvisited(wave) == scene.frontiers


def test_unvisited_are_those_that_could_still_be_looked_into():
    scene = Searching(TWO_ENDS, config=NEAREST)
    assert scene.unvisited(scene.flood()) == scene.frontiers
    left = min(scene.run().goals, key=lambda goal: goal.viewpoint_in_map)
    scene.fail(left, times=3)
    (other,) = scene.unvisited(scene.flood())
    assert other.centroid_in_map[0] > 4.0


@pytest.mark.parametrize("tries", [0, 3])
def test_what_is_remembered_of_a_large_building_changes_nothing_while_that_stays_the_same(monkeypatch, tries):
    found = []
    for large_cells in (10**9, 0):
        monkeypatch.setattr("occmap.goal_search.LARGE_CELLS", large_cells)
        scene = Searching(DETOUR, start=(11, 7))
        for frontier in scene.frontiers:
            goal = scene.chooser.goal_for(frontier, scene.grid, scene.flood(math.inf), 2.5, 1.0)
            scene.fail(goal, times=tries if goal is not None else 0)
        goals = [scene.run().best for _ in range(25)]
        found.append([None if goal is None else goal.viewpoint_in_map for goal in goals])
    assert found[0] == found[1]


LONG = "\n".join(["#" * 250, *3 * ["?" + "." * 248 + "?"], "#" * 250])
"""A corridor of 62 m, open at both ends."""


def test_a_far_goal_is_kept_without_a_flood_that_reaches_it_while_nothing_turns_up_near():
    scene = Searching(LONG, start=(40, 2), config=NEAREST)
    near, far = sorted(scene.frontiers, key=lambda frontier: frontier.centroid_in_map)
    scene.frontiers = [far]
    pursued = scene.run().best
    assert pursued.cost_m > 45.0
    again = scene.run(pursued, way_left_m=pursued.cost_m)
    assert again.best is pursued
    assert not again.wave.is_exhausted
    assert max(scene.bounds_m) < pursued.cost_m
    scene.run(pursued)  # no path holds: it is sought as of now
    assert max(scene.bounds_m) > pursued.cost_m
    scene.frontiers = [near, far]
    assert scene.run(pursued, way_left_m=pursued.cost_m).best.cost_m < 12.0
