"""coverage.png: how much was explored, how far the robot drove for it and how good the map was."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from experiments.curves import MILESTONES, milestone
from experiments.recorders import palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from experiments.curves import Sample, ScoreCurve
    from experiments.episode import Step

HEADROOM = 1.15
"""Of a panel's height, for the legend above its curves."""


class CoveragePlot:
    """Draws the run's curves when it has ended."""

    def __init__(self, path: Path, curve: ScoreCurve, title: str = "") -> None:
        self._path = path
        self._curve = curve
        self._title = title

    def record(self, step: Step) -> None:
        """Nothing to keep: the curve keeps the samples."""

    def close(self) -> None:
        """Draw, unless the run ended before its first scan."""
        if self._curve.samples:
            draw_coverage(self._curve.samples, self._path, self._title)


def draw_coverage(samples: Sequence[Sample], path: Path, title: str = "") -> None:
    """Four small panels over simulated time, the milestones marked in the first two."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 6.0), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True)
    for panel, draw in zip(
        panels.flat, (draw_explored, draw_driven, draw_wrong, draw_distances), strict=True
    ):
        draw(panel, samples)
        panel.grid(alpha=0.25)
        panel.spines[["top", "right"]].set_visible(False)
        panel.set_xlim(0.0, max(samples[-1].time_s, 1.0))
    for panel in panels[1]:
        panel.set_xlabel("simulated time (s)")
    if title:
        figure.suptitle(title)
    figure.savefig(path)


def draw_explored(axes: Axes, samples: Sequence[Sample]) -> None:
    """Explored, with a mark where each milestone was first reached."""
    line(axes, samples, lambda s: 100.0 * s.score.explored, palette.ROBOT)
    axes.set(title="explored", ylabel="explorable area (%)", ylim=(0.0, 105.0))
    marks = reached(samples)
    for percent, at in marks:
        mark(axes, at["seconds"], percent)
    notes = [f"{percent} % after {at['seconds']:.0f} s and {at['metres']:.0f} m" for percent, at in marks]
    paper = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    place = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
    axes.text(0.97, 0.06, "\n".join(notes), fontsize=9, bbox=paper, **place)


def draw_driven(axes: Axes, samples: Sequence[Sample]) -> None:
    """The way driven, with the same marks."""
    line(axes, samples, lambda s: s.path_length_m, palette.PATH)
    axes.set(title="driven", ylabel="path length (m)")
    axes.set_ylim(bottom=0.0)
    for _, at in reached(samples):
        mark(axes, at["seconds"], at["metres"])


def draw_wrong(axes: Axes, samples: Sequence[Sample]) -> None:
    """Cells believed the opposite of the truth."""
    line(axes, samples, lambda s: 100.0 * s.score.wrong, palette.HIT)
    axes.set(title="wrong cells", ylabel="of the explorable area (%)")
    axes.set_ylim(bottom=0.0)


def draw_distances(axes: Axes, samples: Sequence[Sample]) -> None:
    """How far believed walls are from true ones, and the estimated robot from the true one."""
    line(axes, samples, lambda s: 100.0 * s.score.wall_error_mean_m, palette.INK, "walls, mean")
    line(
        axes,
        samples,
        lambda s: 100.0 * s.score.wall_error_p95_m,
        palette.FRONTIERS[1],
        "walls, 95th percentile",
    )
    line(axes, samples, lambda s: 100.0 * s.position_error_m, palette.GOAL, "robot")
    axes.set(title="position error", ylabel="distance (cm)")
    axes.set_ylim(0.0, HEADROOM * axes.get_ylim()[1])
    axes.legend(frameon=False, fontsize=9, loc="upper center", ncols=3)


def line(
    axes: Axes,
    samples: Sequence[Sample],
    value: Callable[[Sample], float],
    colour: palette.Rgb,
    label: str = "",
) -> None:
    """One figure of each sample over simulated time."""
    times_s = [s.time_s for s in samples]
    axes.plot(times_s, [value(s) for s in samples], color=plot_colour(colour), label=label, linewidth=1.8)


def mark(axes: Axes, time_s: float, value: float) -> None:
    """A dot and a thin upright."""
    axes.plot(time_s, value, "o", color=plot_colour(palette.GOAL), markersize=4)
    axes.axvline(time_s, color=plot_colour(palette.GOAL), alpha=0.25, linewidth=1.0)


def reached(samples: Sequence[Sample]) -> list[tuple[int, dict[str, float]]]:
    """Each milestone that was reached, in percent, with the seconds and metres to it as in summary.json."""
    found = ((percent, milestone(samples, percent / 100.0)) for percent in MILESTONES)
    return [(percent, at) for percent, at in found if at is not None]


def plot_colour(rgb: palette.Rgb) -> tuple[float, float, float]:
    """As matplotlib takes it, from 0 to 1."""
    return rgb[0] / 255.0, rgb[1] / 255.0, rgb[2] / 255.0
