"""One config for a whole experiment: every part's own config, nested, plus what they share.

The classes whose name ends in Options are the parts' configs with shorter names for the command
line. Importing this loads no kernels and no simulator, so that --help is instant.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal, get_args

import tyro

from experiments.streams import Streams
from occmap.explorer_config import ExplorerConfig, PaceConfig
from occmap.goal_config import GoalConfig
from occmap.grid import GridConfig
from occmap.localization import SlamConfig
from occmap.mapper import MAX_BEAMS
from sim.faults import FaultsConfig
from sim.generators import BuildingConfig
from sim.lidar import LidarConfig
from sim.odometry import OdometryConfig
from sim.robot import RobotConfig

PoseSource = Literal["truth", "odometry", "slam"]

MOST_CELLS = 250_000_000
"""Of what one scan may reach: beams that meet nothing free their whole length, and the map must hold it."""


@dataclass(frozen=True)
class GoalOptions(GoalConfig):
    """Where to look next."""

    lambda_m_per_m2: Annotated[float, tyro.conf.arg(name="lambda")] = GoalConfig.lambda_m_per_m2
    """Metres the robot would drive to see one more square metre (strategy utility)."""


@dataclass(frozen=True)
class ExplorerOptions(ExplorerConfig):
    """The robot's mind."""

    grid: Annotated[GridConfig, tyro.conf.arg(name="map")] = field(default_factory=GridConfig)
    goals: Annotated[GoalOptions, tyro.conf.arg(name="")] = field(default_factory=GoalOptions)
    boundary_in_map: Annotated[tuple[tuple[float, float], ...], tyro.conf.Suppress] = ()
    pace: PaceConfig = field(default_factory=lambda: PaceConfig(first_look_s=3.0))
    """Begins with a long look: where the robot stands and heads then is where the whole map lies."""


@dataclass(frozen=True)
class ExperimentConfig:
    """One robot in one building. The same config gives the same run."""

    seed: int = 0
    """All chance grows from this number: building, start, noise and drift, each by a stream of its own."""
    plan: Path | None = None
    """Explore this floor plan instead of a generated building: an MJCF .xml, a Nav2 map .yaml, or a .png."""
    plan_resolution_m: float | None = None
    """Side of a pixel, for a .png plan."""
    start: tuple[float, float, float] | None = None
    """X Y YAW in the building's own frame, metres and radians. By default the building says, or chance."""
    boundary: tuple[tuple[float, float], ...] = ()
    """X Y X Y X Y ... corners of a polygon around the start, in the building's own frame: what is outside of
    it is neither explored nor driven to, and does not count."""
    pose: PoseSource = "slam"
    """slam: the wheels' word, corrected by matching scans and closing loops. odometry: where the wheels say,
    drift and all. truth: the true pose, for mapping and exploring alone."""
    noise_scale: float = 1.0
    """Multiplies every error of the lidar: 0 none."""
    drift_scale: float = 1.0
    """Multiplies every error of the wheels' odometry: 0 none."""
    time_limit_s: float = 7200.0
    """Simulated time after which the run ends, done or not."""
    oracle: bool = False
    """Afterwards, work out how short the way could have been for somebody who knows the building."""
    building: BuildingConfig = field(default_factory=BuildingConfig)
    lidar: LidarConfig = field(default_factory=LidarConfig)
    odometry: OdometryConfig = field(default_factory=OdometryConfig)
    robot: RobotConfig = field(default_factory=RobotConfig)
    faults: FaultsConfig = field(default_factory=FaultsConfig)
    explorer: Annotated[ExplorerOptions, tyro.conf.arg(name="")] = field(default_factory=ExplorerOptions)
    slam: Annotated[SlamConfig, tyro.conf.Suppress] = field(default_factory=SlamConfig)

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")
        if self.pose not in get_args(PoseSource):
            raise ValueError(f"unknown pose {self.pose!r}: choose from {', '.join(get_args(PoseSource))}")
        if self.start is not None and not all(math.isfinite(value) for value in self.start):
            raise ValueError(f"start must be three finite numbers, got {self.start}")
        if not 0.0 < self.time_limit_s < math.inf:
            raise ValueError(f"time_limit_s must be positive, got {self.time_limit_s}")
        for name in ("noise_scale", "drift_scale"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must not be negative, got {getattr(self, name)}")
        try:
            _ = self.scaled_odometry
        except ValueError as error:
            raise ValueError(f"drift_scale {self.drift_scale} is too much: {error}") from error
        if self.plan_resolution_m is not None and not 0.0 < self.plan_resolution_m < math.inf:
            raise ValueError(f"plan_resolution_m must be positive, got {self.plan_resolution_m}")
        if self.explorer.boundary_in_map:
            raise ValueError("explorer.boundary_in_map is worked out from boundary: give that instead")
        self._refuse_scans_beyond_maps()

    def _refuse_scans_beyond_maps(self) -> None:
        """ValueError if a scan has more beams than the mapper takes, or more cells than memory."""
        if self.lidar.beams > MAX_BEAMS:
            raise ValueError(f"a lidar may have at most {MAX_BEAMS} beams, got {self.lidar.beams}")
        model, resolution_m = self.explorer.sensor_model, self.explorer.grid.resolution_m
        reach_m = min(self.lidar.max_range_m, model.usable_range_m) + model.obstacle_thickness_m
        if 2.0 * reach_m / resolution_m > math.sqrt(MOST_CELLS):
            raise ValueError(
                f"a lidar that reaches {reach_m:g} m may see over {MOST_CELLS} cells of {resolution_m} m "
                "at once: lower lidar.max_range_m or sensor_model.usable_range_m, or raise map.resolution_m"
            )

    @property
    def building_seed(self) -> int:
        """Decides the building and the start; a child of the seed unless given."""
        return Streams(self.seed).integer("building") if self.building.seed is None else self.building.seed

    @property
    def scaled_lidar(self) -> LidarConfig:
        """The lidar with its errors scaled."""
        return replace(self.lidar, noise=self.lidar.noise.scaled(self.noise_scale))

    @property
    def scaled_odometry(self) -> OdometryConfig:
        """The wheels with their errors scaled."""
        return self.odometry.scaled(self.drift_scale)

    def pinned(self) -> ExperimentConfig:
        """The same experiment with nothing left to be derived: what config.json holds."""
        building = replace(self.building, seed=self.building_seed)
        return replace(self, building=building, plan=None if self.plan is None else self.plan.resolve())
