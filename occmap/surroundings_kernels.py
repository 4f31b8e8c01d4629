"""What a scan leaves free around the robot, in its own frame: hits (n, 2) are where its beams ended."""

import math

import numpy as np

from occmap.kernel import kernel, part

TOUCHING_M = 0.01
"""With this much less than the safe distance to something, the robot all but touches it."""
GAIN_M = 0.01
"""Less that a move would gain is noise."""
STEP_S = 0.05
"""Motion is predicted in steps of so long: of a few centimetres."""
SPARE_M = 0.002
"""A direction is chosen with so much more room than `is_free` asks for, so that it passes there."""
STEP_RAD, STEPS_AHEAD = 0.1, 8
"""Directions tried lie so far apart; on each, so many places are."""


@kernel
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
    """The scan's end points within reach_m of the lidar, their noise averaged over neighbours.

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
            j = i + k  # beams go round; a remainder here would cost more than all the rest
            j += n if j < 0 else (-n if j >= n else 0)
            other = ranges_m[j]
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


@kernel
def keep_believed(
    lone, n_lone, hits, n_hits, x, y, yaw, clearance_m, origin_x, origin_y, resolution_m, near_m
):
    """Append to `hits` the lone end points that the map has something near_m from; the new count.

    Points are in the frame of the pose (x, y, yaw). The others are spurious returns, in this scan
    and no other. O(lone).
    """
    ny, nx = clearance_m.shape
    c, s = math.cos(yaw), math.sin(yaw)
    for k in range(n_lone):
        ix = math.floor((x + c * lone[k, 0] - s * lone[k, 1] - origin_x) / resolution_m)
        iy = math.floor((y + s * lone[k, 0] + c * lone[k, 1] - origin_y) / resolution_m)
        if 0 <= ix < nx and 0 <= iy < ny and clearance_m[iy, ix] <= near_m:
            hits[n_hits, 0], hits[n_hits, 1] = lone[k, 0], lone[k, 1]
            n_hits += 1
    return n_hits


@kernel
def least_distance(x, y, hits):
    """Distance from a point to the nearest hit, inf if there is none. O(hits)."""
    least = np.inf
    for k in range(len(hits)):
        dx, dy = hits[k, 0] - x, hits[k, 1] - y
        least = min(least, dx * dx + dy * dy)
    return math.sqrt(least)


@part
def _ramp(value, target, most):
    return value + min(max(target - value, -most), most)


@kernel
def is_free(v, w, v_command, w_command, hold_s, v_ramp, w_ramp, hits, safe_m):
    """Whether a command, held for hold_s and followed by braking to a stop, hits nothing.

    The twist (v, w) ramps as the base's does. The axis must stay safe_m from all hits; a robot that
    stands nearer already may move as long as it comes no nearer to anything than it is, and, so near
    that it all but touches, forwards only to where there is more room: else noise would let it creep
    into a gap that it does not fit through, a scan at a time. O(steps * hits).
    """
    dt = STEP_S
    x, y, yaw = 0.0, 0.0, 0.0
    least_m = least_distance(0.0, 0.0, hits)
    need = min(safe_m, least_m)
    room_m = min(safe_m - TOUCHING_M, least_m + GAIN_M) if v_command > 0.0 else 0.0
    hold = round(hold_s / dt)
    braking = math.ceil(max(abs(v), abs(v_command)) / (v_ramp * dt)) + 1
    for step in range(hold + braking):
        is_braking = step >= hold
        v = _ramp(v, 0.0 if is_braking else v_command, v_ramp * dt)
        w = _ramp(w, 0.0 if is_braking else w_command, w_ramp * dt)
        if is_braking and v == 0.0:
            break
        x += v * dt * math.cos(yaw + 0.5 * w * dt)
        y += v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw += w * dt
        least_m = least_distance(x, y, hits)
        if least_m < need:
            return False
    return least_m >= room_m


@kernel
def free_bearing(bearing, widest, reach_m, hits, safe_m):
    """The direction nearest to `bearing`, at most `widest` off, in which reach_m are free; nan if none.

    Free as in `is_free`. A coarse vector field histogram (Borenstein and Koren 1991). O(directions * hits).
    """
    here_m = least_distance(0.0, 0.0, hits)
    need = min(safe_m, here_m) + SPARE_M
    room_m = min(safe_m - TOUCHING_M, here_m + GAIN_M)
    for i in range(2 * int(widest / STEP_RAD) + 1):
        direction = bearing + STEP_RAD * ((i + 1) // 2) * (1.0 if i % 2 else -1.0)
        is_clear = True
        least_m = 0.0
        for k in range(1, STEPS_AHEAD + 1):
            along = reach_m * k / STEPS_AHEAD
            least_m = least_distance(along * math.cos(direction), along * math.sin(direction), hits)
            if least_m < need:
                is_clear = False
                break
        if is_clear and least_m >= room_m:
            return direction
    return np.nan
