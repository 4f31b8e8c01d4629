"""A disc on two wheels among boxes: enough of a world to drive planner and follower through."""

import math
from dataclasses import dataclass

import numpy as np

from occmap.clearance import ClearanceMap
from occmap.follower import Follower
from occmap.geometry import Pose2, Twist2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.mapper import Mapper
from occmap.path import Path
from occmap.planner import Planner
from occmap.scan import Scan

BODY_RADIUS_M = 0.17
PERIOD_S = 0.1


def room(width_m, height_m, *boxes):
    """Boxes (x0, y0, x1, y1) and four walls around the rectangle from (0, 0)."""
    w, h, t = width_m, height_m, 0.1
    walls = [(-t, -t, w + t, 0), (-t, h, w + t, h + t), (-t, 0, 0, h), (w, 0, w + t, h)]
    return np.array([*walls, *boxes], float)


class KinematicWorld:
    """Robot and boxes (n, 4) in the world frame; remembers how near the two came and how fast it went."""

    def __init__(self, boxes, pose, rng, noise_scale=1.0):
        self.boxes, self.pose, self.rng, self.noise_scale = boxes, pose, rng, noise_scale
        self.twist = Twist2(0.0, 0.0)
        self.time_s = 0.0
        self.least_clearance_m = math.inf
        self.fastest = [0.0, 0.0]
        self.travelled_m = 0.0

    def clearance_m(self):
        x, y = self.pose.position
        dx = np.maximum(np.maximum(self.boxes[:, 0] - x, x - self.boxes[:, 2]), 0.0)
        dy = np.maximum(np.maximum(self.boxes[:, 1] - y, y - self.boxes[:, 3]), 0.0)
        return float(np.hypot(dx, dy).min()) - BODY_RADIUS_M

    def scan(self, beams=360, max_range_m=12.0):
        """Ranges to the boxes, exact but for the default noise: 2 cm + 0.5 %, dropouts, shorts, misses."""
        bearings = np.linspace(-math.pi, math.pi, beams, endpoint=False)
        angles = bearings + self.pose.yaw_rad
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / np.stack((np.cos(angles), np.sin(angles)), axis=1)[:, None, :]
            low = (self.boxes[None, :, :2] - np.array(self.pose.position)) * inverse
            high = (self.boxes[None, :, 2:] - np.array(self.pose.position)) * inverse
        enter, leave = np.minimum(low, high).max(axis=2), np.maximum(low, high).min(axis=2)
        ranges = np.where((enter <= leave) & (enter > 0.0), enter, np.inf).min(axis=1)
        s, chance = self.noise_scale, self.rng.random(beams)
        noisy = ranges + s * (0.02 + 0.005 * np.where(np.isfinite(ranges), ranges, 0.0)) * self.rng.normal(
            size=beams
        )
        noisy = np.where(
            chance < 0.005 * s, self.rng.uniform(0.05, 1.0, beams) * np.minimum(ranges, 12.0), noisy
        )
        noisy = np.where((chance >= 0.005 * s) & (chance < 0.015 * s), np.nan, noisy)
        noisy = np.where((chance >= 0.015 * s) & (chance < 0.02 * s), np.inf, noisy)
        noisy = np.where(noisy > max_range_m, np.inf, noisy)
        return Scan(bearings, noisy, max_range_m, 0.05)

    def step(self, command):
        """One period of the base: 50 Hz ramps of 1 m/s2 and 3 rad/s2."""
        for _ in range(5):
            dt = PERIOD_S / 5
            v = self.twist.linear_mps + np.clip(command.linear_mps - self.twist.linear_mps, -dt, dt)
            w = self.twist.angular_radps + np.clip(
                command.angular_radps - self.twist.angular_radps, -3 * dt, 3 * dt
            )
            self.twist = Twist2(float(v), float(w))
            yaw = self.pose.yaw_rad + 0.5 * w * dt
            self.pose = Pose2(
                self.pose.x_m + v * dt * math.cos(yaw),
                self.pose.y_m + v * dt * math.sin(yaw),
                self.pose.yaw_rad,
            ) @ Pose2(0.0, 0.0, float(w * dt))
            self.travelled_m += abs(v) * dt
            self.least_clearance_m = min(self.least_clearance_m, self.clearance_m())
            self.fastest = [max(self.fastest[0], abs(v)), max(self.fastest[1], abs(w))]
        self.time_s += PERIOD_S


@dataclass
class Mind:
    """Maps at the true pose, plans to one goal, follows; the map frame is the world's turned and shifted."""

    world: KinematicWorld
    map_from_world: Pose2
    resolution_m: float = 0.05

    def __post_init__(self):
        self.grid = OccupancyGrid(GridConfig(resolution_m=self.resolution_m))
        self.mapper, self.clearance = Mapper(), ClearanceMap()
        self.planner, self.follower = Planner(), Follower()
        self.path: Path | None = None
        self.steering = None
        self.replans = 0

    @property
    def map_from_robot(self):
        return self.map_from_world @ self.world.pose

    def see(self):
        scan = self.world.scan()
        self.clearance.update(self.grid, self.mapper.insert(scan, self.map_from_robot, self.grid))
        return scan

    def look(self, scans=8):
        """Stand and look: one miss does not make a cell free."""
        for _ in range(scans):
            self.see()

    def plan(self, goal_in_world):
        goal = self.map_from_world.apply(np.array([goal_in_world]))
        start = self.grid.frame.cell_at(*self.map_from_robot.position)
        self.replans += 1
        self.path = self.planner.plan(
            self.grid, self.clearance.distance_m, start, self.grid.frame.cell_from_map(goal)
        )

    def tick(self, goal_in_world):
        scan = self.see()
        clearance, progress = self.clearance.distance_m, self.steering.progress_m if self.steering else 0.0
        if self.path is None or self.planner.is_blocked(self.path, self.grid, clearance, progress):
            self.plan(goal_in_world)
            self.steering = None
        if self.path is None:
            self.world.step(Twist2(0.0, 0.0))
            return
        self.steering = self.follower.follow(
            self.path, self.map_from_robot, self.world.twist, scan, Pose2.identity(), self.grid, clearance
        )
        self.world.step(self.steering.twist)

    def drive(self, goal_in_world, limit_s):
        """Until it has arrived; whether it did in time."""
        until = self.world.time_s + limit_s
        self.path = self.steering = None
        while self.world.time_s < until:
            self.tick(goal_in_world)
            if self.steering and self.steering.arrived:
                return True
        return False
