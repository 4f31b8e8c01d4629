"""Looks and what they show: every kernel against a plain twin."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from occmap import goals_kernels as kernels
from occmap.grid import Belief
from tests.ascii_maps import ascii_state

UNREACHED = 10**9
EIGHT = [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)]


def some_state(seed, shape=(40, 50), p=(0.3, 0.6, 0.1)):
    return np.random.default_rng(seed).choice(3, shape, p=p).astype(np.uint8)


def line(x0, y0, x1, y1):
    """The cells of a Bresenham line after its first: along the longer axis, ties as the kernel has them."""
    dx, dy, cells = abs(x1 - x0), abs(y1 - y0), []
    sx, sy, error = (1 if x0 < x1 else -1), (1 if y0 < y1 else -1), dx - dy
    while (x0, y0) != (x1, y1):
        move_x, move_y = 2 * error > -dy, 2 * error < dx
        x0, y0, error = x0 + sx * move_x, y0 + sy * move_y, error - dy * move_x + dx * move_y
        cells.append((x0, y0))
    return cells


def sees_twin(state, x0, y0, x1, y1, most_unknown):
    cells = line(x0, y0, x1, y1)
    met = [state[y, x] for x, y in cells]
    squeezes = any(
        state[ay, bx] == state[by, ax] == Belief.OCCUPIED
        for (ax, ay), (bx, by) in zip([(x0, y0), *cells], cells, strict=False)
        if ax != bx and ay != by
    )
    return Belief.OCCUPIED not in met and met.count(Belief.UNKNOWN) <= most_unknown and not squeezes


def test_a_look_equals_its_twin():
    rng, state = np.random.default_rng(1), some_state(0, p=(0.2, 0.75, 0.05))
    answers = []
    for _ in range(2000):
        x0, x1 = rng.integers(0, 50, 2).tolist()
        y0, y1 = rng.integers(0, 40, 2).tolist()
        most = int(rng.integers(0, 8))
        answers.append(kernels.sees(state, x0, y0, x1, y1, most))
        assert answers[-1] == sees_twin(state, x0, y0, x1, y1, most)
    assert 100 < sum(answers) < 1900


def sees_into_twin(state, x0, y0, target):
    x1, y1, depth, *mouth = (int(value) for value in target)
    cells = line(x0, y0, x1, y1)
    met = "".join("?.#"[state[y, x]] for x, y in cells)
    first = len(met.rstrip("?"))  # of the unknown at its end
    entry = cells[first] if first < len(cells) else (x1, y1)
    is_clear = sees_twin(state, x0, y0, x1, y1, depth + depth // 4 + 1) and "??." not in met
    return is_clear and np.abs(np.subtract(entry, mouth)).max() <= depth // 4 + kernels.MOUTH_CELLS


def sees_into(state, x0, y0, *target):
    return kernels.sees_into(state, x0, y0, np.array([target]), 0)


def test_a_look_into_the_unknown_equals_its_twin():
    rng, state = np.random.default_rng(2), some_state(0, p=(0.25, 0.72, 0.03))
    targets = np.column_stack(
        (*rng.integers(0, (50, 40), (2000, 2)).T, rng.integers(1, 8, 2000), np.zeros((2000, 2), int))
    )
    targets[:, 3:] = targets[:, :2] + rng.integers(-5, 6, (2000, 2))
    answers = []
    for k, target in enumerate(targets):
        x0, y0 = rng.integers(0, (50, 40)).tolist()
        answers.append(kernels.sees_into(state, x0, y0, targets, k))
        assert answers[-1] == sees_into_twin(state, x0, y0, target)
    assert 50 < sum(answers) < 1900


def test_what_is_walled_off_is_not_seen_from_the_other_end_either():
    rng, state = np.random.default_rng(4), some_state(0, p=(0.2, 0.55, 0.25))
    state[:, 20:23] = rng.choice(3, (40, 3), p=(0.1, 0.1, 0.8))  # a wall with holes
    answers = []
    for _ in range(4000):
        x0, x1 = rng.integers(0, 50, 2).tolist()
        y0, y1 = rng.integers(0, 40, 2).tolist()
        is_walled_off, followed = kernels.is_walled_off(state, x1, y1, x0, y0)
        answers.append(is_walled_off)
        assert not (is_walled_off and kernels.sees(state, x0, y0, x1, y1, 99))
        length = max(abs(x1 - x0), abs(y1 - y0))
        assert 0 < followed < length if is_walled_off else followed == length
    assert 1000 < sum(answers) < 3800


def test_no_look_goes_through_a_wall_that_beams_have_only_grazed():
    """Seen along both of its sides, a thin wall stays undecided here and there."""
    state = ascii_state("""....#.......?
                           ....??......?
                           ....?.......?""")
    assert not sees_into(state, 0, 1, 12, 1, 4, 11, 1)
    assert sees_into(state, 6, 1, 12, 1, 4, 11, 1)
    assert sees_into(state, 0, 0, 12, 0, 4, 11, 0)  # a speck is no wall
    assert kernels.sees(state, 0, 1, 12, 1, 4)


def test_a_look_goes_in_where_the_frontier_is():
    """Behind the frontier along the lower side of something, not into it by a dent of its upper side."""
    state = ascii_state("""..........
                           ##??######
                           ##????????
                           ##????????
                           ##????????
                           ..........
                           ..........""")
    behind = 7, 3, 2, 7, 1  # two cells behind a frontier cell
    assert sees_into(state, 9, 0, *behind)
    assert not sees_into(state, 1, 6, *behind)
    assert sees_into(state, 1, 6, 4, 4, 2, 3, 6)  # a frontier by itself


def test_no_look_goes_between_walls_that_touch_at_a_corner():
    state = ascii_state("""..#.
                           .#..
                           ....""")
    assert not kernels.sees(state, 1, 2, 2, 1, 9)
    assert kernels.sees(state, 0, 1, 0, 2, 9)


def beyond_twin(state, cells, limit, deepest):
    def depth_of(x, y, dx, dy):
        depth = 0
        while depth < deepest:
            ux, uy = x + (depth + 1) * dx, y + (depth + 1) * dy
            inside = 0 <= ux < state.shape[1] and 0 <= uy < state.shape[0]
            if not inside or state[uy, ux] != Belief.UNKNOWN:
                break
            depth += 1
        return depth

    def beside_wall(x, y):
        return (state[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2] == Belief.OCCUPIED).any()

    step = max(1.0, len(cells) / limit)
    clear, rim = [], []
    position = 0.5 * (step - 1.0)
    while position < len(cells) and len(clear) < limit:
        x, y = cells[int(position)].tolist()
        position += step
        depths = {way: depth_of(x, y, *way) for way in EIGHT[:4]}
        ways = [way for way in EIGHT[:4] if depths[way]]
        free = [k for k, way in enumerate(ways) if not beside_wall(x + way[0], y + way[1])]
        beside = ways[: free[0]] if free else ways
        rim += [(way, depths[way], x, y) for way in beside]
        if free:
            clear.append((ways[free[0]], depths[ways[free[0]]], x, y))
    rim = rim[:limit]
    return [(x + depth * dx, y + depth * dy, depth, x, y) for (dx, dy), depth, x, y in clear or rim]


@pytest.mark.parametrize("seed", range(5))
def test_the_unknown_beyond_equals_its_twin(seed):
    state = some_state(seed, p=(0.5, 0.45, 0.05))
    iy, ix = np.nonzero(state == Belief.FREE)
    cells = np.column_stack((ix, iy))
    for n, limit, deepest in ((1, 12, 5), (12, 12, 3), (40, 12, 4), (100, 7, 9)):
        some = np.ascontiguousarray(cells[seed : seed + n])
        found = kernels.unknown_beyond(state, some, limit, deepest)
        assert [tuple(row) for row in found.tolist()] == beyond_twin(state, some, limit, deepest)


@pytest.mark.parametrize("seed", range(3))
def test_the_unknown_inside_equals_its_twin(seed):
    state = some_state(seed, p=(0.7, 0.25, 0.05))
    iy, ix = np.nonzero(state == Belief.FREE)
    mouth = np.ascontiguousarray(np.column_stack((ix, iy))[seed : seed + 30])
    expected = []
    for x, y in mouth.tolist():
        for dx, dy in EIGHT:
            run = itertools.takewhile(
                lambda k, x=x, y=y, dx=dx, dy=dy: (
                    0 <= x + k * dx < state.shape[1]
                    and 0 <= y + k * dy < state.shape[0]
                    and state[y + k * dy, x + k * dx] == Belief.UNKNOWN
                ),
                range(1, 7),
            )
            depth = len(list(run))
            if depth >= 2:
                expected.append([x + depth * dx, y + depth * dy, depth, x, y])
    assert expected
    assert kernels.unknown_inside(state, mouth, 2, 6).tolist() == expected


def test_what_lies_beyond_is_unknown_and_straight_ahead():
    state = ascii_state("""####????
                           #..?????
                           #..?????
                           #..?????
                           ####????""")
    edge = np.array([[2, 1], [2, 2], [2, 3]])
    assert kernels.unknown_beyond(state, edge, 12, 3).tolist() == [
        [5, 2, 3, 2, 2]
    ]  # the others run beside a wall


def viewpoint_twin(state, cost, exact_below, targets, needed, reach_cells, stride):
    """The cheapest candidate that sees as many of the targets as needed."""
    x_low = max(0, targets[:, 0].min() - reach_cells)
    y_low = max(0, targets[:, 1].min() - reach_cells)
    seen = {}
    for y in range(y_low, min(state.shape[0], targets[:, 1].max() + reach_cells + 1), stride):
        for x in range(x_low, min(state.shape[1], targets[:, 0].max() + reach_cells + 1), stride):
            if cost[y, x] < exact_below:
                seen[x, y] = sum(
                    (target[0] - x) ** 2 + (target[1] - y) ** 2 <= reach_cells**2
                    and sees_into_twin(state, x, y, target)
                    for target in targets.tolist()
                )
    enough = [place for place, count in seen.items() if count >= needed]
    return min(enough, key=lambda place: cost[place[1], place[0]], default=(-1, -1))


@pytest.mark.parametrize("seed", range(12))
def test_the_viewpoint_equals_its_twin(seed):
    rng = np.random.default_rng(seed)
    state = some_state(seed, p=(0.3, 0.6, 0.1))
    cost = rng.permutation(state.size).reshape(state.shape).astype(np.int32)
    cost[(state != Belief.FREE) | (rng.random(state.shape) < 0.5)] = UNREACHED
    iy, ix = np.nonzero(state == Belief.UNKNOWN)
    pick = rng.choice(len(ix), 6, replace=False)
    mouths = ix[pick] + rng.integers(-2, 3, 6), iy[pick] + rng.integers(-2, 3, 6)
    targets = np.column_stack((ix[pick], iy[pick], rng.integers(1, 4, 6), *mouths)).astype(np.int64)
    for needed, reach, stride in ((1, 4, 1), (3, 9, 2), (3, 60, 2), (6, 60, 1)):
        *found, _ = kernels.find_viewpoint(state, cost, UNREACHED, targets, needed, reach, stride)
        assert tuple(found) == viewpoint_twin(state, cost, UNREACHED, targets, needed, reach, stride)


def gain_twin(state, x, y, range_cells, rays):
    """Rays as arrays: every half cell of unknown counts the area of its piece of sector."""
    r = 0.5 * np.arange(1, 2 * range_cells + 1)
    padded = np.pad(state, range_cells + 1, constant_values=Belief.UNKNOWN)  # beyond the map all is unknown
    gain = 0.0
    for angle in 2.0 * math.pi / rays * np.arange(rays):
        ix = np.floor(x + 0.5 + r * math.cos(angle)).astype(int) + range_cells + 1
        iy = np.floor(y + 0.5 + r * math.sin(angle)).astype(int) + range_cells + 1
        met = padded[iy, ix]
        occupied = np.flatnonzero(met == Belief.OCCUPIED)
        end = occupied[0] if len(occupied) else len(met)
        gain += (0.5 * r[:end] * (2.0 * math.pi / rays))[met[:end] == Belief.UNKNOWN].sum()
    return gain


def test_the_expected_gain_equals_its_twin_within_the_map():
    state = some_state(3, (80, 80), p=(0.6, 0.38, 0.02))
    for x, y in ((40, 40), (30, 50), (45, 33)):
        assert kernels.expected_gain_cells(state, x, y, 20, 96) == pytest.approx(
            gain_twin(state, x, y, 20, 96)
        )


def test_the_expected_gain_beyond_the_map_is_area_too():
    state = np.full((60, 60), Belief.UNKNOWN, np.uint8)
    assert kernels.expected_gain_cells(state, 30, 30, 20, 96) == pytest.approx(math.pi * 20**2, rel=0.03)
    assert kernels.expected_gain_cells(state, 0, 0, 20, 96) == pytest.approx(math.pi * 20**2, rel=0.03)
    state[:, 40:] = Belief.OCCUPIED
    half = kernels.expected_gain_cells(state, 39, 30, 20, 360)
    assert half == pytest.approx(0.5 * math.pi * 20**2 + 20, rel=0.05)  # and the half cell up to the wall


def test_shares_equal_their_twins():
    rng, state = np.random.default_rng(5), some_state(6)
    mask = (rng.random(state.shape) < 0.05).astype(np.uint8)
    cells = np.column_stack((rng.integers(0, 50, 60), rng.integers(0, 40, 60)))
    for radius in (1, 2, 6):
        near = [
            mask[max(0, y - radius) : y + radius + 1, max(0, x - radius) : x + radius + 1].any()
            for x, y in cells
        ]
        assert kernels.share_with_neighbour(mask, cells, radius) == pytest.approx(np.mean(near))
    padded = np.pad(state, 1, constant_values=Belief.UNKNOWN)  # beyond the map all is unknown
    beside = [
        state[y, x] == Belief.FREE
        and Belief.UNKNOWN in (padded[y + 1, x], padded[y + 1, x + 2], padded[y, x + 1], padded[y + 2, x + 1])
        for x, y in cells.tolist()
    ]
    assert kernels.share_beside_unknown(state, cells) == pytest.approx(np.mean(beside))


def test_wherever_a_cell_lies_its_share_is_counted():
    mask = np.ones((3, 3), np.uint8)
    outside = np.array([[-5, 1], [1, 1], [9, 9]])
    assert kernels.share_with_neighbour(mask, outside, 1) == pytest.approx(1 / 3)
    assert kernels.share_beside_unknown(np.ones((3, 3), np.uint8), outside) == 0.0


def test_depth_and_walls_beside_are_what_they_are_called():
    state = ascii_state(""".??#
                           ....
                           ...#""")
    assert kernels.unknown_depth(state, 0, 2, 1, 0, 9) == 2
    assert kernels.unknown_depth(state, 0, 2, 1, 0, 1) == 1
    assert kernels.unknown_depth(state, 0, 2, -1, 0, 9) == 0
    assert kernels.beside_occupied(state, 2, 2)
    assert not kernels.beside_occupied(state, 1, 2)
