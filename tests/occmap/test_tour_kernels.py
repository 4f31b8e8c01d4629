"""The tour's kernels against plain twins."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
import pytest

from occmap import tour_kernels as kernels
from occmap.goals_kernels import sees, sees_into
from occmap.grid import Belief


def coarsen(state, clearance_m, side, least_m):
    shape = -(-state.shape[0] // side), -(-state.shape[1] // side)
    coarse_state, coarse_clearance_m = np.empty(shape, np.uint8), np.empty(shape, np.float32)
    kernels.coarsen(state, clearance_m, side, np.float32(least_m), coarse_state, coarse_clearance_m)
    return coarse_state, coarse_clearance_m


@pytest.mark.parametrize("side", [1, 2, 3, 7])
def test_a_block_is_free_where_the_body_has_room_in_any_of_its_cells(side):
    rng = np.random.default_rng(side)
    state = rng.choice(3, (23, 31), p=[0.5, 0.3, 0.2]).astype(np.uint8)
    clearance_m = rng.uniform(0.0, 1.0, state.shape).astype(np.float32)
    roomy = np.where((state == Belief.FREE) & (clearance_m >= 0.4), clearance_m, 0.0)
    padded = np.pad(roomy, [(0, -n % side) for n in state.shape])
    twin = padded.reshape(padded.shape[0] // side, side, -1, side).max(axis=(1, 3))
    coarse_state, coarse_clearance_m = coarsen(state, clearance_m, side, 0.4)
    np.testing.assert_array_equal(coarse_clearance_m, twin.astype(np.float32))
    np.testing.assert_array_equal(coarse_state == Belief.FREE, twin > 0.0)
    assert set(np.unique(coarse_state)) <= {Belief.FREE, Belief.OCCUPIED}


def test_the_nearest_block_is_one_in_sight():
    state = np.full((40, 60), Belief.FREE, np.uint8)
    state[:30, 20] = Belief.OCCUPIED
    blocks = np.full((8, 12), Belief.OCCUPIED, np.uint8)
    blocks[1, 3] = blocks[7, 4] = Belief.FREE  # the nearer is behind the wall, the other beyond its end
    found = kernels.nearest_block(state, blocks, 5, 23, 7, 12, 0)
    assert divmod(found, 12) == (1, 3) if sees(state, 23, 7, 17, 7, 0) else (7, 4)
    assert divmod(kernels.nearest_block(state, blocks, 5, 10, 7, 12, 0), 12) == (1, 3)
    assert kernels.nearest_block(state, blocks, 5, 55, 7, 3, 0) == -1


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_the_best_tour_is_the_best_of_all_orders(n):
    rng = np.random.default_rng(n)
    between, at_the_end = rng.uniform(0.0, 10.0, (n, n)), rng.uniform(-5.0, 0.0, n)
    best = kernels.best_after(between, at_the_end)
    for first in range(n):
        orders = [order for order in permutations(range(n)) if order[0] == first]
        costs = [sum(between[a, b] for a, b in pairwise(order)) + at_the_end[order[-1]] for order in orders]
        assert best[(1 << n) - 1, first] == pytest.approx(min(costs))


@pytest.mark.parametrize("seed", range(6))
def test_the_blocks_that_see_into_a_frontier_equal_their_twin(seed):
    rng = np.random.default_rng(seed)
    state = rng.choice(3, (26, 33), p=[0.2, 0.72, 0.08]).astype(np.uint8)
    clearance_m = rng.uniform(0.0, 1.0, state.shape).astype(np.float32)
    side, share = 3, 0.5
    cost_m = rng.uniform(0.0, 9.0, (9, 11))
    cost_m[rng.random(cost_m.shape) < 0.3] = np.inf
    iy, ix = np.nonzero(state == Belief.UNKNOWN)
    targets = np.column_stack((ix, iy, np.ones_like(ix), ix, iy))[:40]
    ends, reach = np.array([1, 6, 18, 40]), np.array([4, 12, 7, 30])
    twin = []
    for k, mine in enumerate(np.split(targets, ends[:-1])):
        for by, bx in zip(*np.nonzero(np.isfinite(cost_m)), strict=True):
            block = slice(by * side, by * side + side), slice(bx * side, bx * side + side)
            room = np.where(state[block] == Belief.FREE, clearance_m[block], -1.0)
            y, x = np.unravel_index(np.argmax(room), room.shape) if room.max() >= 0.0 else (0, 0)
            x, y = bx * side + int(x), by * side + int(y)
            near = mine[np.hypot(*(mine[:, :2] - (x, y)).T) <= reach[k]]
            seen = sum(sees_into(state, x, y, near, j) for j in range(len(near)))
            if seen >= max(1, np.ceil(share * len(mine))):
                twin.append((by * cost_m.shape[1] + bx, k))
    assert twin
    pairs = kernels.watchers(state, clearance_m, side, cost_m, targets, ends, reach, share)
    assert sorted(map(tuple, pairs.tolist())) == sorted(twin)
