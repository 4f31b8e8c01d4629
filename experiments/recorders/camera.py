"""Pictures of the true world for the film: rendered by MuJoCo where that is possible, drawn where not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from PIL import Image

from experiments.recorders import palette
from experiments.recorders.setting import Setting
from experiments.recorders.snapshots import Snapshot
from experiments.recorders.top_view import TopView

Camera = Callable[[Snapshot], Image.Image]
"""Takes a picture of the world at one instant."""

OpenCamera = Callable[[Setting, tuple[int, int]], AbstractContextManager[Camera]]
"""Sets a camera up over a run's building, for pictures of one size (width, height)."""


@contextmanager
def rendering_camera(setting: Setting, size_px: tuple[int, int]) -> Iterator[Camera]:
    """MuJoCo's view from above; the drawn one where there is no graphics library."""
    from sim.render import open_studio
    from sim.scene import building_scene

    model = building_scene(setting.building, setting.closing).compile()
    model.vis.quality.shadowsize = model.vis.quality.offsamples = 0  # a film costs a quarter without
    studio = open_studio(model, setting.building, size_px)
    if studio is None:
        with drawing_camera(setting, size_px) as camera:
            yield camera
        return
    with studio:
        yield lambda shot: Image.fromarray(studio.overview(shot.world_from_robot, shot.door_heights_m))


@contextmanager
def drawing_camera(setting: Setting, size_px: tuple[int, int]) -> Iterator[Camera]:
    """The floor plan with closed doors and the true robot on it."""
    view = TopView(setting.building, size_px)
    floor = view.blank()
    view.draw_building(floor, setting.building)

    def shoot(shot: Snapshot) -> Image.Image:
        fine = floor.copy()
        for panel, _ in setting.standing(shot.door_heights_m):
            view.draw_solid(fine, panel, palette.DOOR)
        view.draw_robot(fine, shot.world_from_robot, palette.ROBOT)
        return view.finished(fine)

    yield shoot
