"""Recorded logs made harder: what another robot, sensor or driver would have left of the same drive.

Each takes a log and returns one; stamps stay, so that true relations still say where the laser was.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from experiments.logs.log import RecordedLog
from occmap.geometry import Pose2
from occmap.scan import Observation, Scan

Perturbation = Callable[[RecordedLog], RecordedLog]


def as_it_is(log: RecordedLog) -> RecordedLog:
    return log


def without_odometry(log: RecordedLog) -> RecordedLog:
    blind = tuple(replace(seen, odom_from_robot=Pose2.identity()) for seen in log.observations)
    return replace(log, observations=blind, has_odometry=False)


def every_other_scan(log: RecordedLog) -> RecordedLog:
    return replace(log, observations=log.observations[::2])


def backwards(log: RecordedLog) -> RecordedLog:
    """The robot drives in reverse from the end to the beginning."""
    return replace(log, observations=log.observations[::-1])


def seeing(range_m: float) -> Perturbation:
    """The laser reaches only so far."""

    def blurred(scan: Scan) -> Scan:
        return replace(scan, ranges_m=np.where(scan.ranges_m > range_m, np.inf, scan.ranges_m))

    return lambda log: _with_scans(log, blurred)


def looking(half_rad: float) -> Perturbation:
    """The laser sees only so far to either side."""

    def narrowed(scan: Scan) -> Scan:
        ahead = np.abs(scan.bearings_rad) <= half_rad
        return replace(scan, bearings_rad=scan.bearings_rad[ahead], ranges_m=scan.ranges_m[ahead])

    return lambda log: _with_scans(log, narrowed)


def drifting(rad_per_m: float, scale: float) -> Perturbation:
    """The wheels turn and stretch every metre by so much more."""

    def drifted(log: RecordedLog) -> RecordedLog:
        odom_from_robot = log.observations[0].odom_from_robot
        observations = [log.observations[0]]
        for before, seen in pairwise(log.observations):
            step = before.odom_from_robot.inverse() @ seen.odom_from_robot
            turn = rad_per_m * math.hypot(step.x_m, step.y_m)
            odom_from_robot = odom_from_robot @ Pose2(scale * step.x_m, scale * step.y_m, step.yaw_rad + turn)
            observations.append(replace(seen, odom_from_robot=odom_from_robot))
        return replace(log, observations=tuple(observations))

    return drifted


def without_a_minute(from_s: float) -> Perturbation:
    """A minute is missing; the wheels went on counting."""

    def interrupted(log: RecordedLog) -> RecordedLog:
        gone_s = min(seen.time_s for seen in log.observations) + from_s
        kept = tuple(seen for seen in log.observations if not gone_s <= seen.time_s < gone_s + 60.0)
        return replace(log, observations=kept)

    return interrupted


def turned(log: RecordedLog) -> RecordedLog:
    """The odometry began elsewhere and facing another way."""
    elsewhere = Pose2(3.0, -7.0, 2.0)
    observations = tuple(
        replace(seen, odom_from_robot=elsewhere @ seen.odom_from_robot) for seen in log.observations
    )
    return replace(log, observations=observations)


PERTURBATIONS: dict[str, Perturbation] = {
    "as it is": as_it_is,
    "no odometry": without_odometry,
    "every other scan": every_other_scan,
    "backwards": backwards,
    "8 m range": seeing(8.0),
    "5 m range": seeing(5.0),
    "120 deg wide": looking(math.radians(60.0)),
    "drift": drifting(0.02, 1.05),
    "8 m range, drift": lambda log: drifting(0.02, 1.05)(seeing(8.0)(log)),
    "a minute missing": without_a_minute(200.0),
    "turned": turned,
}


def _with_scans(log: RecordedLog, change: Callable[[Scan], Scan]) -> RecordedLog:
    def changed(seen: Observation) -> Observation:
        return replace(seen, scan=change(seen.scan))

    return replace(log, observations=tuple(map(changed, log.observations)))
