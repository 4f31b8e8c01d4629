"""growth.png and growth.gif: the map of one run growing, for a README."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from experiments.recorders.captions import PAPER, progress, write
from experiments.recorders.setting import Setting
from experiments.recorders.snapshots import Snapshot, SnapshotLog
from experiments.recorders.top_view import TopView, draw_snapshot

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.episode import Step

GAP_PX, CAPTION_PX = 10, 26
COLUMNS = 3
"""At most so many panels side by side."""


class GrowthPicture:
    """Draws a run as a few panels (a .png) or as an endless loop (a .gif), by the path's suffix."""

    def __init__(
        self,
        path: Path,
        setting: Setting,
        curve: ScoreCurve,
        panels: int = 6,
        panel_width_px: int = 400,
    ) -> None:
        if path.suffix not in (".png", ".gif"):
            raise ValueError(f"a growth picture is a .png or a .gif, got {path}")
        self._path = path
        self._world_from_map = setting.world_from_map
        self._panels = panels
        span_x, span_y = np.subtract(setting.building.high_m, setting.building.low_m)
        self._view = TopView(setting.building, (panel_width_px, round(panel_width_px * span_y / span_x)))
        self._log = SnapshotLog(setting.world_from_map, curve, capacity=100)

    def record(self, step: Step) -> None:
        """Keep a snapshot now and then."""
        self._log.record(step)

    def close(self) -> None:
        """Draw, unless the run ended before its first scan."""
        self._log.finish()
        shots = self._log.snapshots
        if not shots:
            return
        if self._path.suffix == ".png":
            side_by_side([self._panel(shot) for shot in evenly_grown(shots, self._panels)]).save(self._path)
        else:
            first, *others = (self._panel(shot).quantize(64) for shot in shots)
            durations_ms = [100] * len(others) + [3000]
            first.save(self._path, save_all=True, append_images=others, duration=durations_ms, loop=0)

    def _panel(self, shot: Snapshot) -> Image.Image:
        trail = self._log.trail(shot)
        picture = draw_snapshot(self._view, shot, trail, self._world_from_map)
        panel = Image.new("RGB", (picture.width, picture.height + CAPTION_PX), PAPER)
        panel.paste(picture, (0, CAPTION_PX))
        write(panel, (2, CAPTION_PX / 2), progress(shot), 15)
        return panel


def evenly_grown(shots: Sequence[Snapshot], count: int) -> list[Snapshot]:
    """The first, the last, and those between at which the known area had grown by equal steps.

    Fewer than `count` where one look revealed more than a step.
    """
    known = np.maximum.accumulate([shot.belief.known_cells for shot in shots])
    steps = np.linspace(known[0], known[-1], count)[1:-1]
    between = {int(np.searchsorted(known, step)) for step in steps}
    return [shots[k] for k in sorted({0, *between, len(shots) - 1})]


def side_by_side(panels: Sequence[Image.Image]) -> Image.Image:
    """Panels of one size in rows."""
    width, height = panels[0].width + GAP_PX, panels[0].height + GAP_PX
    rows = -(-len(panels) // COLUMNS)
    sheet = Image.new("RGB", (min(COLUMNS, len(panels)) * width + GAP_PX, rows * height + GAP_PX), PAPER)
    for k, panel in enumerate(panels):
        sheet.paste(panel, (GAP_PX + k % COLUMNS * width, GAP_PX + k // COLUMNS * height))
    return sheet
