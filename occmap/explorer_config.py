"""What can be told to an explorer before it sets out."""

from __future__ import annotations

from dataclasses import dataclass, field

from occmap.clearance import ClearanceConfig
from occmap.ending import EndingConfig
from occmap.follower import FollowerConfig
from occmap.frontiers import FrontierConfig
from occmap.goal_config import GoalConfig
from occmap.grid import GridConfig
from occmap.pace import PaceConfig
from occmap.planner import PlannerConfig
from occmap.pursuit import PursuitConfig
from occmap.recovery import RecoveryConfig
from occmap.sensor_model import SensorModelConfig
from occmap.stuck import StuckConfig


@dataclass(frozen=True)
class ExplorerConfig:
    """The robot's mind, part by part."""

    grid: GridConfig = field(default_factory=GridConfig)
    sensor_model: SensorModelConfig = field(default_factory=SensorModelConfig)
    clearance: ClearanceConfig = field(default_factory=ClearanceConfig)
    frontiers: FrontierConfig = field(default_factory=FrontierConfig)
    goals: GoalConfig = field(default_factory=GoalConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    pursuit: PursuitConfig = field(default_factory=PursuitConfig)
    stuck: StuckConfig = field(default_factory=StuckConfig)
    recovery: RecoveryConfig = field(default_factory=RecoveryConfig)
    pace: PaceConfig = field(default_factory=PaceConfig)
    ending: EndingConfig = field(default_factory=EndingConfig)
    boundary_in_map: tuple[tuple[float, float], ...] = ()
    """Corners of a polygon around the start: what is outside of it is neither explored nor driven to."""
