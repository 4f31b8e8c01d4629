"""Every frontier that remains has its reason: each in a small world made for it."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from occmap.certificate import certify
from occmap.decision import Reason
from occmap.goal_config import GoalConfig
from occmap.memory import FailedLooks
from occmap.slices import finish
from tests.occmap.goal_scenes import Scene, goal_at

BODY_RADIUS_M = 0.17


def certificate(scene, looks=None, unvisited=(), slits=(), *, is_early=True):
    listed = certify(
        scene.frontiers,
        scene.grid,
        scene.flood(),
        looks or FailedLooks(),
        GoalConfig(min_frontier_m=0.3),
        BODY_RADIUS_M,
        unvisited,
        slits=slits,
        is_early=is_early,
    )
    return finish(listed)


OPEN_ROOM = """##########
               #.....????
               #.....????
               #.....????
               ##########"""


def test_speck():
    (left,) = certificate(
        Scene("""#######
                 #.....#
                 #....?#
                 #.....#
                 #######""", resolution_m=0.05)
    )  # fmt: skip
    assert left.reason is Reason.SPECK
    assert left.why == "0.15 m long, shorter than the 0.30 m worth a look"


def test_sealed():
    """Floor seen through glass: free, and no free cell leads to it."""
    scene = Scene("""############
                     #....#...???
                     #....#...???
                     #....#...???
                     ############""")
    (left,) = certificate(scene)
    assert (left.reason, left.size_m) == (Reason.SEALED, pytest.approx(0.75))
    assert left.in_map == scene.frontiers[0].centroid_in_map


def beyond_a_slot():
    """Free cells lead through the slot, but the body stays 0.26 m from its sides."""
    row = "#" + 60 * "." + "{}" + 20 * "." + 8 * "?"
    rows = [row.format("." if y == 10 else "#") for y in range(21)]
    return Scene("\n".join([90 * "#", *rows, 90 * "#"]), (10, 10), resolution_m=0.05, body=None)


def test_too_narrow():
    (left,) = certificate(beyond_a_slot())
    assert left.reason is Reason.TOO_NARROW
    assert re.fullmatch(r"a body 0.34 m wide comes no nearer than 1.\d\d m", left.why)


def test_what_could_have_been_seen_from_afar_and_was_not_worth_the_way_is_told_as_that():
    scene = beyond_a_slot()
    (left,) = certificate(scene, unvisited=scene.frontiers, is_early=False)
    assert left.reason is Reason.TOO_NARROW
    assert "seen from afar" in left.why
    assert "not worth the way" in left.why


@pytest.mark.parametrize("reason", [Reason.GAVE_UP, Reason.UNSAFE])
def test_gave_up_and_unsafe_as_the_last_try_ended(reason):
    scene, looks = Scene(OPEN_ROOM), FailedLooks()
    place = scene.frontiers[0].centroid_in_map
    looks.note(goal_at(*place), Reason.GAVE_UP, "saw nothing", scene.grid)
    looks.note(goal_at(*place), reason, "once more", scene.grid)
    (left,) = certificate(scene, looks)
    assert (left.reason, left.why) == (reason, "2 tries: once more")


def test_unvisited_where_the_run_ended_first():
    scene = Scene(OPEN_ROOM)
    (left,) = certificate(scene, unvisited=scene.frontiers)
    assert left.reason is Reason.UNVISITED


def test_a_speck_where_it_was_not_worth_the_way():
    scene = Scene(OPEN_ROOM)
    (left,) = certificate(scene, unvisited=scene.frontiers, is_early=False)
    assert left.reason is Reason.SPECK
    assert "not worth the way" in left.why


def test_what_is_narrower_than_the_body_and_not_worth_the_way_is_too_narrow():
    scene = Scene(OPEN_ROOM, resolution_m=0.05)
    scene.frontiers = [replace(scene.frontiers[0], size=6)]  # 0.30 m
    (left,) = certificate(scene, unvisited=scene.frontiers, is_early=False)
    assert left.reason is Reason.TOO_NARROW
    assert "not worth the way" in left.why


def test_a_short_frontier_where_the_body_does_not_get_to_is_no_speck():
    """Noise flickers where the robot drives; what is in sight through a slot or through glass is a part."""
    row = "#" + 20 * "." + "{}" + 20 * "." + 8 * "#"
    rows = [row.format("." if y == 10 else "#") for y in range(21)]
    rows[10] = rows[10][:-8] + 8 * "?"
    slot = Scene("\n".join([50 * "#", *rows, 50 * "#"]), (10, 10), resolution_m=0.05, body=None)
    assert [left.reason for left in certificate(slot)] == [Reason.TOO_NARROW]
    rows[10] = rows[10][:21] + "#" + rows[10][22:]
    glass = Scene("\n".join([50 * "#", *rows, 50 * "#"]), (10, 10), resolution_m=0.05, body=None)
    assert [left.reason for left in certificate(glass)] == [Reason.SEALED]


@pytest.mark.parametrize("is_early", [True, False])
def test_what_was_glimpsed_only_is_told_in_the_end(is_early):
    scene = Scene(OPEN_ROOM, resolution_m=0.25)
    scene.grid.log_odds[1:4, 8] = -0.8
    told = [left for left in certificate(scene, is_early=is_early) if "glimpsed" in left.why]
    assert [left.reason for left in told] == ([] if is_early else [Reason.TOO_NARROW])


def test_every_frontier_is_in_it_once():
    scene = Scene("""############
                     ?....#...???
                     ?....#...???
                     ?..........?
                     ############""")
    assert [left.in_map for left in certificate(scene)] == [f.centroid_in_map for f in scene.frontiers]


def test_slits_not_worth_the_way_are_too_narrow_if_the_body_does_not_fit():
    scene = Scene(OPEN_ROOM)
    (frontier,) = scene.frontiers
    slits = [replace(frontier, size=1), replace(frontier, size=40)]
    _, narrow, wide = certificate(scene, slits=slits)
    assert (narrow.reason, wide.reason) == (Reason.TOO_NARROW, Reason.SPECK)
    assert "not worth the way" in narrow.why
