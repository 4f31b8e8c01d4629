"""oracle.png: the way that was driven and the one that would have done."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from experiments.recorders import palette
from experiments.recorders.coverage_plot import plot_colour

if TYPE_CHECKING:
    from experiments.oracle.run_files import FinishedRun
    from experiments.oracle.tour import Oracle

WIDTH_IN = 10.0


def draw_ways(run: FinishedRun, oracle: Oracle, driven_m: float, path: Path) -> None:
    """Walls black, what cannot be seen grey; from the green dot to the red one."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    truth = run.truth
    ny, nx = truth.wall.shape
    (x0, y0), r = truth.origin_m, truth.resolution_m
    figure = Figure(figsize=(WIDTH_IN, WIDTH_IN * ny / nx + 0.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    shades = np.where(truth.wall, 0, np.where(run.explorable, 255, 190)).astype(np.uint8)
    extent = (x0, x0 + nx * r, y0, y0 + ny * r)
    axes.imshow(shades, cmap="gray", vmin=0, vmax=255, origin="lower", extent=extent)
    axes.plot(
        *run.trail.T, color=plot_colour(palette.TRAIL), linewidth=0.8, label=f"driven, {driven_m:.0f} m"
    )
    label = f"knowing the building, {oracle.length_m:.0f} m"
    axes.plot(*oracle.path.T, color=plot_colour(palette.PATH), linewidth=2.0, label=label)
    for place, colour in ((oracle.path[0], palette.TRUE_ROBOT), (oracle.path[-1], palette.HIT)):
        axes.plot(*place, "o", color=plot_colour(colour), markersize=7)
    axes.set_axis_off()
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    figure.savefig(path)
