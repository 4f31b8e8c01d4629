"""A turn of the lidar takes time: what it would have seen from one place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from occmap.geometry import Pose2
from occmap.scan import Scan


def undistorted(scan: Scan, robot_from_lidar: Pose2, step: Pose2, step_s: float) -> Scan:
    """The scan as seen from where the lidar was at the observation's stamp.

    The robot is taken to have moved by `step` (previous_robot_from_robot) every step_s seconds, and
    to keep doing so while the beams were cast. Without beam times the scan is returned as it is.
    """
    if scan.beam_times_s is None or step_s <= 0.0 or step == Pose2.identity():
        return scan
    share = scan.beam_times_s / step_s
    turn = step.yaw_rad * share
    # constant twist, to second order: the chord of an arc is turned by half of its angle
    c, s = np.cos(0.5 * (turn - step.yaw_rad)), np.sin(0.5 * (turn - step.yaw_rad))
    shift_x = share * (c * step.x_m - s * step.y_m)
    shift_y = share * (s * step.x_m + c * step.y_m)
    reach = np.where(scan.is_hit, scan.ranges_m, scan.max_range_m)
    in_robot = robot_from_lidar.apply(
        np.column_stack((reach * np.cos(scan.bearings_rad), reach * np.sin(scan.bearings_rad)))
    )
    c, s = np.cos(turn), np.sin(turn)
    moved = np.column_stack(
        (shift_x + c * in_robot[:, 0] - s * in_robot[:, 1], shift_y + s * in_robot[:, 0] + c * in_robot[:, 1])
    )
    seen = robot_from_lidar.inverse().apply(moved)
    # what hit does so from there, what met nothing does not, and what failed says nothing
    nearest_m, farthest_m = scan.least_range_m, np.nextafter(scan.max_range_m, 0.0)
    hits = np.clip(np.hypot(seen[:, 0], seen[:, 1]), nearest_m, farthest_m)
    others = np.where(scan.ranges_m >= scan.max_range_m, np.inf, np.nan)
    return replace(
        scan,
        bearings_rad=np.arctan2(seen[:, 1], seen[:, 0]),
        ranges_m=np.where(scan.is_hit, hits, others),
        beam_times_s=None,
    )
