"""The truth grid and the explorable area: laws, and a brute-force twin of the kernel."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from occmap.geometry import Pose2
from sim.building import Box, Building, Cylinder, Door
from sim.starts import BODY_RADIUS_M
from sim.truth import (
    MARGIN_M,
    PLACE_SPACING_M,
    TruthGrid,
    building_summary,
    explorable,
    grown,
    reachable,
    rim,
    surface,
    truth_grid,
)
from tests.ascii_maps import ascii_map, cells


def a_building(*solids: Box | Cylinder, doors: tuple[Door, ...] = ()) -> Building:
    return Building("b", "plan", (0.0, 0.0), (1.0, 1.0), solids, Pose2(0.5, 0.5, 0.0), doors=doors)


def drawn(text: str, resolution_m: float = 0.1) -> TruthGrid:
    return TruthGrid(resolution_m, (0.0, 0.0), ascii_map(text) == "#")


def at(truth: TruthGrid, ix: int, iy: int) -> Pose2:
    x_m, y_m = truth.world_from_cell(np.array([[ix, iy]]))[0]
    return Pose2(float(x_m), float(y_m), 0.0)


def test_a_mask_grows_by_its_eight_neighbours() -> None:
    mask = ascii_map("""#....
                        .....
                        ...#.
                        .....""")
    by_one = ascii_map("""##...
                          #####
                          ..###
                          ..###""")
    np.testing.assert_array_equal(grown(mask == "#"), by_one == "#")


def line(x0: int, y0: int, x1: int, y1: int) -> list[tuple[int, int]]:
    """Bresenham's line (Bresenham 1965), the twin of the kernel's."""
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx, sy = (1 if x1 > x0 else -1), (1 if y1 > y0 else -1)
    error, visited = dx - dy, [(x0, y0)]
    while (x0, y0) != (x1, y1):
        twice = 2 * error
        if twice > -dy:
            error, x0 = error - dy, x0 + sx
        if twice < dx:
            error, y0 = error + dx, y0 + sy
        visited.append((x0, y0))
    return visited


def is_clear(wall: np.ndarray, cells: list[tuple[int, int]]) -> bool:
    """No wall on a line, nor two that touch at a corner which it turns around."""
    corners = [wall[y0, x1] and wall[y1, x0] for (x0, y0), (x1, y1) in itertools.pairwise(cells)]
    return not any(wall[y, x] for x, y in cells) and not any(corners)


def explorable_by_hand(truth: TruthGrid, start: Pose2, range_m: float) -> np.ndarray:
    """The definition, word by word: every free cell against every place."""
    stride = max(1, math.floor(PLACE_SPACING_M / truth.resolution_m + 1e-6))
    reached = reachable(truth, start, BODY_RADIUS_M)
    places = [(ix, iy) for iy, ix in np.argwhere(reached).tolist() if ix % stride == 0 and iy % stride == 0]
    places.append(truth.cell_of(start))
    seen = np.zeros_like(truth.wall)
    for iy, ix in np.argwhere(~truth.wall).tolist():
        seen[iy, ix] = any(
            math.hypot(px - ix, py - iy) * truth.resolution_m <= range_m + 1e-9
            and is_clear(truth.wall, line(ix, iy, px, py))
            for px, py in places
        )
    return seen


def random_rooms(seed: int) -> TruthGrid:
    """Noise in a closed room: pockets, slots and specks at once."""
    rng = np.random.default_rng(seed)
    wall = rng.random((44, 56)) < 0.02
    wall[[0, -1], :] = wall[:, [0, -1]] = True
    wall[20, 5:50] = True
    wall[20, 12:20] = False
    wall[22:40, 30] = True
    wall[18:27, 12:20] = wall[4:14, 36:46] = False
    return TruthGrid(0.1, (0.0, 0.0), wall)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("range_m", [1.3, 12.0])
def test_the_kernel_equals_its_twin(seed: int, range_m: float):
    truth = random_rooms(seed)
    start = at(truth, 41, 9)
    found = explorable(truth, start, BODY_RADIUS_M, range_m)
    assert found.any()
    np.testing.assert_array_equal(found, explorable_by_hand(truth, start, range_m))


def test_a_solid_marks_the_cells_that_it_touches_and_no_other():
    truth = truth_grid(a_building(Box(0.5, 0.3, 0.2, 0.1)), 0.1)
    marked = truth.world_from_cell(np.argwhere(truth.wall)[:, ::-1])
    assert truth.wall.sum() == 4 * 2  # ends on cells' borders: the cells beyond are not touched
    assert (np.abs(marked - [0.5, 0.3]) < [0.2, 0.1]).all()


def test_the_grid_reaches_beyond_the_bounds():
    truth = truth_grid(a_building(), 0.1)
    assert truth.origin_m == pytest.approx((-0.1, -0.1))
    assert truth.wall.shape == (12, 12)


def test_solids_that_stick_out_of_the_bounds_are_drawn():
    truth = truth_grid(a_building(Box(1.2, 0.5, 0.2, 0.1)), 0.1)
    assert truth.wall.sum() == 4 * 2
    assert truth.cell_from_world(np.array([[1.35, 0.55]]))[0].tolist() == [14, 6]
    assert truth.wall[6, 14]


@pytest.mark.parametrize(("x_m", "y_m"), [(-1.5, 0.5), (2.5, 0.5), (0.5, -1.5), (0.5, 2.5), (-1.5, -1.5)])
@pytest.mark.parametrize("solid", [Box(0, 0, 0.2, 0.2), Box(0, 0, 0.2, 0.2, 0.4), Cylinder(0, 0, 0.2)])
def test_what_stands_wholly_outside_is_not_drawn(x_m: float, y_m: float, solid: Box | Cylinder):
    assert not truth_grid(a_building(replace(solid, x_m=x_m, y_m=y_m)), 0.1).wall.any()


@pytest.mark.parametrize("yaw_rad", [0.3, math.pi / 4, 2.0, -1.1])
def test_turned_boxes_and_cylinders_touch_the_cells_that_sampling_finds(yaw_rad: float):
    box, pole = Box(0.52, 0.47, 0.31, 0.13, yaw_rad), Cylinder(0.2, 0.83, 0.12)
    truth = truth_grid(a_building(box, pole), 0.1)
    fine = (
        np.stack(np.meshgrid(np.arange(0, 1, 0.002), np.arange(0, 1, 0.002)), axis=-1).reshape(-1, 2) + 0.001
    )
    local = Pose2(box.x_m, box.y_m, yaw_rad).inverse().apply(fine)
    in_box = (np.abs(local) < [box.half_x_m, box.half_y_m]).all(axis=1)
    in_pole = np.hypot(*(fine - [pole.x_m, pole.y_m]).T) < pole.radius_m
    sampled = np.zeros_like(truth.wall)
    touched = truth.cell_from_world(fine[in_box | in_pole])
    sampled[touched[:, 1], touched[:, 0]] = True
    assert not (sampled & ~truth.wall).any()
    assert (truth.wall & ~sampled).sum() <= 2  # touched by less than the sampling step


def test_what_ends_below_the_lidar_is_no_wall():
    assert not truth_grid(a_building(Box(0.5, 0.5, 0.2, 0.2, height_m=0.15)), 0.1).wall.any()


def test_doors_stand_open_unless_closed():
    building = a_building(doors=(Door(Box(0.5, 0.5, 0.45, 0.02)), Door(Box(0.5, 0.8, 0.45, 0.02))))
    assert not truth_grid(building, 0.1).wall.any()
    row = truth_grid(building, 0.1, closed_doors={1}).wall.any(axis=1)
    assert np.flatnonzero(row).tolist() == [8, 9]  # y = 0.78 to 0.82, on both sides of a border


def test_a_gap_is_passed_if_the_body_and_the_margin_fit():
    wide = """##########.....##########"""
    narrow = """##########....###########"""
    for slot, passes in ((wide, True), (narrow, False)):
        room = "\n".join(["#" + "." * 23 + "#"] * 9)
        truth = drawn(f"{'#' * 25}\n{room}\n{slot}\n{room}\n{'#' * 25}")
        reached = reachable(truth, at(truth, 12, 4), BODY_RADIUS_M)
        assert reached[4, 12]
        assert reached[15, 12] == passes  # 5 cells are 0.50 m: 2 * (0.17 + 0.05) = 0.44 fits, 0.40 does not


def test_a_room_behind_a_slot_is_seen_through_it_but_only_there():
    room = "\n".join(["#" + "." * 23 + "#"] * 9)
    truth = drawn(f"{'#' * 25}\n{room}\n{'#' * 12 + '.' + '#' * 12}\n{room}\n{'#' * 25}")
    seen = explorable(truth, at(truth, 12, 4), BODY_RADIUS_M, 12.0)
    assert seen[1:10, 1:24].all()
    assert seen[15, 12]
    assert not seen[12, 1]


def test_walls_that_touch_at_a_corner_are_closed_there():
    truth = drawn("""################
                        #..............#
                        #..............#
                        #..............#
                        #..............#
                        #..............#
                        ########.......#
                        #.......########
                        #..............#
                        #..............#
                        ################""")
    seen = explorable(truth, at(truth, 4, 2), BODY_RADIUS_M, 12.0)
    assert not seen[7:10, 8:15].any()


def test_a_start_in_a_closed_room_sees_that_room_alone():
    room = "\n".join(["#" + "." * 9 + "#" + "." * 9 + "#"] * 9)
    truth = drawn(f"{'#' * 21}\n{room}\n{'#' * 21}")
    seen = explorable(truth, at(truth, 5, 5), BODY_RADIUS_M, 12.0)
    assert seen[1:10, 1:10].all()
    assert seen.sum() == 81


def test_the_start_is_a_place_even_where_the_body_cannot_turn():
    truth = drawn("""#######
                     #.....#
                     #######""")
    assert cells(explorable(truth, at(truth, 3, 1), BODY_RADIUS_M, 12.0)) == {(x, 1) for x in range(1, 6)}


def test_a_start_beside_a_wall_belongs_to_the_floor_next_to_it():
    truth = random_rooms(0)
    near_wall, inside = at(truth, 42, 1), at(truth, 41, 9)
    assert not reachable(truth, inside, BODY_RADIUS_M)[1, 42]
    np.testing.assert_array_equal(
        reachable(truth, near_wall, BODY_RADIUS_M), reachable(truth, inside, BODY_RADIUS_M)
    )


def test_range_limits_what_is_seen():
    truth = drawn("#" * 100 + "\n" + "." * 100 + "\n" + "#" * 100)
    # Too narrow to move: no place but the start.
    seen = explorable(truth, at(truth, 10, 1), BODY_RADIUS_M, 3.0)
    assert np.flatnonzero(seen[1]).max() == 40


def test_rim_and_surface_face_each_other():
    wall = (
        ascii_map("""......
                        ..##..
                        ..##..
                        ......""")
        == "#"
    )
    free = ~wall
    assert cells(rim(wall)) == {(x, y) for x in range(1, 5) for y in range(4)} - cells(wall)
    assert cells(surface(wall, free)) == cells(wall)
    assert not surface(wall, np.zeros_like(wall)).any()


def test_mistakes_are_named():
    truth = random_rooms(0)
    with pytest.raises(ValueError, match="inside a wall"):
        explorable(truth, at(truth, 0, 0), BODY_RADIUS_M, 12.0)
    with pytest.raises(ValueError, match="outside"):
        explorable(truth, Pose2(-3.0, 0.0, 0.0), BODY_RADIUS_M, 12.0)
    for resolution_m in (0.0, -0.05, math.nan):
        with pytest.raises(ValueError, match="resolution_m must be positive"):
            truth_grid(a_building(), resolution_m)


def test_cells_that_do_not_suit_a_building_are_refused_with_its_size():
    for resolution_m, complaint in ((6e-5, "more than 250000000 cells of 6e-05 m"), (1.5, "cells of 1.5 m")):
        with pytest.raises(ValueError, match=f"the building spans 1 m x 1 m: {complaint}"):
            truth_grid(a_building(), resolution_m)
    assert not truth_grid(a_building(), 1.0).wall.any()


def test_the_summary_counts_what_stands_there():
    building = a_building(
        Box(0.5, 0.05, 0.5, 0.05), Cylinder(0.8, 0.8, 0.02), doors=(Door(Box(0.5, 0.5, 0.4, 0.02)),)
    )
    summary = building_summary(building, truth_grid(building, 0.1))
    assert summary["doors"] == 1
    assert summary["obstacles"] == 1
    assert summary["size_m"] == [1.0, 1.0]
    assert 0.9 < summary["free_area_m2"] < 1.44
    assert MARGIN_M == 0.05
