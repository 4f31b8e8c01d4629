"""The tree of frames in a bag: who is mounted on whom, fixed or moving, in three dimensions."""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.logs.pose_track import PoseTrack
from occmap.geometry import Pose2

Matrix = NDArray[np.float64]
"""(4, 4) homogeneous transform."""


class FrameTree:
    """Transforms parent_from_child, as /tf and /tf_static tell them."""

    def __init__(self) -> None:
        self._parent: dict[str, str] = {}
        self._fixed: dict[str, Matrix] = {}
        self._moving: defaultdict[str, list[tuple[float, Matrix]]] = defaultdict(list)

    def add(self, parent: str, child: str, time_s: float, parent_from_child: Matrix, static: bool) -> None:
        """Take in one transform; of a static one the time says nothing. A child has the parent named last."""
        parent, child = parent.lstrip("/"), child.lstrip("/")
        self._parent[child] = parent
        if static:
            self._fixed[child] = parent_from_child
        else:
            self._moving[child].append((time_s, parent_from_child))

    def chain(self, frame: str) -> list[str]:
        """The frame, its parent, and so on up to the root."""
        chain = [frame.lstrip("/")]
        while (parent := self._parent.get(chain[-1])) is not None and parent not in chain:
            chain.append(parent)
        return chain

    def mount(self, base: str, frame: str) -> Matrix:
        """base_from_frame along the tree, moving joints taken where they first were.

        Of a base that is not connected to the frame (drivers leave its name empty, or call it what no
        transform does) the part of the robot that carries the frame is meant.
        """
        base, chain = base.lstrip("/"), self.chain(frame)
        common = next((ancestor for ancestor in self.chain(base) if ancestor in chain), None)
        if common is None:
            return self.mount(self.body(frame), frame)
        return np.linalg.inv(self._up_to(common, self.chain(base))) @ self._up_to(common, chain)

    def odometry(self, frame: str) -> Odometry | None:
        """The joint above a frame that says where the robot drives; None if nothing above it moves.

        That is the joint below a frame called odom, or else the topmost that moves.
        """
        chain = self.chain(frame)
        repeated = [child for child in chain[:-1] if len(self._moving[child]) > 1]
        moving = [child for child in repeated if self._moves(child)] or repeated
        if not moving:
            return None
        below_odom = [child for child in moving if "odom" in self._parent[child]]
        base = below_odom[0] if below_odom else moving[-1]
        samples = self._moving[base]
        return Odometry(base, PoseTrack([t for t, _ in samples], [in_plane(pose) for _, pose in samples]))

    def body(self, frame: str) -> str:
        """The part of the robot that carries a frame, as far as the transforms know."""
        found = self.odometry(frame)
        return found.base if found else self.chain(frame)[-1]

    def _moves(self, child: str) -> bool:
        """Whether it was ever elsewhere: some send fixed joints again and again, like those that move."""
        first = self._moving[child][0][1]
        return any(np.any(pose != first) for _, pose in self._moving[child])

    def _up_to(self, ancestor: str, chain: list[str]) -> Matrix:
        """ancestor_from_frame for the frame at the chain's beginning."""
        ancestor_from_frame = np.eye(4)
        for child in chain[: chain.index(ancestor)]:
            joint = self._fixed[child] if child in self._fixed else self._moving[child][0][1]
            ancestor_from_frame = joint @ ancestor_from_frame
        return ancestor_from_frame


@dataclass(frozen=True)
class Odometry:
    """Where a frame of the robot was, as its wheels tell."""

    base: str
    track: PoseTrack


def matrix(translation: tuple[float, float, float], quaternion: tuple[float, float, float, float]) -> Matrix:
    """The transform of a translation (m) and a quaternion (x, y, z, w), which need not have unit length."""
    x, y, z, w = np.asarray(quaternion) / np.linalg.norm(quaternion)
    transform = np.eye(4)
    transform[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    transform[:3, 3] = translation
    return transform


def in_plane(transform: Matrix) -> Pose2:
    """What is left of a transform on the floor: where its origin lies and its x axis points."""
    return Pose2(
        float(transform[0, 3]),
        float(transform[1, 3]),
        math.atan2(float(transform[1, 0]), float(transform[0, 0])),
    )


def is_upside_down(transform: Matrix) -> bool:
    """Whether the frame's z axis points to the floor: its angles then run clockwise."""
    return float(transform[2, 2]) < 0.0
