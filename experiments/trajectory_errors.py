"""Absolute and relative trajectory errors, as the evo tool defines them (checked against it in a test).

Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012, section V.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from experiments.error_statistics import Statistics
from experiments.planar import Poses, between
from experiments.tum_file import Trajectory

Unit = Literal["frames", "m"]

SAME_STAMP_S = 0.01
"""Stamps no farther apart than this are of one moment: evo's default."""


def associated(reference: Trajectory, estimate: Trajectory) -> tuple[Trajectory, Trajectory]:
    """The poses of both at the same stamps: for each of the shorter one, the nearest of the longer one."""
    flipped = len(estimate) > len(reference)
    short, long = (reference, estimate) if flipped else (estimate, reference)
    index, gap_s = long.nearest(short.times_s)
    near = gap_s <= SAME_STAMP_S
    if not near.any():
        raise ValueError(
            f"no stamps in common: {reference.times_s[0]:.6f} to {reference.times_s[-1]:.6f} s and "
            f"{estimate.times_s[0]:.6f} to {estimate.times_s[-1]:.6f} s"
        )
    kept = Trajectory(short.times_s[near], short.poses[near])
    found = Trajectory(long.times_s[index[near]], long.poses[index[near]])
    return (kept, found) if flipped else (found, kept)


def absolute_errors_m(reference: Poses, estimate: Poses) -> NDArray[np.float64]:
    """(n,) distances between positions, nothing fitted."""
    return np.hypot(*(estimate[:, :2] - reference[:, :2]).T)


def aligned(reference: Poses, estimate: Poses) -> Poses:
    """The estimate, moved rigidly onto the reference (least squares; Umeyama 1991 without scale)."""
    to, source = reference[:, :2].mean(axis=0), estimate[:, :2].mean(axis=0)
    covariance = (reference[:, :2] - to).T @ (estimate[:, :2] - source)
    yaw = np.arctan2(covariance[1, 0] - covariance[0, 1], covariance[0, 0] + covariance[1, 1])
    c, s = np.cos(yaw), np.sin(yaw)
    positions = (estimate[:, :2] - source) @ np.array([[c, s], [-s, c]]) + to
    return np.column_stack((positions, estimate[:, 2] + yaw))


def relative_errors(
    reference: Poses, estimate: Poses, delta: float, unit: Unit
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(m, degrees) of the motion between consecutive poses that lie delta frames or metres apart.

    Metres are counted along the estimate's own path, as evo does.
    """
    ends = _every(estimate, delta, unit)
    if len(ends) < 2:
        raise ValueError(f"the trajectory is shorter than {delta} {unit}")
    true = between(reference[ends[:-1]], reference[ends[1:]])
    error = between(true, between(estimate[ends[:-1]], estimate[ends[1:]]))
    return np.hypot(*error[:, :2].T), np.degrees(np.abs(error[:, 2]))


def _every(poses: Poses, delta: float, unit: Unit) -> NDArray[np.int64]:
    """The first pose, and each that is first to be delta past the one before it."""
    if unit == "frames":
        if delta != int(delta) or delta < 1:
            raise ValueError(f"a distance in frames must be a whole number from 1, got {delta}")
        return np.arange(0, len(poses), int(delta))
    if not delta > 0.0:
        raise ValueError(f"a distance in metres must be positive, got {delta}")
    ends, path_m = [0], 0.0
    for k, step_m in enumerate(np.hypot(*np.diff(poses[:, :2], axis=0).T), start=1):
        path_m += step_m
        if path_m >= delta:
            ends.append(k)
            path_m = 0.0
    return np.array(ends)


def absolute(reference: Trajectory, estimate: Trajectory, align: bool = False) -> Statistics:
    """ATE in metres over the stamps that both have."""
    true, believed = associated(reference, estimate)
    poses = aligned(true.poses, believed.poses) if align else believed.poses
    return Statistics.of(absolute_errors_m(true.poses, poses))


def relative(
    reference: Trajectory, estimate: Trajectory, delta: float = 1.0, unit: Unit = "frames"
) -> tuple[Statistics, Statistics]:
    """RPE in metres and in degrees over the stamps that both have."""
    true, believed = associated(reference, estimate)
    metres, degrees = relative_errors(true.poses, believed.poses, delta, unit)
    return Statistics.of(metres), Statistics.of(degrees)
