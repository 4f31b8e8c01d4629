"""A small picture of what a run made of its building, kept for each run: some kilobytes."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from experiments.recorders import palette
from occmap.grid import Belief

if TYPE_CHECKING:
    from experiments.run import Run

SIDE_PX = 360
"""The longer side is at most this long."""
MARGIN_CELLS = 4
"""Left around what can be explored, for its walls."""
MISSED, TRAIL = 3, 4
COLOURS = (*(tuple(int(v) for v in rgb) for rgb in palette.BELIEF), palette.GOAL, palette.TRAIL)
"""Of unknown, free and occupied, of what could have been explored and was not, and of the way driven."""


def map_picture(run: Run) -> bytes:
    """A PNG of the building from above, in `world`: the belief, what was missed, the way driven."""
    from PIL import Image, ImageDraw

    scorer = run.experiment.scorer
    classes = scorer.belief(run.last.grid)
    classes[scorer.unexplored(run.last.grid)] = MISSED
    box, step = _seen_box(scorer.explorable), 1
    step = math.ceil(max(side.stop - side.start for side in box) / SIDE_PX)
    small = reduced(classes[box], step)
    image = Image.fromarray(np.ascontiguousarray(small[::-1]))  # row 0 of a picture is its top
    cells = scorer.truth.cell_from_world(run.trajectory.true[:, :2]) - (box[1].start, box[0].start)
    pixels = np.column_stack((cells[:, 0] // step, small.shape[0] - 1 - cells[:, 1] // step))
    way = pixels[np.r_[True, np.any(np.diff(pixels, axis=0) != 0, axis=1)]]
    if len(way) > 1:
        ImageDraw.Draw(image).line([(int(x), int(y)) for x, y in way], fill=TRAIL)
    image.putpalette([value for colour in COLOURS for value in colour])
    file = io.BytesIO()
    image.save(file, "PNG", optimize=True)
    return file.getvalue()


def reduced(classes: NDArray[np.uint8], step: int) -> NDArray[np.uint8]:
    """Blocks of step x step cells as one each, the highest class of the block: what is thin stays visible."""
    ny, nx = (math.ceil(side / step) * step for side in classes.shape)
    padded = np.full((ny, nx), Belief.UNKNOWN, np.uint8)
    padded[: classes.shape[0], : classes.shape[1]] = classes
    return padded.reshape(ny // step, step, nx // step, step).max(axis=(1, 3))


def _seen_box(explorable: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The rows and columns that hold all explorable cells, and a little more."""
    sides = []
    for axis in (1, 0):
        at = np.flatnonzero(explorable.any(axis=axis))
        sides.append(slice(max(int(at[0]) - MARGIN_CELLS, 0), int(at[-1]) + 1 + MARGIN_CELLS))
    return sides[0], sides[1]
