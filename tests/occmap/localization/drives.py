"""Robots driven through rooms of boxes, with wheels that lie a little."""

import math

import numpy as np

from occmap.geometry import Pose2, wrap_angle
from occmap.localization import SlamLocalizer
from occmap.scan import Observation
from tests.occmap.kinematic_world import KinematicWorld, room

RING = room(
    14.0, 10.0, (3, 3, 11, 7), (0.5, 4, 0.9, 4.4), (6, 9.2, 6.8, 10), (13, 5, 14, 5.6), (8, 0, 8.4, 0.7)
)
"""A corridor round a block, with a few things along it."""
RING_LAP = [(1.5, 1.5), (12.5, 1.5), (12.5, 8.5), (1.5, 8.5)]


def scan_at(boxes, pose, rng, noise_scale=0.5, beams=180, max_range_m=12.0):
    return KinematicWorld(boxes, pose, rng, noise_scale).scan(beams, max_range_m)


def drive(waypoints, step_m=0.1, turn_rad=0.15):
    """Poses from waypoint to waypoint: turn on the spot, go straight."""
    x, y = waypoints[0]
    yaw = math.atan2(waypoints[1][1] - y, waypoints[1][0] - x)
    poses = [Pose2(x, y, yaw)]
    for goal_x, goal_y in waypoints[1:]:
        while math.hypot(goal_x - x, goal_y - y) > step_m:
            off = wrap_angle(math.atan2(goal_y - y, goal_x - x) - yaw)
            yaw += math.copysign(min(abs(off), turn_rad), off)
            if abs(off) <= turn_rad:
                x, y = x + step_m * math.cos(yaw), y + step_m * math.sin(yaw)
            poses.append(Pose2(x, y, yaw))
    return poses


def observe(boxes, poses, rng, turn_error_per_m=0.01, length_error=0.02, **scan):
    """What a robot at these poses senses; its odometry turns and stretches as it goes."""
    odom, before, stream = Pose2.identity(), poses[0], []
    for k, pose in enumerate(poses):
        step = before.inverse() @ pose
        metres = math.hypot(step.x_m, step.y_m)
        odom = odom @ Pose2(
            step.x_m * (1.0 + length_error), step.y_m, step.yaw_rad + turn_error_per_m * metres
        )
        before = pose
        stream.append(Observation(0.2 * k, odom, scan_at(boxes, pose, rng, **scan), Pose2.identity()))
    return stream


def errors_m(poses, estimates):
    """(n,) distances between the driven poses and the estimates, placed by the first pose alone."""
    world_from_map = poses[0]
    return np.array([(world_from_map @ e).distance_to(p) for p, e in zip(poses, estimates, strict=True)])


def mapped(stream):
    """What slam makes of a stream of observations, from beginning to end."""
    slam = SlamLocalizer()
    for seen in stream:
        slam.update(seen)
    slam.finish()
    return slam
