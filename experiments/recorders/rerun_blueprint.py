"""How a recording is laid out when somebody opens it: map, 3D, curves, state and log side by side."""

from __future__ import annotations

import math

import rerun as rr
import rerun.blueprint as rrb

from experiments.recorders import palette
from sim.building import Building

TIMELINE = "sim_time"

FIELD_OF_VIEW_RAD = math.radians(55.0)  # of the viewer's camera, vertical
MAP_VIEW_ASPECT = 1.38  # width to height of the map's share of a 16:9 window
MARGIN = 1.06


def blueprint(building: Building) -> rrb.Blueprint:
    """The whole window."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(map_view(building), state_view(), row_shares=[6, 1]),
            rrb.Vertical(space_view(building), curve_views(), log_view(), row_shares=[4, 3, 2]),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, playback_speed=10.0),
        collapse_panels=True,
    )


def looking_down(x_m: float, y_m: float, height_m: float) -> rrb.EyeControls3D:
    """On a place from above, y upwards. Straight down has no up: a hair of tilt gives it one."""
    return rrb.EyeControls3D(
        position=(x_m, y_m, height_m), look_target=(x_m, y_m + 0.01, 0.0), eye_up=(0.0, 1.0, 0.0)
    )


def map_view(building: Building) -> rrb.Spatial3DView:
    """What the robot believes, seen from above; a Spatial2DView cannot show a GridMap (rerun 0.41)."""
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    x_m, y_m = (x0 + x1) / 2.0, (y0 + y1) / 2.0
    tall_m = MARGIN * max(y1 - y0, (x1 - x0) / MAP_VIEW_ASPECT)
    height_m = tall_m / (2.0 * math.tan(FIELD_OF_VIEW_RAD / 2.0))
    return rrb.Spatial3DView(
        name="Belief: white free, black wall, grey unknown, magenta where it wants to look",
        origin="/world",
        contents=["+ $origin/**", "- $origin/building/**"],
        background=palette.UNKNOWN,
        line_grid=False,
        eye_controls=looking_down(x_m, y_m, height_m),
        overrides={**trails(), "/world/truth": [rrb.EntityBehavior(visible=False)]},
    )


def space_view(building: Building) -> rrb.Spatial3DView:
    """The building as it is, with the robot and its map in it."""
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    x_m, y_m, span_m = (x0 + x1) / 2.0, (y0 + y1) / 2.0, max(x1 - x0, y1 - y0)
    return rrb.Spatial3DView(
        name="The building as it is",
        origin="/world",
        contents=["+ $origin/**", "- $origin/map/frontiers", "- $origin/map/beams/no_return"],
        background=palette.UNKNOWN,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            position=(x_m, y_m - 0.55 * span_m, 0.65 * span_m),
            look_target=(x_m, y_m - 0.05 * span_m, 0.0),
            eye_up=(0.0, 0.0, 1.0),
        ),
        overrides={**trails(), "/world/truth": [rrb.EntityBehavior(visible=False)]},
    )


def trails() -> dict[str, list[rrb.VisibleTimeRanges]]:
    """A trail is a segment a step, all of them up to the cursor in sight."""
    past = rrb.VisibleTimeRanges(
        timeline=TIMELINE,
        start=rrb.TimeRangeBoundary.infinite(),
        end=rrb.TimeRangeBoundary.cursor_relative(),
    )
    return {"/world/map/trail": [past], "/world/true_trail": [past]}


def curve_views() -> rrb.Grid:
    """One small plot a quantity: they share no unit."""
    return rrb.Grid(
        curve_view("explored, %", "explored", rrb.ScalarAxis(range=(0.0, 104.0))),
        curve_view("driven, m", "path_length"),
        curve_view("pose error, m", "pose_error"),
        curve_view("wrong cells", "wrong_cells"),
        grid_columns=2,
    )


def curve_view(name: str, entity: str, axis_y: rrb.ScalarAxis | None = None) -> rrb.TimeSeriesView:
    """One of the curves over the whole run."""
    return rrb.TimeSeriesView(
        name=name,
        origin=f"/curves/{entity}",
        axis_x=whole_run(),
        axis_y=axis_y,
        plot_legend=rrb.PlotLegend(visible=False),
    )


def whole_run() -> rrb.TimeAxis:
    """Without it a plot shows half a minute around the cursor."""
    ends = rrb.TimeRangeBoundary.infinite()
    return rrb.TimeAxis(view_range=rr.TimeRange(start=ends, end=ends))


def state_view() -> rrb.StateTimelineView:
    """The robot's activity as a band over the whole run."""
    return rrb.StateTimelineView(name="What it is doing", origin="/activity", time_view=whole_run())


def log_view() -> rrb.TextLogView:
    """The explorer's events in words, and what it left unseen."""
    return rrb.TextLogView(
        name="What it decided",
        origin="/decisions",
        columns=rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["body"]),
    )
