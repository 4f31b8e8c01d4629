"""Pictures of a floor from above: `world` in metres, y up, drawn twice as large and averaged down."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw

from experiments.recorders import palette
from occmap.geometry import Points, Pose2
from sim.building import Box, Building, Solid
from sim.starts import BODY_RADIUS_M

if TYPE_CHECKING:
    from experiments.recorders.snapshots import PackedBelief, Snapshot

OVERSAMPLING = 2
"""Pillow draws without anti-aliasing; averaging this many pixels a side does it."""

MARGIN_SHARE = 0.03
"""Of a building's width or height, left free at either side of it."""

INDEX_OF_BELIEF = palette.BELIEF.ravel().tolist()


class TopView:
    """Where metres fall on a picture of `size_px` (width, height) that shows a whole building."""

    def __init__(self, building: Building, size_px: tuple[int, int]) -> None:
        self.size_px = size_px
        self._fine_px = (size_px[0] * OVERSAMPLING, size_px[1] * OVERSAMPLING)
        span_m = np.subtract(building.high_m, building.low_m) * (1.0 + 2.0 * MARGIN_SHARE)
        self._px_per_m = float(np.min(self._fine_px / span_m))
        self._centre_m = np.add(building.low_m, building.high_m) / 2.0
        self._lattice: tuple[Pose2, float, np.ndarray, np.ndarray] | None = None

    def pixels(self, points: Points) -> list[tuple[float, float]]:
        """(n, 2) points of the world as pixels of the fine picture, whose rows run downwards."""
        x = (points[:, 0] - self._centre_m[0]) * self._px_per_m + self._fine_px[0] / 2.0
        y = (self._centre_m[1] - points[:, 1]) * self._px_per_m + self._fine_px[1] / 2.0
        return list(zip(x.tolist(), y.tolist(), strict=True))

    def blank(self) -> Image.Image:
        """A fine picture of the unknown."""
        return Image.new("RGB", self._fine_px, palette.UNKNOWN)

    def finished(self, fine: Image.Image) -> Image.Image:
        """The picture at its final size."""
        return fine.reduce(OVERSAMPLING)

    def belief(self, belief: PackedBelief, world_from_map: Pose2) -> Image.Image:
        """A fine picture of a belief: each pixel shows the cell that its centre lies in."""
        lattice_x, lattice_y = self._cells_of_pixels(world_from_map, belief.resolution_m)
        ny, nx = belief.shape
        framed = np.pad(belief.state(), 1)  # a rim of the unknown, to which all that lies outside is clipped
        ix = np.clip(lattice_x - (belief.offset[0] - 1), 0, nx + 1)
        iy = np.clip(lattice_y - (belief.offset[1] - 1), 0, ny + 1)
        picture = Image.fromarray(framed.ravel().take(iy * (nx + 2) + ix))
        picture.putpalette(INDEX_OF_BELIEF)
        return picture.convert("RGB")

    def _cells_of_pixels(self, world_from_map: Pose2, resolution_m: float) -> tuple[np.ndarray, np.ndarray]:
        """(h, w) lattice index (ix, iy) of the cell under each fine pixel; worked out once."""
        if self._lattice is None or self._lattice[:2] != (world_from_map, resolution_m):
            columns, rows = np.meshgrid(np.arange(self._fine_px[0]), np.arange(self._fine_px[1]))
            x = (columns + 0.5 - self._fine_px[0] / 2.0) / self._px_per_m + self._centre_m[0]
            y = (self._fine_px[1] / 2.0 - rows - 0.5) / self._px_per_m + self._centre_m[1]
            in_map = world_from_map.inverse().apply(np.column_stack((x.ravel(), y.ravel())))
            cells = np.floor(in_map / resolution_m).astype(np.int32).reshape(*columns.shape, 2)
            self._lattice = (world_from_map, resolution_m, cells[..., 0].copy(), cells[..., 1].copy())
        return self._lattice[2], self._lattice[3]

    def draw_building(self, fine: Image.Image, building: Building) -> None:
        """The floor and all solids on it."""
        (x0, y1), (x1, y0) = self.pixels(np.array([building.low_m, building.high_m]))
        ImageDraw.Draw(fine).rectangle((x0, y0, x1, y1), fill=palette.FLOOR)
        for solid in building.solids:
            self.draw_solid(fine, solid, palette.SOLIDS.get(solid.kind, palette.OTHER_SOLID))

    def draw_solid(self, fine: Image.Image, solid: Solid, colour: palette.Rgb) -> None:
        """The footprint of one solid, filled."""
        ImageDraw.Draw(fine).polygon(self.pixels(outline(solid)), fill=colour)

    def draw_line(self, fine: Image.Image, points: Points, colour: palette.Rgb, width_px: float) -> None:
        """A line through points (n, 2) of the world, as wide as said in the finished picture."""
        if len(points) > 1:
            width = max(1, round(width_px * OVERSAMPLING))
            ImageDraw.Draw(fine).line(self.pixels(points), fill=colour, width=width, joint="curve")

    def draw_dots(self, fine: Image.Image, points: Points, colour: palette.Rgb, radius_px: float) -> None:
        """A dot at each of (n, 2) points of the world, as large as said in the finished picture."""
        draw, r = ImageDraw.Draw(fine), radius_px * OVERSAMPLING
        for x, y in self.pixels(points):
            draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)

    def draw_robot(self, fine: Image.Image, pose: Pose2, colour: palette.Rgb) -> None:
        """A disc with a nose, never too small to find."""
        r = max(BODY_RADIUS_M * self._px_per_m, 6.0 * OVERSAMPLING)
        x, y = self.pixels(np.array([pose.position]))[0]
        c, s = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
        nose = [(x + 2.2 * r * c, y - 2.2 * r * s), (x - r * s, y - r * c), (x + r * s, y + r * c)]
        draw = ImageDraw.Draw(fine)
        draw.polygon(nose, fill=colour)
        draw.ellipse((x - r, y - r, x + r, y + r), fill=colour, outline=palette.FREE, width=OVERSAMPLING)


def outline(solid: Solid) -> Points:
    """(n, 2) the corners of a solid's footprint."""
    if isinstance(solid, Box):
        corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) * (solid.half_x_m, solid.half_y_m)
        return Pose2(solid.x_m, solid.y_m, solid.yaw_rad).apply(corners)
    turn = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
    ring = np.column_stack((np.cos(turn), np.sin(turn)))
    return ring * solid.radius_m + (solid.x_m, solid.y_m)


def draw_snapshot(view: TopView, snapshot: Snapshot, trail: Points, world_from_map: Pose2) -> Image.Image:
    """What the robot believes and intends, at one instant, at the final size."""
    fine = view.belief(snapshot.belief, world_from_map)
    view.draw_dots(fine, snapshot.frontiers, palette.FRONTIERS[0], 1.3)
    view.draw_dots(fine, snapshot.chosen, palette.GOAL, 1.8)
    view.draw_line(fine, trail, palette.TRAIL, 1.5)
    view.draw_line(fine, snapshot.path, palette.PATH, 2.5)
    view.draw_dots(fine, snapshot.goal, palette.GOAL, 5.0)
    view.draw_robot(fine, snapshot.world_from_estimate, palette.ROBOT)
    return view.finished(fine)
