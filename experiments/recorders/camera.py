"""Pictures of the true world for the film: rendered by MuJoCo where that is possible, drawn where not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from PIL import Image

from experiments.recorders import palette
from experiments.recorders.snapshots import Snapshot
from experiments.recorders.top_view import TopView
from sim.building import Building

Camera = Callable[[Snapshot], Image.Image]
"""Takes a picture of the world at one instant."""

OpenCamera = Callable[[Building, tuple[int, int]], AbstractContextManager[Camera]]
"""Sets a camera up over a building, for pictures of one size (width, height)."""


@contextmanager
def rendering_camera(building: Building, size_px: tuple[int, int]) -> Iterator[Camera]:
    """MuJoCo's view from above; the drawn one where there is no graphics library."""
    from sim.render import open_studio
    from sim.scene import building_scene

    model = building_scene(building).compile()
    model.vis.quality.shadowsize = model.vis.quality.offsamples = 0  # a film costs a quarter without
    studio = open_studio(model, building, size_px)
    if studio is None:
        with drawing_camera(building, size_px) as camera:
            yield camera
        return
    with studio:
        yield lambda shot: Image.fromarray(studio.overview(shot.world_from_robot))


@contextmanager
def drawing_camera(building: Building, size_px: tuple[int, int]) -> Iterator[Camera]:
    """The floor plan with the true robot on it."""
    view = TopView(building, size_px)
    floor = view.blank()
    view.draw_building(floor, building)

    def shoot(shot: Snapshot) -> Image.Image:
        fine = floor.copy()
        view.draw_robot(fine, shot.world_from_robot, palette.ROBOT)
        return view.finished(fine)

    yield shoot
