"""What a replay leaves behind: trajectories, map and summary.json."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from experiments.config_file import to_plain
from experiments.maps import write_belief
from experiments.relations import Relations, RelationsScore, score_relations
from experiments.replaying.runner import Replayed
from experiments.run_folder import SUMMARY, RunFolder
from experiments.summary_parts import finite, map_sha256, peak_memory_mb, versions
from experiments.tum_file import write_tum
from occmap.geometry import Pose2
from occmap.stopwatch import Stopwatch

if TYPE_CHECKING:
    from experiments.replay import Command
    from experiments.replaying.whereabouts import Whereabouts

REPORTED_SKIPPED = 100
"""The summary counts all broken lines and names so many."""


@dataclass(frozen=True)
class ReplaySummary:
    """summary.json of a replay. Fields may be added, never change meaning."""

    log: str
    config: dict[str, Any]
    status: str
    """complete, or interrupted."""
    scans: int
    has_odometry: bool
    skipped: dict[str, Any]
    """How many lines or messages were broken, and which."""
    duration_s: float
    path_length_m: float
    relations: dict[str, Any] | None
    """The score against --relations."""
    localized: dict[str, Any] | None
    """With --localize-in: the share of scans after which it was known where the robot is, and whether it
    is lost at the end."""
    scan_ms: dict[str, float]
    """Wall time of an update of the localizer, loop closure included: p50, mean, p99, max."""
    wall_time_by_stage_s: dict[str, float]
    real_time_factor: float
    """The log's duration over the wall time of all updates and of settling at the end."""
    peak_memory_mb: float
    map_sha256: str
    versions: dict[str, str]


def summarise(
    replayed: Replayed, relations: Relations | None, whereabouts: Whereabouts | None, command: Command
) -> tuple[ReplaySummary, RelationsScore | None]:
    """The summary, and the score in it."""
    score = None if relations is None else score_relations(replayed.laser, relations)
    stopwatch, skipped = replayed.stopwatch, replayed.log.skipped
    times_s = replayed.robot.times_s
    duration_s = float(times_s[-1] - times_s[0])
    summary = ReplaySummary(
        log=command.log.name,
        config=to_plain(command.replay),
        status="complete" if len(times_s) == len(replayed.log.observations) else "interrupted",
        scans=len(times_s),
        has_odometry=replayed.log.has_odometry,
        skipped={"count": len(skipped), "first": [asdict(one) for one in skipped[:REPORTED_SKIPPED]]},
        duration_s=duration_s,
        path_length_m=replayed.path_length_m,
        relations=None if score is None else asdict(score),
        localized=None if whereabouts is None else whereabouts.facts(),
        scan_ms=quantiles_ms(stopwatch),
        wall_time_by_stage_s=stopwatch.totals_s(),
        real_time_factor=duration_s / (stopwatch.total_s("localization") + stopwatch.total_s("settling")),
        peak_memory_mb=peak_memory_mb(),
        map_sha256=map_sha256(replayed.grid),
        versions=versions(),
    )
    return summary, score


def quantiles_ms(stopwatch: Stopwatch) -> dict[str, float]:
    """How long the localizer's updates took."""
    laps_ms = 1e3 * np.array(stopwatch.laps_s["localization"])
    p50, p99 = np.percentile(laps_ms, (50, 99))
    return {"p50": float(p50), "mean": float(laps_ms.mean()), "p99": float(p99), "max": float(laps_ms.max())}


def write_results(replayed: Replayed, summary: ReplaySummary, folder: RunFolder) -> None:
    """The summary comes last, and tells that all is there."""
    write_belief(replayed.grid, Pose2.identity(), folder / "map")
    write_tum(folder / "trajectory.tum", replayed.robot)
    write_tum(folder / "laser.tum", replayed.laser)
    (folder / SUMMARY).write_text(json.dumps(finite(asdict(summary)), indent=2, allow_nan=False) + "\n")
