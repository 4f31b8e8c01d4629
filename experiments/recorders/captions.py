"""Words on pictures."""

from __future__ import annotations

from functools import lru_cache

from PIL import Image, ImageDraw, ImageFont

from experiments.recorders import palette
from experiments.recorders.snapshots import Snapshot

PAPER: palette.Rgb = (250, 250, 248)

LEGEND: tuple[tuple[str, palette.Rgb], ...] = (
    ("unknown", palette.UNKNOWN),
    ("free", palette.FREE),
    ("wall", palette.OCCUPIED),
    ("frontier", palette.FRONTIERS[0]),
    ("chosen frontier", palette.GOAL),
    ("path", palette.PATH),
    ("robot and trail", palette.ROBOT),
)
LEGEND_PX = 15
"""Of its letters."""


@lru_cache
def font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The font inside Pillow: looks the same on every machine."""
    return ImageFont.load_default(size_px)


def write(
    picture: Image.Image,
    xy: tuple[float, float],
    text: str,
    size_px: int = 18,
    anchor: str = "lm",
    colour: palette.Rgb = palette.INK,
) -> None:
    """Text at a place; the anchor is Pillow's: left, middle or right, then top, middle or baseline."""
    ImageDraw.Draw(picture).text(xy, text, fill=colour, font=font(size_px), anchor=anchor)


def clock(time_s: float) -> str:
    """65.2 s as 1:05."""
    minutes, seconds = divmod(int(time_s), 60)
    return f"{minutes}:{seconds:02d}"


def progress(snapshot: Snapshot) -> str:
    """Where a run stands, in a few words."""
    explored = "" if snapshot.explored is None else f"{100.0 * snapshot.explored:.1f} % explored   "
    return f"{clock(snapshot.time_s)}   {explored}{snapshot.path_length_m:.0f} m driven"


def draw_legend(picture: Image.Image, left_px: float, middle_px: float) -> None:
    """Coloured squares with their names, from left to right."""
    draw = ImageDraw.Draw(picture)
    for name, colour in LEGEND:
        half = LEGEND_PX * 0.45
        box = (left_px, middle_px - half, left_px + 2 * half, middle_px + half)
        draw.rectangle(box, fill=colour, outline=palette.INK)
        write(picture, (left_px + LEGEND_PX * 1.3, middle_px), name, LEGEND_PX)
        left_px += LEGEND_PX * 2.6 + draw.textlength(name, font=font(LEGEND_PX))
