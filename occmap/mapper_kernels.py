"""Kernels of the mapper: a whole scan is spent on the grid in one call.

Votes are counted in a window around the sensor and then swept into the log-odds, so that each cell
is read, clamped and thresholded once a scan however many beams cross it, and the order of the beams
cannot matter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from occmap import sensor_model
from occmap.rays import ray_cells

UNKNOWN, FREE, OCCUPIED = np.uint8(0), np.uint8(1), np.uint8(2)
NEIGHBOURS_RAD = 0.1
"""Beams farther apart look at different things."""
ALREADY_VOTED = np.uint16(65535)
"""Marks a hit cell in the window when a cell has one vote a scan."""


class Model(NamedTuple):
    """What a vote is worth on one grid; lengths in cells."""

    hit: np.float32
    miss: np.float32
    clamp: np.float32
    free_below: np.float32
    occupied_above: np.float32
    one_vote: bool
    alpha: float
    half_width: float  # rad


class Patch(NamedTuple):
    """Where the window lies: its cell (0, 0) is grid cell (ix0, iy0)."""

    ix0: int
    iy0: int
    rows: int
    stride: int  # cells a row


vote = njit(cache=True)(sensor_model.vote)


@njit(cache=True)
def is_lone(bearings, ranges, min_range, max_range, k, company):
    """Whether beam k, which met nothing, and its like beside it are fewer than company and flanked by returns.

    Beams that failed are looked past; a neighbour more than NEIGHBOURS_RAD away flanks nothing. O(company).
    """
    n, run = ranges.shape[0], 1
    for step in (-1, 1):
        at, last = k, k
        while True:
            at = (at + step) % n
            if at == k:
                return False
            gap = abs(bearings[at] - bearings[last]) % (2.0 * math.pi)
            if min(gap, 2.0 * math.pi - gap) > NEIGHBOURS_RAD:
                return False
            if not ranges[at] >= min_range:
                continue
            if ranges[at] < max_range:
                break
            run, last = run + 1, at
            if run >= company:
                return False
    return run < company


@njit(cache=True)
def beam_ends(bearings, ranges, min_range, max_range, usable_range, company, x, y, yaw):
    """Where the beams that say something start and end, in metres in the map frame. O(n).

    Beams are spent as far as usable_range; those that met nothing only in company (see is_lone).

    Returns the points (1 + k, 2), the sensor's first; which of the k ends are hits; and the box (low
    x, low y, high x, high y) of all points.
    """
    points = np.empty((1 + ranges.shape[0], 2))
    hit = np.empty(ranges.shape[0], np.bool_)
    points[0, 0], points[0, 1] = x, y
    low_x, low_y, high_x, high_y = x, y, x, y
    n = 0
    for k in range(ranges.shape[0]):
        if not ranges[k] >= min_range:  # also nan
            continue
        if ranges[k] >= max_range and is_lone(bearings, ranges, min_range, max_range, k, company):
            continue
        reach = min(max_range, usable_range)
        hit[n] = ranges[k] < reach
        z = min(ranges[k], reach)
        end_x, end_y = x + z * math.cos(yaw + bearings[k]), y + z * math.sin(yaw + bearings[k])
        low_x, high_x = min(low_x, end_x), max(high_x, end_x)
        low_y, high_y = min(low_y, end_y), max(high_y, end_y)
        n += 1
        points[n, 0], points[n, 1] = end_x, end_y
    return points[: n + 1], hit[:n], (low_x, low_y, high_x, high_y)


@njit(cache=True)
def count_ray(window, stride, ix0, iy0, ix1, iy1):
    """One miss for every cell of a ray but its last; returns the last cell's index.

    The cells of Bresenham's line (rays.ray_cells), where the shorter axis stands at ceil(k * short /
    long - 1/2) after k steps. Here as a fixed-point product: no step waits for the error of the one
    before, which halves the time. Exact for rays of up to 2^19 cells. O(cells).
    """
    dx, dy = abs(ix1 - ix0), abs(iy1 - iy0)
    step_x = 1 if ix1 > ix0 else -1
    step_y = stride if iy1 > iy0 else -stride
    if dx >= dy:
        long, short, ahead, aside = dx, dy, step_x, step_y
    else:
        long, short, ahead, aside = dy, dx, step_y, step_x
    at = iy0 * stride + ix0
    slope = (short << 40) // max(long, 1)
    rise = (1 << 39) - 1  # just under one half: a ray through a corner stays on its side of it
    for _ in range(long):
        window[np.uint64(at + (rise >> 40) * aside)] += np.uint16(1)
        at += ahead
        rise += slope
    return iy1 * stride + ix1


@njit(cache=True)
def lines(window, stride, points, hit, alpha, hits):
    """Votes of thin beams: misses into the window, end cells into hits. Everything in window cells.

    A hit is alpha cells thick to either side of its end. O(sum of beam lengths in cells). Returns
    the number of hit cells.
    """
    n_hits = 0
    x, y = points[0, 0], points[0, 1]
    ix0, iy0 = math.floor(x), math.floor(y)
    for k in range(hit.shape[0]):
        end_x, end_y = points[k + 1, 0], points[k + 1, 1]
        if not hit[k]:
            last = count_ray(window, stride, ix0, iy0, math.floor(end_x), math.floor(end_y))
            window[last] += np.uint16(1)
            continue
        z = math.hypot(end_x - x, end_y - y)
        depth = min(alpha / z, 1.0) if alpha > 0.0 and z > 0.0 else 0.0
        deep_x, deep_y = depth * (end_x - x), depth * (end_y - y)
        ix1, iy1 = math.floor(end_x - deep_x), math.floor(end_y - deep_y)
        hits[n_hits] = count_ray(window, stride, ix0, iy0, ix1, iy1)
        n_hits += 1
        if depth > 0.0:
            for cell in ray_cells(ix1, iy1, math.floor(end_x + deep_x), math.floor(end_y + deep_y))[1:]:
                hits[n_hits] = cell[1] * stride + cell[0]
                n_hits += 1
    return n_hits


@njit(cache=True)
def cones(window, stride, points, hit, half_width, alpha, hits):
    """Votes of beams that open by half_width (rad) to either side; everything in window cells.

    Every cell whose centre lies in the wedge (or within half a cell of its axis, where the wedge is
    narrower than a cell) is voted on by its distance from the sensor. O(area of the beams' bounding
    boxes). Returns the number of hit cells.
    """
    n_hits = 0
    x, y, slope = points[0, 0], points[0, 1], math.tan(half_width)
    for k in range(hit.shape[0]):
        dx, dy = points[k + 1, 0] - x, points[k + 1, 1] - y
        z = math.hypot(dx, dy)
        cos, sin = (dx / z, dy / z) if z > 0.0 else (1.0, 0.0)
        reach = z + (alpha if hit[k] else 0.0)
        z_max = np.inf if hit[k] else z
        pad = max(reach * slope, 0.5)
        tip_x, tip_y = x + cos * reach, y + sin * reach
        for iy in range(math.floor(min(y, tip_y) - pad), math.floor(max(y, tip_y) + pad) + 1):
            for ix in range(math.floor(min(x, tip_x) - pad), math.floor(max(x, tip_x) + pad) + 1):
                cx, cy = ix + 0.5 - x, iy + 0.5 - y
                along, across = cx * cos + cy * sin, abs(cy * cos - cx * sin)
                if along < -0.5 or across > max(along * slope, 0.5):
                    continue
                said = vote(math.hypot(cx, cy), z, z_max, alpha)
                if said < 0:
                    window[iy * stride + ix] += np.uint16(1)
                elif said > 0:
                    hits[n_hits] = iy * stride + ix
                    n_hits += 1
    return n_hits


@njit(cache=True)
def believed(value, model):
    """The state of a cell with these log-odds."""
    if value < model.free_below:
        return FREE
    return OCCUPIED if value > model.occupied_above else UNKNOWN


@njit(cache=True)
def spend_hits(window, patch, hits, log_odds, state, model, flips, was):
    """Hit cells: first the misses counted there, then the hits: rays grazing a wall must not erase it.

    Clears those cells of the window. Returns the number of cells whose state changed. O(hits).
    """
    if model.one_vote:
        for k in range(hits.shape[0]):
            window[hits[k]] = ALREADY_VOTED
    for k in range(hits.shape[0]):
        iy, ix = hits[k] // patch.stride + patch.iy0, hits[k] % patch.stride + patch.ix0
        value, misses = log_odds[iy, ix], window[hits[k]]
        window[hits[k]] = 0
        if model.one_vote and misses != ALREADY_VOTED:
            continue
        if not model.one_vote:
            value = max(value + np.float32(misses) * model.miss, -model.clamp)
        log_odds[iy, ix] = min(value + model.hit, model.clamp)
    n = 0
    for k in range(hits.shape[0]):
        iy, ix = hits[k] // patch.stride + patch.iy0, hits[k] % patch.stride + patch.ix0
        now = believed(log_odds[iy, ix], model)
        if now != state[iy, ix]:
            flips[n], was[n] = iy * state.shape[1] + ix, state[iy, ix]
            state[iy, ix] = now
            n += 1
    return n


@njit(cache=True)
def sweep_misses(window, patch, log_odds, state, model, flips, was, n):
    """Spend and clear the window's misses; returns n, the number of cells whose state changed so far.

    O(cells of the patch), in loops without branches over whole rows, which the compiler vectorises:
    cheaper than looking for the cells that were crossed.
    """
    width = min(patch.stride, state.shape[1] - patch.ix0)
    most = np.uint16(1) if model.one_vote else ALREADY_VOTED
    miss, low = model.miss, -model.clamp
    for row in range(patch.rows):
        votes = window[row * patch.stride : row * patch.stride + width]
        odds = log_odds[row + patch.iy0, patch.ix0 : patch.ix0 + width]
        states = state[row + patch.iy0, patch.ix0 : patch.ix0 + width]
        for i in range(width):
            value = odds[i] + np.float32(min(votes[i], most)) * miss
            odds[i] = value if value > low else low
            votes[i] = 0
        if differs(odds, states, model):
            first = (row + patch.iy0) * state.shape[1] + patch.ix0
            n = record_flips(odds, states, first, model, flips, was, n)
    return n


@njit(cache=True)
def differs(odds, states, model):
    """Whether any cell's state is not what its log-odds say."""
    difference = np.uint8(0)
    for i in range(odds.shape[0]):
        now = np.uint8(odds[i] < model.free_below) + np.uint8(2) * np.uint8(odds[i] > model.occupied_above)
        difference |= np.uint8(now) ^ states[i]
    return difference != 0


@njit(cache=True)
def record_flips(odds, states, first, model, flips, was, n):
    """Bring the states of a row in step with its log-odds; first is its first cell's flat index."""
    for i in range(odds.shape[0]):
        now = believed(odds[i], model)
        if now != states[i]:
            flips[n], was[n] = first + i, states[i]
            states[i] = now
            n += 1
    return n


@njit(cache=True)
def integrate(window, patch, log_odds, state, points, hit, model, hits, flips, was):
    """Spend one scan; points (1 + n, 2) are the sensor and the beams' ends in window cells.

    Returns the number of cells whose state changed: flips has their flat indices, was the states
    they left. hits, flips and was are room to work in.
    """
    if model.half_width > 0.0:
        n_hits = cones(window, patch.stride, points, hit, model.half_width, model.alpha, hits)
    else:
        n_hits = lines(window, patch.stride, points, hit, model.alpha, hits)
    n = spend_hits(window, patch, hits[:n_hits], log_odds, state, model, flips, was)
    return sweep_misses(window, patch, log_odds, state, model, flips, was, n)
