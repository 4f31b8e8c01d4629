"""Simultaneous localisation and mapping: track locally, close loops globally, correct the past."""

from __future__ import annotations

from dataclasses import dataclass, field

from occmap.geometry import Pose2
from occmap.grid import GridConfig, OccupancyGrid
from occmap.localization.compass import Compass, CompassConfig
from occmap.localization.first_look import is_within
from occmap.localization.localizer import Estimate
from occmap.localization.loop_closure import LoopCloser, LoopClosureConfig
from occmap.localization.matcher import Matcher, MatcherConfig
from occmap.localization.motion import MotionConfig, MotionModel
from occmap.localization.pose_graph import PoseGraph
from occmap.localization.submap import SubmapConfig
from occmap.localization.surfel_map import Cloud
from occmap.localization.told_map import ToldMap, ToldMapConfig
from occmap.localization.track import Track
from occmap.localization.tracked import Tracked
from occmap.localization.tracker import Tracker, TrackerConfig
from occmap.localization.undistortion import undistorted
from occmap.scan import Observation, Scan
from occmap.sensor_model import SensorModelConfig


@dataclass(frozen=True)
class SlamConfig:
    """One set of parameters for every building, robot and log."""

    motion: MotionConfig = field(default_factory=MotionConfig)
    matcher: MatcherConfig = field(default_factory=MatcherConfig)
    submap: SubmapConfig = field(default_factory=SubmapConfig)
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    loops: LoopClosureConfig = field(default_factory=LoopClosureConfig)
    compass: CompassConfig = field(default_factory=CompassConfig)
    told: ToldMapConfig = field(default_factory=ToldMapConfig)


class SlamLocalizer:
    """Scans against submaps, submaps against submaps, and all of them in one pose graph.

    For an Explorer, `grid` and `sensor_model` must be those of its own config: with each correction of the
    past it is handed another grid, built by these, and goes on to map in that one by its own.
    """

    def __init__(
        self,
        config: SlamConfig | None = None,
        grid: GridConfig | None = None,
        sensor_model: SensorModelConfig | None = None,
    ) -> None:
        self.config = c = config or SlamConfig()
        matcher = Matcher(c.matcher)
        self.motion = MotionModel(c.motion)
        self.tracker = Tracker(c.tracker, c.submap, matcher)
        self.graph = PoseGraph()
        self.loops = LoopCloser(c.loops, matcher, self.graph, self.tracker.submaps)
        self.compass = Compass(c.compass, self.graph, self.tracker.submaps)
        self.told = ToldMap(c.told, grid, sensor_model)
        self.track = Track()
        self._settled = True
        self._to_tell = False

    def update(self, seen: Observation) -> Estimate:
        """Estimate where the robot is, given what it senses now."""
        prediction = self.motion.predict(seen)
        scan = seen.scan
        if not self.tracker.first_look.wheels_stand(prediction.step):  # else its beams start from one place
            scan = undistorted(scan, seen.robot_from_lidar, prediction.step, self.motion.step_s)
        cloud = Cloud.of(scan, seen.robot_from_lidar, self.config.submap.reach_m)
        stood = not self.tracker.first_look.is_over
        tracked = self.tracker.update(cloud, prediction, scan, seen.robot_from_lidar)
        self.motion.took(self.tracker.last_step, self.tracker.is_seen, self.tracker.fits)
        self.track.append(seen.time_s, tracked)
        was_settled = self._settled
        self._add_new_submaps()
        if stood and self.tracker.first_look.is_over:
            self.compass.look(0, is_still=True)
        self._think(was_settled)
        return self._tell(seen, scan, tracked)

    def odometry_goes_on(self, seen: Observation, reach_m: float, reach_rad: float) -> bool:
        """Whether this odometry continues that of the last observation.

        Its pose must lie within reach_m and reach_rad of that one's, its stamp be earlier by no more than
        pause_s: stamps of some logs err by a second.
        """
        last = self.motion.last
        if last is None or seen.time_s < last.time_s - self.config.motion.pause_s:
            return False
        return is_within(last.odom_from_robot.inverse() @ seen.odom_from_robot, reach_m, reach_rad)

    def rest_until(self, time_s: float) -> None:
        """Take in that the robot stands where it stood, however long nothing was heard of it."""
        self.motion.rest_until(time_s)

    def restart_odometry(self) -> None:
        """Begin anew with odometry: the robot was switched off and stands where it stood."""
        self.motion.forget_odometry()

    def finish(self) -> None:
        """Close the loops that can be closed, and settle: nothing more will be seen for now."""
        for submap in self.tracker.finish():
            self.loops.propose(submap)
        self._think_to_the_end()
        self.loops.propose_lonely()
        self._think_to_the_end()

    def _think_to_the_end(self) -> None:
        while self.loops.is_busy:
            self._think()
        self.graph.optimise()

    def trajectory(self) -> list[tuple[float, Pose2]]:
        """(time, map_from_robot) of every observation in turn, as all that was seen since has it."""
        return self.track.in_map(self.map_from_submap())

    def map(self) -> OccupancyGrid:
        """The grid, built anew from the corrected poses of all mapped scans."""
        return self.told.fresh(self.map_from_submap())

    def map_from_submap(self) -> list[Pose2]:
        """Poses of the submaps, as all that was seen has them."""
        return [self.graph.pose(k) for k in range(len(self.graph.poses))]

    def _add_new_submaps(self) -> None:
        for k in range(len(self.graph.poses), len(self.tracker.submaps)):
            submap = self.tracker.submaps[k]
            if k == 0:
                self.graph.add_node(Pose2.identity())
            else:
                self.graph.add_node(self.graph.pose(k - 1) @ submap.previous_from_submap)
                self.graph.add_edge(k - 1, k, submap.previous_from_submap, submap.information)
                self.compass.look(k - 1)
            if k >= 2:
                self.compass.look(k - 2)
                self._settled = self.graph.iterate().converged
            for older in range(max(k - 2, 0), k):
                if self.tracker.submaps[older].cloud is not None:
                    self.loops.propose(older)
            self.told.add_submap(submap.previous_from_submap, self.graph.pose(k))

    def _think(self, was_settled: bool = True) -> None:
        """One slice of loop closing and optimisation.

        was_settled: whether the graph had converged before this update. Corrected poses are handed to
        `told` when it has just converged, or when a correction is pending and affordable.
        """
        if self.loops.step():
            self._settled = False
        was_settled = was_settled and self._settled  # a new submap may have settled or unsettled it
        if not self._settled:
            self._settled = self.graph.iterate().converged
        if self._settled and (not was_settled or (self._to_tell and self.told.can_afford_correction)):
            self._to_tell = not self.told.correct(self.map_from_submap())

    def _tell(self, seen: Observation, scan: Scan, tracked: Tracked) -> Estimate:
        """The pose in the frame that the receiver knows; or the corrected one, and a grid to go with it."""
        before = self.told.pose_of(tracked)
        grid = self.told.step()
        pose = self.told.pose_of(tracked)
        insert = self.told.wants(seen.time_s, tracked)
        if insert:
            scan = self.told.add_scan(scan, seen.robot_from_lidar, tracked)
        shift = None if grid is None else pose @ before.inverse()
        return Estimate(pose, insert, grid, shift, None if scan is seen.scan else scan)
