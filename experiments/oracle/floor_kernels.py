"""What a place sees and how far places are from each other, as kernels over a known floor."""

from __future__ import annotations

import numpy as np

from occmap.kernel import kernel
from sim.truth_kernels import sees

STRAIGHT, DIAGONAL = 70, 99
"""Costs of a step; 99 / 70 is the square root of 2 but for 5e-5."""
BUCKETS = 128
"""More than the dearest step, so that a ring of buckets holds every open cost."""
UNREACHED = np.int32(2**31 - 1)


@kernel
def looks(free, samples, places, reach):
    """Sight of all places (p, 2) as rows of a sparse matrix: (p + 1,) starts and the samples of each row.

    free: (ny, nx) bool. A sample (s, 2) sees a place if it is in range and all cells of Bresenham's line to
    it are free. O(places * samples in range * length of a line, or as far as the first wall).
    """
    starts = np.zeros(len(places) + 1, np.int64)
    out = np.empty(64 * len(samples), np.int32)
    n = 0
    for k in range(len(places)):
        px, py = places[k]
        if n + len(samples) > len(out):
            out = np.concatenate((out, np.empty_like(out)))
        for s in range(len(samples)):
            x, y = samples[s]
            if (px - x) ** 2 + (py - y) ** 2 <= reach and sees(free, x, y, px, py):
                out[n] = s
                n += 1
        starts[k + 1] = n
    return starts, out[:n].copy()


@kernel
def cells_seen(free, wanted, way, reach):
    """How many wanted cells see a cell of a way (k, 2), as `looks` has it.

    Most cells see what their neighbours saw; only the others try the whole way.
    O(cells + hidden cells * way in range * length of a line).
    """
    ny, nx = free.shape
    seen_by = np.full((ny, nx), -1, np.int32)
    seen = last = 0
    for y in range(1, ny):
        for x in range(1, nx):
            if not wanted[y, x]:
                continue
            found = -1
            for hint in (seen_by[y, x - 1], seen_by[y - 1, x]):
                if found < 0 and hint >= 0 and sees_near(free, x, y, way[hint], reach):
                    found = hint
            for k in range(2 * len(way)):  # outwards from where the last cell was seen from
                at = last + (k + 1) // 2 if k % 2 else last - k // 2
                if found >= 0:
                    break
                if 0 <= at < len(way) and sees_near(free, x, y, way[at], reach):
                    found = at
            if found >= 0:
                seen += 1
                last = found
            seen_by[y, x] = found
    return seen


@kernel
def sees_near(free, x, y, cell, reach):
    """Whether a cell sees another one in range."""
    return (cell[0] - x) ** 2 + (cell[1] - y) ** 2 <= reach and sees(free, x, y, cell[0], cell[1])


@kernel
def transposed(starts, columns, n_columns):
    """The rows of a sparse matrix's transpose, each sorted. O(entries)."""
    count = np.zeros(n_columns + 1, np.int64)
    for c in columns:
        count[c + 1] += 1
    begins = np.cumsum(count)
    fill = begins.copy()
    rows = np.empty(len(columns), np.int32)
    for r in range(len(starts) - 1):
        for k in range(starts[r], starts[r + 1]):
            rows[fill[columns[k]]] = r
            fill[columns[k]] += 1
    return begins, rows


@kernel
def is_open(stands, x, y, x1, y1):
    """Whether a body may move along Bresenham's line between two cells, corners not cut."""
    dx, dy = abs(x1 - x), abs(y1 - y)
    sx = 1 if x1 > x else -1
    sy = 1 if y1 > y else -1
    error = dx - dy
    while stands[y, x]:
        if x == x1 and y == y1:
            return True
        twice = 2 * error
        if -dy < twice < dx and not (stands[y, x + sx] and stands[y + sy, x]):
            return False
        if twice > -dy:
            error -= dy
            x += sx
        if twice < dx:
            error += dx
            y += sy
    return False


@kernel
def neighbours(stands, number, nodes, stride):
    """(n, 8) the nodes around each node of a lattice, -1 for none; straight steps come first.

    stands: (ny, nx) bool with a rim of False. number: (ny, nx) int32 node of a cell, -1 where there is none.
    nodes: (n, 2) cells, stride apart.
    """
    dx = np.array([1, 0, -1, 0, 1, -1, -1, 1])
    dy = np.array([0, 1, 0, -1, 1, 1, -1, -1])
    ny, nx = stands.shape
    out = np.full((len(nodes), 8), -1, np.int32)
    for n in range(len(nodes)):
        for k in range(8):
            x, y = nodes[n, 0] + stride * dx[k], nodes[n, 1] + stride * dy[k]
            is_node = 0 <= x < nx and 0 <= y < ny and number[y, x] >= 0
            if is_node and is_open(stands, nodes[n, 0], nodes[n, 1], x, y):
                out[n, k] = number[y, x]
    return out


@kernel
def flood(around, sources, cost, link):
    """Cost (n,) int32 from the nearest source and link (n,) int8, the last step. Dial's buckets, O(n)."""
    cost[:] = UNREACHED
    link[:] = -1
    head = np.full(BUCKETS, -1, np.int32)
    node_of = np.empty(4 * len(cost) + 8, np.int32)
    after = np.empty(4 * len(cost) + 8, np.int32)
    entries, now = 0, 0
    for source in sources:
        cost[source] = 0
        node_of[entries], after[entries], head[0] = source, head[0], entries
        entries += 1
    open_entries = entries
    while open_entries > 0:
        entry = head[now % BUCKETS]
        head[now % BUCKETS] = -1
        while entry >= 0:
            node = node_of[entry]
            entry = after[entry]
            open_entries -= 1
            if cost[node] != now:
                continue
            for k in range(8):
                other = around[node, k]
                dearer = now + (STRAIGHT if k < 4 else DIAGONAL)
                if other < 0 or cost[other] <= dearer:
                    continue
                cost[other] = dearer
                link[other] = k
                if entries == len(node_of):
                    node_of = np.concatenate((node_of, np.empty_like(node_of)))
                    after = np.concatenate((after, np.empty_like(after)))
                bucket = dearer % BUCKETS
                node_of[entries], after[entries] = other, head[bucket]
                head[bucket] = entries
                entries += 1
                open_entries += 1
        now += 1


@kernel
def walk(around, link, target):
    """(k,) nodes from the target back to the source of a flood, both included."""
    back = np.array([2, 3, 0, 1, 6, 7, 4, 5])
    n, node = 1, target
    while link[node] >= 0:
        node = around[node, back[link[node]]]
        n += 1
    out = np.empty(n, np.int32)
    node = target
    for k in range(n):
        out[k] = node
        if k < n - 1:
            node = around[node, back[link[node]]]
    return out


@kernel
def taut(stands, way):
    """(m, 2) the corners that are left of a way (k, 2) of cells when it is pulled tight between its ends.

    From each corner to the farthest cell of the way in a straight line of open cells.
    """
    keep = np.empty(len(way), np.int64)
    keep[0], n, here = 0, 1, 0
    while here < len(way) - 1:
        best = here + 1
        for k in range(here + 2, len(way)):
            if is_open(stands, way[here, 0], way[here, 1], way[k, 0], way[k, 1]):
                best = k
        here = best
        keep[n] = here
        n += 1
    return way[keep[:n]]
