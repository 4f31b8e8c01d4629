"""Kernels of the mapper: a whole scan is spent on the grid in one call.

Votes are counted in a window around the sensor and then swept into the log-odds, so that each cell
is read, clamped and thresholded once a scan however many beams cross it, and the order of the beams
cannot matter.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from occmap.grid import FREE, OCCUPIED, UNKNOWN
from occmap.kernel import kernel, part
from occmap.vote_kernels import cones, lines

ALREADY_VOTED = np.uint16(65535)
"""Marks a hit cell in the window when a cell has one vote a scan."""
VOTES_PER_WORD = 4
"""So many of the window's counters are looked at together where there may be none."""


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
    stride: int  # cells a row, in whole words


@kernel
def believed(value, model):
    """The state of a cell with these log-odds."""
    if value < model.free_below:
        return FREE
    return OCCUPIED if value > model.occupied_above else UNKNOWN


@part
def spend_hits(window, patch, hits, log_odds, state, model, flips, was):
    """Spend the misses counted in hit cells, then the hits: rays grazing a wall must not erase it.

    Clears those cells of the window. Returns the number of cells whose state changed. O(hits).
    """
    if model.one_vote:
        for k in range(hits.shape[0]):
            window[hits[k, 1] * patch.stride + hits[k, 0]] = ALREADY_VOTED
    for k in range(hits.shape[0]):
        at = hits[k, 1] * patch.stride + hits[k, 0]
        iy, ix = hits[k, 1] + patch.iy0, hits[k, 0] + patch.ix0
        value, misses = log_odds[iy, ix], window[at]
        window[at] = 0
        if model.one_vote and misses != ALREADY_VOTED:
            continue
        if not model.one_vote:
            value = max(value + np.float32(misses) * model.miss, -model.clamp)
        log_odds[iy, ix] = min(value + model.hit, model.clamp)
    n = 0
    for k in range(hits.shape[0]):
        iy, ix = hits[k, 1] + patch.iy0, hits[k, 0] + patch.ix0
        now = believed(log_odds[iy, ix], model)
        if now != state[iy, ix]:
            flips[n], was[n] = iy * state.shape[1] + ix, state[iy, ix]
            state[iy, ix] = now
            n += 1
    return n


@part
def sweep_misses(window, words, patch, log_odds, state, model, flips, was, n):
    """Spend and clear the window's misses; returns n, the number of cells whose state changed so far.

    O(cells of the patch). What lies between a row's first and last votes is spent in loops without branches,
    which the compiler vectorises: cheaper than looking for the cells that were crossed.
    """
    per_row, nx = patch.stride // VOTES_PER_WORD, state.shape[1]
    for row in range(patch.rows):
        first, stop = row * per_row, (row + 1) * per_row
        while first < stop and words[np.uint64(first)] == 0:
            first += 1
        while first < stop and words[np.uint64(stop - 1)] == 0:
            stop -= 1
        at = first * VOTES_PER_WORD
        iy, ix = row + patch.iy0, patch.ix0 + at - row * patch.stride
        width = min((stop - first) * VOTES_PER_WORD, nx - ix)
        votes, odds = window[at : at + width], log_odds[iy, ix : ix + width]
        states = state[iy, ix : ix + width]
        spend_misses(votes, odds, model)
        if differs(odds, states, model):
            n = record_flips(odds, states, iy * nx + ix, model, flips, was, n)
    return n


@kernel
def spend_misses(votes, odds, model):
    """Lower the log-odds by the misses counted, down to the clamp, and clear the counters."""
    most = np.uint16(1) if model.one_vote else ALREADY_VOTED
    miss, low = model.miss, -model.clamp
    for i in range(odds.shape[0]):
        value = odds[i] + np.float32(min(votes[i], most)) * miss
        odds[i] = value if value > low else low
        votes[i] = 0


@kernel
def differs(odds, states, model):
    """Whether any cell's state is not what its log-odds say."""
    difference = np.uint8(0)
    for i in range(odds.shape[0]):
        now = FREE * np.uint8(odds[i] < model.free_below) + OCCUPIED * np.uint8(
            odds[i] > model.occupied_above
        )
        difference |= np.uint8(now) ^ states[i]
    return difference != 0


@part
def record_flips(odds, states, first, model, flips, was, n):
    """Bring the states of a row in step with its log-odds; first is its first cell's flat index."""
    for i in range(odds.shape[0]):
        now = believed(odds[i], model)
        if now != states[i]:
            flips[n], was[n] = first + i, states[i]
            states[i] = now
            n += 1
    return n


@kernel
def integrate_lines(window, words, patch, log_odds, state, points, hit, model, hits, flips, was):
    """Spend one scan of thin beams; points (1 + n, 2) are the sensor and the beams' ends in window cells.

    Returns the number of cells whose state changed: flips has their flat indices, was the states
    they left. words is the window once more, in words; hits, flips and was are room to work in.
    """
    n_hits = lines(window, patch.stride, points, hit, model.alpha, hits)
    n = spend_hits(window, patch, hits[:n_hits], log_odds, state, model, flips, was)
    return sweep_misses(window, words, patch, log_odds, state, model, flips, was, n)


@kernel
def integrate_cones(window, words, patch, log_odds, state, points, hit, model, hits, flips, was):
    """Spend one scan of beams that open by model.half_width to either side; the rest as integrate_lines."""
    n_hits = cones(window, patch.stride, points, hit, model.half_width, model.alpha, hits)
    n = spend_hits(window, patch, hits[:n_hits], log_odds, state, model, flips, was)
    return sweep_misses(window, words, patch, log_odds, state, model, flips, was, n)
