"""exploration.mp4: the map growing on the left, the robot in its building on the right, in half a minute.

While the episode runs only snapshots are kept; the pictures are made when it has ended.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from experiments.recorders import palette
from experiments.recorders.camera import OpenCamera, rendering_camera
from experiments.recorders.captions import PAPER, draw_legend, progress, write
from experiments.recorders.setting import Setting
from experiments.recorders.snapshots import Snapshot, SnapshotLog
from experiments.recorders.top_view import TopView, draw_snapshot

if TYPE_CHECKING:
    from experiments.curves import ScoreCurve
    from experiments.episode import Step

Rgb8 = NDArray[np.uint8]
"""(h, w, 3) a picture, row 0 at the top."""

GAP_PX, HEADER_PX, FOOTER_PX = 8, 84, 40


@dataclass(frozen=True)
class VideoConfig:
    """How long and how large the film is."""

    width_px: int = 1280
    """Of the film; its height follows the building's shape."""
    frames_per_s: int = 15
    """Enough for a time-lapse."""
    snapshots: int = 300
    """At most this many pictures are drawn, whatever the length of the run."""
    shortest_s: float = 20.0
    """A film of fewer pictures shows each of them for longer."""
    pause_s: float = 2.0
    """How long the finished map stays on the screen."""

    def __post_init__(self) -> None:
        if self.width_px < 640 or self.width_px % 2:
            raise ValueError(f"width_px must be even and at least 640, got {self.width_px}")
        if self.frames_per_s < 1 or self.snapshots < 2:
            raise ValueError(
                f"need a frame a second and 2 snapshots, got {self.frames_per_s} and {self.snapshots}"
            )


class VideoRecorder:
    """Films an episode as a time-lapse."""

    def __init__(
        self,
        path: Path,
        setting: Setting,
        curve: ScoreCurve,
        config: VideoConfig | None = None,
        open_camera: OpenCamera = rendering_camera,
    ) -> None:
        self.config = config or VideoConfig()
        self._path = path
        self._setting = setting
        self._log = SnapshotLog(setting.world_from_map, curve, self.config.snapshots)
        self._open_camera = open_camera

    def record(self, step: Step) -> None:
        """Keep a snapshot now and then."""
        self._log.record(step)

    def close(self) -> None:
        """Draw and encode, unless the run ended before its first scan."""
        self._log.finish()
        if self._log.snapshots:
            write_video(self._path, self._frames(), self.config.frames_per_s)

    def _frames(self) -> Iterator[Rgb8]:
        """Every picture of the film, the repeated ones too."""
        panel_px = self._panel_px()
        view = TopView(self._setting.building, panel_px)
        page = blank_page(panel_px)
        fps, shots = self.config.frames_per_s, self._log.snapshots
        repeats = max(1, math.ceil(self.config.shortest_s * fps / len(shots)))
        with self._open_camera(self._setting, panel_px) as camera:
            for shot in shots:
                trail = self._log.trail(shot)
                belief = draw_snapshot(view, shot, trail, self._setting.world_from_map)
                frame = np.asarray(compose(page, belief, camera(shot), shot))
                for _ in range(repeats + (round(self.config.pause_s * fps) if shot is shots[-1] else 0)):
                    yield frame

    def _panel_px(self) -> tuple[int, int]:
        """Size of one of the two panels: as tall as the building asks for, within reason, and even."""
        building, width = self._setting.building, (self.config.width_px - 3 * GAP_PX) // 2
        span_x, span_y = np.subtract(building.high_m, building.low_m)
        height = float(np.clip(width * span_y / span_x, 0.6 * width, width))
        return width // 2 * 2, round(height) // 2 * 2


def blank_page(panel_px: tuple[int, int]) -> Image.Image:
    """What is the same in every frame: titles above the two panels, a legend below."""
    width, height = panel_px
    page = Image.new("RGB", (2 * width + 3 * GAP_PX, HEADER_PX + height + FOOTER_PX), PAPER)
    write(page, (GAP_PX + 2, HEADER_PX - 16), "what the robot believes", 16)
    write(page, (width + 2 * GAP_PX + 2, HEADER_PX - 16), "the building as it is", 16)
    draw_legend(page, GAP_PX + 2, HEADER_PX + height + FOOTER_PX / 2)
    return page


def compose(page: Image.Image, belief: Image.Image, world: Image.Image, shot: Snapshot) -> Image.Image:
    """One frame: both panels, where the run stands and what the robot is doing."""
    frame = page.copy()
    frame.paste(belief, (GAP_PX, HEADER_PX))
    frame.paste(world, (belief.width + 2 * GAP_PX, HEADER_PX))
    write(frame, (GAP_PX + 2, 24), progress(shot), 24)
    draw_activity(frame, shot.activity)
    return frame


def draw_activity(frame: Image.Image, activity: str) -> None:
    """A coloured badge, upper right."""
    word, right = activity.replace("_", " "), frame.width - GAP_PX
    box = (right - 150, 8, right, 40)
    colour = palette.ACTIVITIES.get(activity, palette.OTHER_SOLID)
    draw = ImageDraw.Draw(frame)
    draw.rounded_rectangle(box, 8, fill=colour)
    write(frame, ((box[0] + box[2]) / 2, 24), word, 18, anchor="mm", colour=palette.FREE)


def write_video(path: Path, frames: Iterator[Rgb8], frames_per_s: int) -> None:
    """H.264 in yuv420p, which every player and browser shows; sides must be even."""
    from imageio_ffmpeg import write_frames

    first = next(frames)
    height, width = first.shape[:2]
    film = write_frames(
        str(path),
        (width, height),
        fps=frames_per_s,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        quality=6,
        output_params=["-preset", "veryfast", "-movflags", "+faststart"],
    )
    film.send(None)
    film.send(first)
    for frame in frames:
        film.send(frame)
    film.close()
