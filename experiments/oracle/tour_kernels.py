"""Counting what a tour sees, and putting its stops in order, as kernels."""

from __future__ import annotations

import numpy as np

from occmap.kernel import kernel


@kernel
def count(counts, weight, starts, columns, places, sign):
    """Add a leg's places to how often each sample is seen, or take them away. O(samples seen).

    Returns by how much the weight of the samples seen grew; negative if it shrank.
    """
    change = 0
    for p in places:
        for k in range(starts[p], starts[p + 1]):
            s = columns[k]
            if sign > 0:
                if counts[s] == 0:
                    change += weight[s]
                counts[s] += 1
            else:
                counts[s] -= 1
                if counts[s] == 0:
                    change -= weight[s]
    return change


@kernel
def gains(counts, weight, starts, columns, n_places):
    """(n_places,) weight of samples not seen yet that each place would see; starts, columns: their places."""
    out = np.zeros(n_places, np.int64)
    for s in range(len(counts)):
        if counts[s] == 0:
            for k in range(starts[s], starts[s + 1]):
                out[columns[k]] += weight[s]
    return out


@kernel
def update(gain, before, counts, weight, starts, columns):
    """Keep gains in step with what has come to be seen or ceased to. O(those samples * their places)."""
    for s in range(len(counts)):
        if before[s] == 0 and counts[s] > 0:
            for k in range(starts[s], starts[s + 1]):
                gain[columns[k]] -= weight[s]
        elif before[s] > 0 and counts[s] == 0:
            for k in range(starts[s], starts[s + 1]):
                gain[columns[k]] += weight[s]


@kernel
def best_insertions(away, legs_m, candidates):
    """The least detour of each candidate over all legs, and after which stop. O(stops * candidates).

    away: (m, p) metres from each stop to every place. legs_m: (m - 1,). The end is free: after the last stop
    the detour is the way there.
    """
    detour = np.empty(len(candidates), np.float64)
    after = np.empty(len(candidates), np.int64)
    m = len(away)
    for c in range(len(candidates)):
        p = candidates[c]
        detour[c], after[c] = away[m - 1, p], m - 1
        for k in range(m - 1):
            longer = away[k, p] + away[k + 1, p] - legs_m[k]
            if longer < detour[c]:
                detour[c], after[c] = max(longer, 0.0), k
    return detour, after


@kernel
def shortened(away, order):
    """2-opt and Or-opt (Croes 1958, Or 1976) of a tour with a fixed start, in place, until neither helps.

    away: (m, m) metres between stops. order: (m,) a permutation that begins with the first stop.
    """
    m = len(order)
    improved = True
    while improved:
        improved = False
        for i in range(1, m):
            for j in range(i + 1, m):
                a, b, c = order[i - 1], order[i], order[j]
                saved = away[a, b] - away[a, c]
                if j + 1 < m:
                    d = order[j + 1]
                    saved += away[c, d] - away[b, d]
                if saved > 1e-6:
                    order[i : j + 1] = order[i : j + 1][::-1].copy()
                    improved = True
        for length in range(1, 4):
            for i in range(1, m - length + 1):
                improved |= moved(away, order, i, length)
    return order


@kernel
def moved(away, order, i, length):
    """Move a run of stops to where it costs least, turned round if that is better; whether it was moved."""
    m = len(order)
    run = order[i : i + length].copy()
    a, first, last = order[i - 1], run[0], run[length - 1]
    saved = away[a, first]
    if i + length < m:
        after = order[i + length]
        saved += away[last, after] - away[a, after]
    rest = np.concatenate((order[:i], order[i + length :]))
    best, where, turned = saved - 1e-6, -1, False
    for k in range(len(rest)):
        one = rest[k]
        for turn in range(2):
            head, tail = (last, first) if turn else (first, last)
            cost = away[one, head]
            if k + 1 < len(rest):
                cost += away[tail, rest[k + 1]] - away[one, rest[k + 1]]
            if cost < best:
                best, where, turned = cost, k, turn == 1
    if where < 0:
        return False
    if turned:
        run = run[::-1].copy()
    order[:] = np.concatenate((rest[: where + 1], run, rest[where + 1 :]))
    return True
