"""What the follower asks of a scan and of a path, ten times a second: tens of microseconds in all.

Everything but `place_on_path` and `map_clearance` is in the robot's frame.
"""

import math

import numpy as np
from numba import njit


@njit(cache=True)
def place_on_path(points, stations_m, x, y, low_m, high_m):
    """Metres along a polyline (n, 2), within [low_m, high_m], at which it passes nearest to (x, y); and how far. O(n)."""
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


@njit(cache=True)
def sample_path(points, stations_m, from_m, spacing_m, x, y, yaw, way):
    """Fill `way` (m, 2) with the path from from_m on, in the frame of the pose; how many. Ends at the path's end. O(n + m)."""
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


@njit(cache=True)
def near_hits(
    ranges_m,
    bearings_rad,
    low_m,
    high_m,
    reach_m,
    gate_m,
    half_window,
    lidar_x,
    lidar_y,
    lidar_yaw,
    hits,
    lone,
):
    """The scan's end points within reach_m of the lidar, range noise averaged over neighbours on the same surface.

    Neighbours are beams within half_window whose range differs by less than gate_m. End points with a
    neighbour go to `hits` (n, 2), those without one, specks or things thinner than the beams are
    apart, to `lone`. Returns how many of each. O(beams).
    """
    n = len(ranges_m)
    n_hits, n_lone = 0, 0
    for i in range(n):
        r = ranges_m[i]
        if not (low_m <= r <= reach_m and r < high_m):
            continue
        total, count = r, 1
        for k in range(-half_window, half_window + 1):
            other = ranges_m[(i + k) % n]
            if k != 0 and abs(other - r) < gate_m:
                total += other
                count += 1
        bearing = bearings_rad[i] + lidar_yaw
        x = lidar_x + total / count * math.cos(bearing)
        y = lidar_y + total / count * math.sin(bearing)
        if count > 1:
            hits[n_hits, 0], hits[n_hits, 1] = x, y
            n_hits += 1
        else:
            lone[n_lone, 0], lone[n_lone, 1] = x, y
            n_lone += 1
    return n_hits, n_lone


@njit(cache=True)
def rooms(way, n_way, hits, n_hits, beside_m, reach_m, left, right, around):
    """For each sample of the way: distance to the nearest hit on its left, on its right (both only within
    beside_m ahead or behind) and anywhere; at most reach_m. O(samples * hits).
    """
    for j in range(n_way):
        a, b = max(j - 2, 0), min(j + 2, n_way - 1)
        tx, ty = way[b, 0] - way[a, 0], way[b, 1] - way[a, 1]
        length = max(math.hypot(tx, ty), 1e-9)
        tx, ty = tx / length, ty / length
        on_left = on_right = nearest = reach_m * reach_m
        for k in range(n_hits):
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
        left[j], right[j], around[j] = math.sqrt(on_left), math.sqrt(on_right), math.sqrt(nearest)


@njit(cache=True)
def centre(way, n_way, hits, n_hits, roomy_m, most_m, left, right, around):
    """Shift the way to the middle of what it squeezes through, as the scan sees it: cells are too coarse for that.

    Each sample moves by half the difference of its rooms (rooms over roomy_m count as roomy_m), at
    most most_m, as far as the tightest place within 0.4 m asks for, so that the robot is lined up
    before it is in the gap. O(samples * hits).
    """
    rooms(way, n_way, hits, n_hits, 0.2, roomy_m, left, right, around)
    reach = 8
    shift = np.zeros(n_way)
    for j in range(n_way):
        tightest = 2.0 * roomy_m
        for k in range(max(j - reach, 0), min(j + reach + 1, n_way)):
            if left[k] + right[k] < tightest:
                tightest = left[k] + right[k]
                shift[j] = 0.5 * (left[k] - right[k])
        shift[j] = min(max(shift[j], -most_m), most_m)
    moved = np.empty((n_way, 2))
    for j in range(n_way):
        a, b = max(j - 4, 0), min(j + 5, n_way)
        mean = shift[a:b].mean()
        a, b = max(j - 2, 0), min(j + 2, n_way - 1)
        tx, ty = way[b, 0] - way[a, 0], way[b, 1] - way[a, 1]
        length = max(math.hypot(tx, ty), 1e-9)
        moved[j, 0] = way[j, 0] - ty / length * mean
        moved[j, 1] = way[j, 1] + tx / length * mean
    way[:n_way] = moved


@njit(cache=True)
def speed_limit(way, n_way, around, spacing_m, top, slow, near_m, roomy_m, turn_radps, brake):
    """The speed from which the way can be driven: slow past obstacles and round bends, braking in good time.

    Past something near_m away at `slow`, from roomy_m on at `top` (within the next 0.5 m); round a bend
    so that the turn rate stays below turn_radps. O(samples).
    """
    limit = top
    half = 4
    for j in range(n_way):
        here = top
        if j * spacing_m <= 0.5:
            share = min(max((around[j] - near_m) / (roomy_m - near_m), 0.0), 1.0)
            here = slow + (top - slow) * share
        if half <= j < n_way - half:
            ax, ay = way[j, 0] - way[j - half, 0], way[j, 1] - way[j - half, 1]
            bx, by = way[j + half, 0] - way[j, 0], way[j + half, 1] - way[j, 1]
            angle = abs(math.atan2(ax * by - ay * bx, ax * bx + ay * by))
            if angle > 0.1:
                here = min(here, max(slow, turn_radps * half * spacing_m / angle))
        limit = min(limit, math.sqrt(here * here + 2.0 * brake * max(j - 2, 0) * spacing_m))
    return limit


@njit(cache=True)
def alignment(way, n_way, around, tight_m, reach):
    """How well the robot is lined up with the first place within `reach` samples that has less room than tight_m.

    1 on the line through it and along it, falling to 0 at 0.12 m beside or 0.6 rad across; 1 if there
    is no such place. O(reach).
    """
    for j in range(min(n_way, reach)):
        if around[j] < tight_m:
            a, b = max(j - 2, 0), min(j + 2, n_way - 1)
            tx, ty = way[b, 0] - way[a, 0], way[b, 1] - way[a, 1]
            length = max(math.hypot(tx, ty), 1e-9)
            beside = abs(tx * way[j, 1] - ty * way[j, 0]) / length
            across = abs(math.atan2(ty, tx))
            return max(1.0 - max(beside / 0.12, across / 0.6), 0.0)
    return 1.0


@njit(cache=True)
def farthest_aim(way, n_way, hits, n_hits, spacing_m, nearest_m, farthest_m, need_m):
    """Index of the farthest sample to which the straight line keeps need_m from all hits. O(samples * hits).

    Between nearest_m and farthest_m along the way; the first of them if none does: a carrot seen
    across a corner would have the robot cut it.
    """
    first = min(int(math.ceil(nearest_m / spacing_m)), n_way - 1)
    for j in range(min(int(farthest_m / spacing_m), n_way - 1), first, -1):
        x, y = way[j, 0], way[j, 1]
        square = max(x * x + y * y, 1e-9)
        is_clear = True
        for k in range(n_hits):
            share = min(max((hits[k, 0] * x + hits[k, 1] * y) / square, 0.0), 1.0)
            dx, dy = hits[k, 0] - share * x, hits[k, 1] - share * y
            if dx * dx + dy * dy < need_m * need_m and share > 0.0:
                is_clear = False
                break
        if is_clear:
            return j
    return first


@njit(cache=True, inline="always")
def _ramp(value, target, most):
    return value + min(max(target - value, -most), most)


@njit(cache=True)
def least_distance(x, y, hits, n_hits):
    """From a point to the nearest hit, inf if there is none. O(hits)."""
    least = np.inf
    for k in range(n_hits):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        least = min(least, dx * dx + dy * dy)
    return math.sqrt(least)


@njit(cache=True)
def is_free(v, w, v_command, w_command, hold_s, v_ramp, w_ramp, hits, n_hits, safe_m):
    """Whether a command, held for hold_s and followed by braking to a stop, hits nothing.

    The twist (v, w) ramps as the base's does. The axis must stay safe_m from all hits; a robot that
    stands nearer already may move as long as it comes no nearer to anything than it is. O(steps * hits).
    """
    dt = 0.05
    x, y, yaw = 0.0, 0.0, 0.0
    need = min(safe_m, least_distance(0.0, 0.0, hits, n_hits))
    hold = int(round(hold_s / dt))
    for step in range(hold + 40):
        is_braking = step >= hold
        v = _ramp(v, 0.0 if is_braking else v_command, v_ramp * dt)
        w = _ramp(w, 0.0 if is_braking else w_command, w_ramp * dt)
        if is_braking and v == 0.0:
            return True
        x += v * dt * math.cos(yaw + 0.5 * w * dt)
        y += v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw += w * dt
        if least_distance(x, y, hits, n_hits) < need:
            return False
    return True


@njit(cache=True)
def free_bearing(bearing, widest, reach_m, hits, n_hits, safe_m):
    """The direction nearest to `bearing` in which reach_m straight ahead are free; nan if none within `widest`.

    Free as in `is_free`. A coarse vector field histogram (Borenstein and Koren 1991). O(directions * hits).
    """
    # a little more than `is_free` asks for, so that what is chosen here passes there
    need = min(safe_m, least_distance(0.0, 0.0, hits, n_hits)) + 0.002
    step = 0.1
    for i in range(2 * int(widest / step) + 1):
        direction = bearing + step * ((i + 1) // 2) * (1.0 if i % 2 else -1.0)
        is_clear = True
        for k in range(1, 9):
            along = reach_m * k / 8
            if least_distance(along * math.cos(direction), along * math.sin(direction), hits, n_hits) < need:
                is_clear = False
                break
        if is_clear:
            return direction
    return np.nan


@njit(cache=True)
def keep_believed(
    lone, n_lone, hits, n_hits, x, y, yaw, clearance_m, origin_x, origin_y, resolution_m, near_m
):
    """Append to `hits` the lone end points that the map has something near_m from, in the pose's frame; the new count.

    The others are spurious returns: in no scan but this one. O(lone).
    """
    ny, nx = clearance_m.shape
    c, s = math.cos(yaw), math.sin(yaw)
    for k in range(n_lone):
        ix = int(math.floor((x + c * lone[k, 0] - s * lone[k, 1] - origin_x) / resolution_m))
        iy = int(math.floor((y + s * lone[k, 0] + c * lone[k, 1] - origin_y) / resolution_m))
        if 0 <= ix < nx and 0 <= iy < ny and clearance_m[iy, ix] <= near_m:
            hits[n_hits] = lone[k]
            n_hits += 1
    return n_hits
