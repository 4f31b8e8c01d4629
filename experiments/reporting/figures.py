"""The report's pictures."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from experiments.reporting.coverage import STEPS, Bundle, Over
from experiments.sweeping.groups import Group

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#666666")
"""Told apart also by those who do not see all colours (Okabe and Ito, Color Universal Design, 2008)."""
DPI = 130
LEAST_LEFT = 0.05
"""Per cent: what is still unexplored is drawn down to this."""


def coverage_figure(by_kind: Mapping[str, Sequence[Bundle]]) -> Figure:
    """A row per kind: explored over metres and over seconds, and what is left over metres, magnified."""
    figure = _figure(11.0, 0.7 + 2.5 * len(by_kind))
    panels = figure.subplots(len(by_kind), 3, squeeze=False)
    colours = _colours([bundle.series for bundles in by_kind.values() for bundle in bundles])
    for row, (kind, bundles) in zip(panels, by_kind.items(), strict=True):
        for bundle in bundles:
            _explored(row[0], bundle, "metres", colours[bundle.series])
            _explored(row[1], bundle, "seconds", colours[bundle.series])
            _left(row[2], bundle, colours[bundle.series])
        for axes, over in zip(row, ("metres", "seconds", "metres"), strict=True):
            axes.set_xlim(0.0, 1.02 * max(bundle.reach(over) for bundle in bundles))
            axes.grid(alpha=0.25)
            axes.spines[["top", "right"]].set_visible(False)
        row[0].set_ylabel(f"{kind}\nexplored (%)")
        row[2].set_ylabel("unexplored (%)")
    titles = ("over metres", "over seconds", "what is left, magnified")
    labels = ("metres driven", "simulated seconds", "metres driven")
    for top, bottom, title, label in zip(panels[0], panels[-1], titles, labels, strict=True):
        top.set_title(title)
        bottom.set_xlabel(label)
    _legend(figure, colours)
    return figure


def _explored(axes: Axes, bundle: Bundle, over: Over, colour: str) -> None:
    at = np.linspace(0.0, bundle.reach(over), STEPS)
    low, median, high = 100.0 * bundle.quartiles(over, at)
    axes.fill_between(at, low, high, color=colour, alpha=0.18, linewidth=0.0)
    axes.plot(at, median, color=colour, linewidth=1.8, label=bundle.series)
    axes.axvline(bundle.end(over), color=colour, linewidth=1.0, linestyle=":")
    axes.set_ylim(0.0, 103.0)


def _left(axes: Axes, bundle: Bundle, colour: str) -> None:
    at = np.linspace(0.0, bundle.reach("metres"), STEPS)
    left = np.clip(100.0 * (1.0 - bundle.quartiles("metres", at)), LEAST_LEFT, None)
    axes.fill_between(at, left[2], left[0], color=colour, alpha=0.18, linewidth=0.0)
    axes.semilogy(at, left[1], color=colour, linewidth=1.8)
    axes.axvline(bundle.end("metres"), color=colour, linewidth=1.0, linestyle=":")
    axes.set_ylim(LEAST_LEFT, 100.0)
    axes.set_yticks([0.1, 1.0, 10.0, 100.0], ["0.1", "1", "10", "100"])


def metres_figure(groups: Sequence[Group]) -> Figure:
    """Metres of every run, a panel per kind, in it a strip per series."""
    kinds = {kind: [g for g in groups if g.kind == kind] for kind in dict.fromkeys(g.kind for g in groups)}
    lines = max(len(members) for members in kinds.values())
    columns = min(len(kinds), 3)
    rows = -(-len(kinds) // columns)
    figure = _figure(11.0, 0.4 + rows * (0.9 + 0.3 * lines))
    panels = figure.subplots(rows, columns, squeeze=False)
    colours = _colours([group.series for group in groups])
    rng = np.random.default_rng(0)  # only to lay dots side by side
    for axes, (kind, members) in zip(panels.flat, kinds.items(), strict=False):
        for place, group in enumerate(members):
            _strip(axes, group["metres"], place, colours[group.series], rng)
        axes.set(title=kind, xlabel="metres driven", ylim=(len(members) - 0.4, -0.6))
        axes.set_yticks([])
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", alpha=0.25)
        axes.spines[["top", "right", "left"]].set_visible(False)
    for axes in list(panels.flat)[len(kinds) :]:
        axes.set_visible(False)
    _legend(figure, colours)
    return figure


def _strip(
    axes: Axes, values: NDArray[np.float64], place: int, colour: str, rng: np.random.Generator
) -> None:
    """One dot a value, the middle half as a bar, the median as an upright."""
    if not len(values):
        return
    low, median, high = np.percentile(values, (25, 50, 75))
    axes.plot([low, high], [place, place], color=colour, linewidth=6, alpha=0.3, solid_capstyle="butt")
    axes.plot(median, place, "|", color=colour, markersize=17, markeredgewidth=2.5)
    spread = place + rng.uniform(-0.25, 0.25, len(values))
    axes.plot(values, spread, ".", color=colour, alpha=0.6, markersize=5, markeredgewidth=0)


def png(figure: Figure) -> bytes:
    """The figure as a file's contents."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()


def _figure(width_in: float, height_in: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    figure = Figure(
        figsize=(width_in, height_in), dpi=DPI, layout=ConstrainedLayoutEngine(wspace=0.05, hspace=0.04)
    )
    FigureCanvasAgg(figure)
    return figure


def _colours(series: Sequence[str]) -> dict[str, str]:
    names = sorted(set(series))
    return {name: COLOURS[number % len(COLOURS)] for number, name in enumerate(names)}


def _legend(figure: Figure, colours: Mapping[str, str]) -> None:
    from matplotlib.lines import Line2D

    if len(colours) > 1:
        lines = [Line2D([], [], color=colour, linewidth=2.5) for colour in colours.values()]
        figure.legend(
            lines, list(colours), loc="outside upper center", ncols=min(len(lines), 4), frameon=False
        )
