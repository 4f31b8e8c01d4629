"""The way ahead of the robot: samples (m, 2) of its path, in its own frame but for `place_on_path`.

Loops instead of array expressions: each of those compiles for longer than the kernel around it.
"""

import math

import numpy as np

from occmap.kernel import kernel, part

LEFT, RIGHT, NEAREST = range(3)
ROOMS = 3
"""From a sample to the nearest hit on its left, on its right and anywhere."""
TINY = 1e-9
"""Keeps divisions off zero."""
TANGENT_SAMPLES, BEND_SAMPLES = 2, 4
"""A direction is measured between so many samples before and after; that of a bend's arms, over so many."""
STRAIGHT_RAD = 0.1
"""A bend of less is the rounding of cells."""
EVEN_M = 1e-3
"""A way whose rooms to the left and right differ by no more lies in the middle."""
SLOW_BEFORE_M = 0.5
"""What is near the way slows the robot down from so far before it."""
AT_HAND_SAMPLES = 2
"""The first of the way: to brake on these it is too late."""
OFF_LINE_M, OFF_LINE_RAD = 0.12, 0.6
"""A robot so far beside the line through a gap, or so much across it, is not lined up with it at all."""


@kernel
def place_on_path(points, stations_m, x, y, low_m, high_m):
    """Place where a polyline (n, 2) passes nearest to (x, y). O(n).

    Returns the metres along it, in [low_m, high_m], and how far off it is.
    """
    best_m, best = min(max(low_m, 0.0), stations_m[-1]), np.inf
    if len(points) == 1:
        return 0.0, math.hypot(points[0, 0] - x, points[0, 1] - y)
    for k in range(len(points) - 1):
        begin, end = stations_m[k], stations_m[k + 1]
        if end < low_m or begin > high_m or end <= begin:
            continue
        dx, dy = (
            (points[k + 1, 0] - points[k, 0]) / (end - begin),
            (points[k + 1, 1] - points[k, 1]) / (end - begin),
        )
        along = (x - points[k, 0]) * dx + (y - points[k, 1]) * dy
        along = min(max(along, max(0.0, low_m - begin)), min(end, high_m) - begin)
        away = math.hypot(points[k, 0] + along * dx - x, points[k, 1] + along * dy - y)
        if away < best:
            best, best_m = away, begin + along
    return best_m, best


@kernel
def sample_path(points, stations_m, from_m, spacing_m, x, y, yaw, way):
    """Fill `way` (m, 2) with the path from from_m on, in the pose's frame; how many until it ends."""
    c, s = math.cos(yaw), math.sin(yaw)
    last = len(points) - 1
    k, n = 0, 0
    for j in range(len(way)):
        at = min(from_m + j * spacing_m, stations_m[last])
        while k < last - 1 and stations_m[k + 1] < at:
            k += 1
        px, py = points[k, 0], points[k, 1]
        if last > 0 and stations_m[k + 1] > stations_m[k]:
            share = (at - stations_m[k]) / (stations_m[k + 1] - stations_m[k])
            px += share * (points[k + 1, 0] - px)
            py += share * (points[k + 1, 1] - py)
        way[n, 0] = c * (px - x) + s * (py - y)
        way[n, 1] = -s * (px - x) + c * (py - y)
        n += 1
        if at >= stations_m[last]:
            break
    return n


@part
def _tangent(way, j):
    """Unit vector along the way at a sample."""
    a, b = max(j - TANGENT_SAMPLES, 0), min(j + TANGENT_SAMPLES, len(way) - 1)
    tx, ty = way[b, 0] - way[a, 0], way[b, 1] - way[a, 1]
    length = max(math.hypot(tx, ty), TINY)
    return tx / length, ty / length


@kernel
def rooms(way, hits, beside_m, reach_m):
    """(m, 3) from each sample to the nearest hit on its left, on its right (no more than beside_m ahead or
    behind) and anywhere; at most reach_m. O(samples * hits).
    """
    room = np.empty((len(way), ROOMS))
    for j in range(len(way)):
        tx, ty = _tangent(way, j)
        on_left = on_right = nearest = reach_m * reach_m
        for k in range(len(hits)):
            dx, dy = hits[k, 0] - way[j, 0], hits[k, 1] - way[j, 1]
            square = dx * dx + dy * dy
            if square >= reach_m * reach_m:
                continue
            nearest = min(nearest, square)
            if abs(dx * tx + dy * ty) < beside_m:
                if tx * dy - ty * dx > 0.0:
                    on_left = min(on_left, square)
                else:
                    on_right = min(on_right, square)
        room[j, LEFT], room[j, RIGHT] = math.sqrt(on_left), math.sqrt(on_right)
        room[j, NEAREST] = math.sqrt(nearest)
    return room


@kernel
def centre(way, hits, beside_m, roomy_m, most_m, reach):
    """Shift the way to the middle of what it squeezes through, as the scan sees it: cells are too coarse.

    Each sample moves by half the difference of its rooms (more than roomy_m counts as roomy_m), at most
    most_m, as the tightest place within `reach` samples asks for: so the robot is lined up before it
    is in the gap. The rooms (m, 3) of the shifted samples. O(samples * hits).
    """
    room = rooms(way, hits, beside_m, roomy_m)
    widest = 0.0
    for j in range(len(way)):
        widest = max(widest, abs(room[j, LEFT] - room[j, RIGHT]))
    if widest < EVEN_M:
        return room
    shift = np.empty(len(way))
    for j in range(len(way)):
        shift[j], tightest = 0.0, np.inf
        for k in range(max(j - reach, 0), min(j + reach + 1, len(way))):
            if room[k, LEFT] + room[k, RIGHT] < tightest:
                tightest = room[k, LEFT] + room[k, RIGHT]
                shift[j] = 0.5 * (room[k, LEFT] - room[k, RIGHT])
        shift[j] = min(max(shift[j], -most_m), most_m)
    moved = np.empty((len(way), 2))
    for j in range(len(way)):
        tx, ty = _tangent(way, j)
        first, end = max(j - reach // 2, 0), min(j + reach // 2 + 1, len(way))
        smooth = 0.0
        for k in range(first, end):
            smooth += shift[k]
        smooth /= end - first
        moved[j, 0] = way[j, 0] - ty * smooth
        moved[j, 1] = way[j, 1] + tx * smooth
    for j in range(len(way)):
        way[j, 0], way[j, 1] = moved[j, 0], moved[j, 1]
    return rooms(way, hits, beside_m, roomy_m)


@kernel
def speed_limit(way, room, spacing_m, top, slow, near_m, roomy_m, turn_radps, brake):
    """The speed from which the way can be driven: slow past obstacles and round bends, braking in good time.

    Past something near_m away at `slow`, from roomy_m on at `top` (within SLOW_BEFORE_M); round a bend
    so that the turn rate stays below turn_radps. O(samples).
    """
    limit = top
    half = BEND_SAMPLES
    for j in range(len(way)):
        here = top
        if j * spacing_m <= SLOW_BEFORE_M:
            share = min(max((room[j, NEAREST] - near_m) / (roomy_m - near_m), 0.0), 1.0)
            here = slow + (top - slow) * share
        if half <= j < len(way) - half:
            ax, ay = way[j, 0] - way[j - half, 0], way[j, 1] - way[j - half, 1]
            bx, by = way[j + half, 0] - way[j, 0], way[j + half, 1] - way[j, 1]
            angle = abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
            if angle > STRAIGHT_RAD:
                here = min(here, max(slow, turn_radps * half * spacing_m / angle))
        limit = min(limit, math.sqrt(here * here + 2.0 * brake * max(j - AT_HAND_SAMPLES, 0) * spacing_m))
    return limit


@kernel
def alignment(way, room, tight_m, reach):
    """How well the robot is lined up with the first of `reach` samples that has less room than tight_m.

    1 on the line through it and along it, falling to 0 at OFF_LINE_M beside or OFF_LINE_RAD across; 1
    if there is no such place. O(reach).
    """
    for j in range(min(len(way), reach)):
        if room[j, NEAREST] < tight_m:
            tx, ty = _tangent(way, j)
            beside = abs(tx * way[j, 1] - ty * way[j, 0])
            across = abs(math.atan2(ty, tx))
            return max(1.0 - max(beside / OFF_LINE_M, across / OFF_LINE_RAD), 0.0)
    return 1.0


@kernel
def farthest_aim(way, hits, spacing_m, nearest_m, farthest_m, need_m):
    """Index of the farthest sample to which the straight line keeps need_m from all hits. O(samples * hits).

    Between nearest_m and farthest_m along the way; the first of them if none does: a carrot seen
    across a corner would have the robot cut it.
    """
    first = min(int(nearest_m / spacing_m), len(way) - 1)
    for j in range(min(int(farthest_m / spacing_m), len(way) - 1), first, -1):
        x, y = way[j, 0], way[j, 1]
        square = max(x * x + y * y, TINY)
        is_clear = True
        for k in range(len(hits)):
            share = min(max((hits[k, 0] * x + hits[k, 1] * y) / square, 0.0), 1.0)
            dx, dy = hits[k, 0] - share * x, hits[k, 1] - share * y
            if dx * dx + dy * dy < need_m * need_m and share > 0.0:
                is_clear = False
                break
        if is_clear:
            return j
    return first
