"""What the README says a robot's own loop looks like, run as it stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from occmap.decision import Reason
from occmap.geometry import Pose2, Twist2
from occmap.map_server import load_map
from tests.occmap.kinematic_world import KinematicWorld, room

README = Path(__file__).parents[1] / "README.md"
MOUNT = Pose2(0.05, 0.0, 0.0)


class OwnRobot:
    """A lidar, odometry and a base as a driver might have them."""

    def __init__(self):
        self.world = KinematicWorld(
            room(5.0, 4.0, (2.4, 0.0, 2.6, 2.6)), Pose2(1.0, 1.0, 0.3), np.random.default_rng(0), 0.5
        )
        self._start = self.world.pose

    def next_scan(self):
        base, self.world.pose = self.world.pose, self.world.pose @ MOUNT
        scan = self.world.scan()
        self.world.pose = base
        return self.world.time_s, scan.bearings_rad, scan.ranges_m

    def read(self):
        return (self._start.inverse() @ self.world.pose).numbers()

    def drive(self, linear_mps, angular_radps):
        self.world.step(Twist2(linear_mps, angular_radps))


def test_the_loop_for_your_own_robot_explores_and_leaves_a_map(tmp_path, monkeypatch):
    section = README.read_text().split("## On your own robot")[1]
    code = section.split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(tmp_path)
    robot = OwnRobot()
    names = {"lidar": robot, "odometry": robot, "base": robot}
    exec(code, names)
    assert names["status"].value == "complete"
    assert robot.world.least_clearance_m > 0.0
    known = load_map(tmp_path / "map.yaml")
    assert 0.95 * 19.4 < (known.state == 1).sum() * known.resolution_m**2 < 1.02 * 19.4
    assert not [left for left in names["decision"].unknown_left if left.reason is Reason.GAVE_UP]
