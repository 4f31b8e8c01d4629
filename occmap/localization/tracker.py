"""Local tracking: every scan against the older of two growing submaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from occmap.geometry import Pose2
from occmap.localization.first_look import FirstLook, FirstLookConfig, is_within
from occmap.localization.matcher import Match, Matcher, axes
from occmap.localization.motion import Prediction
from occmap.localization.submap import Submap, SubmapConfig, View
from occmap.localization.surfel_map import Cloud
from occmap.localization.tracked import Tracked
from occmap.scan import Scan


@dataclass(frozen=True)
class TrackerConfig(FirstLookConfig):
    """Which scans build a submap, and when it is full."""

    insert_every_m: float = 0.15
    """A scan is inserted once the robot has driven this far since the last one."""
    insert_every_rad: float = 0.17
    """Or has turned this far."""
    scans_per_half: int = 20
    """A new submap starts after so many inserted scans, and is full after twice as many."""
    view_every: int = 5
    """Every so many inserted scans one is kept, to tell what was seen through."""
    drift_share: float = 0.28
    """Part of an inserted scan's covariance that adds to the drift between two submaps."""
    drift_share_yaw: float = 0.03
    """The same, of its turn: where one scan is turned too far to the left, the next is to the right."""
    drift_m: float = 0.004
    """Standard deviation of the drift between two submaps even where every match is perfect."""
    drift_rad: float = 0.0005
    """The same, of their turn."""
    bridge_fit: float = 0.7
    """After a gap, a scan of which less than this share lies on the map shows another place."""
    usual_memory: int = 20
    """So many scans are averaged to know how well scans fit hereabouts."""


class Tracker:
    """Keeps two submaps growing, the younger half as old: the older one is what scans are matched to."""

    def __init__(self, config: TrackerConfig, submap_config: SubmapConfig, matcher: Matcher) -> None:
        self.config = config
        self.submap_config = submap_config
        self.matcher = matcher
        self.submaps: list[Submap] = []
        self.first_look = FirstLook(config, matcher)
        self._pose = Pose2.identity()  # robot in the reference submap
        self._last_inserted = Pose2.identity()  # the same
        self.last_step = Pose2.identity()
        """previous_robot_from_robot, as tracked."""
        self.fits = True
        """Whether most of the scan lies on the map there."""
        self.is_seen = False
        """Whether the scan says so, rather than the prediction."""
        self._drift = np.zeros((3, 3))  # covariance since the youngest submap began, in its frame
        self._first = 0  # submap since the last gap
        self._usual_fit = 0.0
        self._last_view: View | None = None

    @property
    def reference(self) -> int:
        """The older of the two growing submaps; after a gap there is only one for a while."""
        return max(len(self.submaps) - 2, self._first)

    def update(self, cloud: Cloud, prediction: Prediction, scan: Scan, robot_from_lidar: Pose2) -> Tracked:
        """Track one scan, given in the robot's frame."""
        if not self.submaps:
            self._begin_submap(scan)
            self._insert(cloud, scan, robot_from_lidar)
            self.first_look.begin(scan, robot_from_lidar)
            return Tracked(0, self._pose, self._pose, 0.0)
        if self.submaps[-1].cloud is not None:  # it was finished, and goes on
            self._begin_submap(scan)
        reference = self.submaps[self.reference]
        guess = self._pose @ prediction.step
        match = self.matcher.match(cloud, reference, guess, prediction, self._usual_fit)
        if prediction.is_gap and not self._is_bridged(match, cloud, prediction):
            return self._begin_anew(cloud, prediction, scan, robot_from_lidar)
        self._usual_fit += (match.fit - self._usual_fit) / self.config.usual_memory
        if not self.first_look.is_over:
            if self.first_look.goes_on(prediction.step, match, cloud, self.submaps[0]):
                return self._look_again(scan)
            self._learn_the_start()
        self.last_step = self._pose.inverse() @ match.submap_from_robot
        self.fits = match.fit >= self.config.bridge_fit
        self.is_seen = self.fits and match.tells(prediction.sigma_m)
        self._pose = match.submap_from_robot
        tracked = Tracked(self.reference, self._pose, self.younger_from_older() @ self._pose, self._blend())
        if self._moved_enough():
            self._add_drift(match)
            self._insert(cloud, scan, robot_from_lidar)
            if self.submaps[-1].scans >= self.config.scans_per_half:
                self._begin_submap(scan)
                self._insert_into(self.submaps[-1], Pose2.identity(), cloud, scan, robot_from_lidar)
        return tracked

    def _is_bridged(self, match: Match, cloud: Cloud, prediction: Prediction) -> bool:
        """Whether a scan after a gap surely shows the place that was seen before it, and just where."""
        return (
            match.fit >= self.config.bridge_fit
            and prediction.window_m >= 2.0 * prediction.sigma_m
            and not self.matcher.has_rival(cloud, self.submaps[self.reference], match, prediction)
        )

    def _begin_anew(
        self, cloud: Cloud, prediction: Prediction, scan: Scan, robot_from_lidar: Pose2
    ) -> Tracked:
        """Begin a submap of what is seen after a gap; only loops, or the wheels, tell where it is."""
        variances = np.array([prediction.sigma_m, prediction.sigma_m, prediction.sigma_rad]) ** 2
        self._drift += np.diag(variances)
        self.last_step, self.fits, self.is_seen = prediction.step, True, False
        self._pose = self._pose @ prediction.step
        self.finish()
        self._begin_submap(scan)
        self._first = len(self.submaps) - 1
        self.submaps[-1].is_after_gap = True
        self._pose, self._usual_fit = Pose2.identity(), 0.0
        self._insert(cloud, scan, robot_from_lidar)
        return Tracked(self._first, self._pose, self._pose, 0.0)

    def _look_again(self, scan: Scan) -> Tracked:
        """Take one more look from the map's origin, where the robot still is, to average out the noise."""
        if self.first_look.add(scan):
            self._learn_the_start()
        self.last_step = Pose2.identity()
        return Tracked(0, self._pose, self._pose, 0.0)

    def _learn_the_start(self) -> None:
        """Let the first submap show the mean of all looks so far."""
        mean = self.first_look.mean(self.submap_config.reach_m)
        self.submaps[0].see_better(mean, len(self.first_look))

    def finish(self) -> list[int]:
        """Close the growing submaps, as nothing more comes for now; returns their numbers."""
        if self.submaps and not self.first_look.is_over:
            self.first_look.is_over = True
            self._learn_the_start()
        growing = [k for k, submap in enumerate(self.submaps) if submap.cloud is None]
        for k in growing:
            self.submaps[k].finish()
        return growing

    def younger_from_older(self) -> Pose2:
        """youngest_from_reference; identity while there is only one submap."""
        return self.submaps[-1].previous_from_submap.inverse() if self._are_two else Pose2.identity()

    @property
    def _are_two(self) -> bool:
        return self.reference < len(self.submaps) - 1

    def _blend(self) -> float:
        return self.submaps[-1].scans / self.config.scans_per_half if self._are_two else 0.0

    def _moved_enough(self) -> bool:
        moved = self._last_inserted.inverse() @ self._pose
        return not is_within(moved, self.config.insert_every_m, self.config.insert_every_rad)

    def _insert(self, cloud: Cloud, scan: Scan, robot_from_lidar: Pose2) -> None:
        self._last_inserted = self._pose
        if self.submaps[self.reference].cloud is None:
            self._insert_into(self.submaps[self.reference], self._pose, cloud, scan, robot_from_lidar)
        if self._are_two:
            pose = self.younger_from_older() @ self._pose
            self._insert_into(self.submaps[-1], pose, cloud, scan, robot_from_lidar)

    def _insert_into(
        self, submap: Submap, pose: Pose2, cloud: Cloud, scan: Scan, robot_from_lidar: Pose2
    ) -> None:
        if submap.scans % self.config.view_every == 0:
            self._last_view = View.of(scan, pose @ robot_from_lidar, self._last_view)
            submap.views.append(self._last_view)
        submap.insert(cloud, pose)

    def _begin_submap(self, scan: Scan) -> None:
        """Begin a submap at the robot's pose; the older of the two before it is full."""
        floor = np.diag([self.config.drift_m**2, self.config.drift_m**2, self.config.drift_rad**2])
        youngest_from_robot = self.younger_from_older() @ self._pose
        turned = axes(-youngest_from_robot.yaw_rad)
        information = np.linalg.inv(turned @ self._drift @ turned.T + floor)
        self.submaps.append(
            Submap(
                self.submap_config, youngest_from_robot, 0.5 * (information + information.T), scan.max_range_m
            )
        )
        if len(self.submaps) > 2:
            if self.submaps[-3].cloud is None:
                self.submaps[-3].finish()
            self._pose = youngest_from_robot
            self._last_inserted = self._pose
        self._drift = np.zeros((3, 3))

    def _add_drift(self, match: Match) -> None:
        turned = axes(self.younger_from_older().yaw_rad)
        # a scan that tells less of its turn than the wheels is not pulled back by the map: errors add up
        share_yaw = 1.0 if match.is_blind_to_turns else self.config.drift_share_yaw
        shares = np.sqrt([self.config.drift_share, self.config.drift_share, share_yaw])
        covariance = shares[:, None] * np.linalg.inv(match.posterior) * shares
        self._drift += turned @ covariance @ turned.T
