"""THE see-think-act loop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from occmap.decision import Status
from occmap.stopwatch import Stopwatch

if TYPE_CHECKING:
    from occmap.decision import Decision
    from occmap.explorer import Explorer
    from occmap.grid import OccupancyGrid
    from occmap.scan import Observation
    from sim.robot import Robot, Truth


@dataclass(frozen=True)
class Step:
    """One scan's worth of an episode: what was true, what was seen and what was decided, at one instant."""

    truth: Truth
    observation: Observation
    decision: Decision
    grid: OccupancyGrid
    """The explorer's live map, to look at: copy what must outlive the step."""


def episode(
    robot: Robot, explorer: Explorer, limit_s: float, stopwatch: Stopwatch | None = None
) -> Iterator[Step]:
    """Yield a Step per scan until the explorer is done or limit_s of simulated time has passed.

    The stopwatch receives the wall time of every stage; what the consumer does with a step is its own.
    """
    watch = stopwatch or Stopwatch()
    while robot.time_s < limit_s:
        with watch.lap("lidar"):
            seen = robot.sense()
        with watch.lap("decision"):
            decision = explorer.decide(seen)
        watch.add(decision.stage_s)
        with watch.lap("truth"):
            truth = robot.truth()
        yield Step(truth, seen, decision, explorer.grid)
        if decision.status is not Status.EXPLORING:
            return
        with watch.lap("physics"):
            robot.act(decision.twist)
