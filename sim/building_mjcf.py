"""Building <-> MJCF.

A saved building is an ordinary MJCF file that MuJoCo's viewer opens. Solids are geoms named
`<kind>_<number>`, doors are sites named `door_<number>`, the start is the site `start`, whose x axis
points ahead; bounds and rooms are custom numerics. Loaded with any other MJCF, whatever is static and
meets the lidar's height is a solid from the floor upwards.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from occmap.geometry import Pose2
from sim.building import Box, Building, Cylinder, Door, Room, Solid
from sim.truth import LIDAR_HEIGHT_M

if TYPE_CHECKING:
    import mujoco

PLAN_COLOURS = {
    "wall": "0.85 0.84 0.8 1",
    "column": "0.6 0.6 0.62 1",
    "shelf": "0.45 0.55 0.7 1",
    "furniture": "0.65 0.48 0.32 1",
}
"""Those of models/plans. In films, kinds differ more (sim.scene)."""
ROOM = "room:"
"""What the names of rooms' numerics begin with."""
DOOR_COLOUR = "0.9 0.55 0.2 0.4"
HIDDEN = "3"
"""Sites of this group are shown on demand: doors stand open."""
LIGHT = {"dir": "0.2 0.3 -1", "directional": "true", "diffuse": "0.5 0.5 0.5"}
HEADLIGHT = {"ambient": "0.35 0.35 0.35", "diffuse": "0.15 0.15 0.15", "specular": "0 0 0"}


def save_mjcf(building: Building, path: str | Path) -> None:
    """Write the building as MJCF. Loading it gives the same building."""
    root = ET.Element("mujoco", model=building.name)
    ET.SubElement(root, "compiler", angle="radian")
    ET.SubElement(ET.SubElement(root, "visual"), "headlight", HEADLIGHT)
    custom = ET.SubElement(root, "custom")
    ET.SubElement(custom, "text", name="name", data=building.name)
    ET.SubElement(custom, "text", name="kind", data=building.kind)
    ET.SubElement(custom, "numeric", name="bounds", data=_numbers(*building.low_m, *building.high_m))
    for room in building.rooms:
        ET.SubElement(custom, "numeric", name=f"{ROOM}{room.name}", data=_numbers(*room.low_m, *room.high_m))
    world = ET.SubElement(root, "worldbody")
    (x0, y0), (x1, y1) = building.low_m, building.high_m
    x, y, half_x, half_y = 0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (x1 - x0), 0.5 * (y1 - y0)
    light_m = 2.0 * max(half_x, half_y)
    ET.SubElement(world, "light", LIGHT, pos=_numbers(x, y, light_m))
    floor = {
        "name": "floor",
        "type": "plane",
        "pos": _numbers(x, y, 0.0),
        "size": _numbers(half_x, half_y, 0.1),
    }
    ET.SubElement(world, "geom", floor, rgba="0.75 0.78 0.75 1")
    for number, solid in enumerate(building.solids):
        rgba = PLAN_COLOURS.get(solid.kind, PLAN_COLOURS["furniture"])
        ET.SubElement(world, "geom", _attributes(solid, number), rgba=rgba)
    for number, door in enumerate(building.doors):
        ET.SubElement(world, "site", _attributes(door.panel, number), rgba=DOOR_COLOUR, group=HIDDEN)
    start = building.start
    ET.SubElement(
        world,
        "site",
        name="start",
        pos=_numbers(start.x_m, start.y_m, 0.0),
        euler=_numbers(0, 0, start.yaw_rad),
    )
    ET.indent(root)
    Path(path).write_text(ET.tostring(root, encoding="unicode") + "\n")


def _attributes(solid: Solid, number: int) -> dict[str, str]:
    half_z = 0.5 * solid.height_m
    common = {"name": f"{solid.kind}_{number}", "pos": _numbers(solid.x_m, solid.y_m, half_z)}
    if isinstance(solid, Cylinder):
        return common | {"type": "cylinder", "size": _numbers(solid.radius_m, half_z)}
    box = common | {"type": "box", "size": _numbers(solid.half_x_m, solid.half_y_m, half_z)}
    return box if solid.yaw_rad == 0.0 else box | {"euler": _numbers(0, 0, solid.yaw_rad)}


def _numbers(*values: float) -> str:
    """Decimal text that reads back as exactly the same doubles."""
    return " ".join(repr(float(v)) for v in values)


def load_mjcf(path: str | Path) -> tuple[Building, Pose2 | None]:
    """The building in an MJCF file, and the start it names, if any (the building's own is then that one).

    Boxes and upright cylinders come over exactly, spheres and upright capsules as the cylinder
    around them, everything lying or tilted as the upright box around it. A mesh or height field
    at lidar height is refused: its shape is not that of few boxes.
    """
    import mujoco

    from sim.mjcf_geoms import static_solids

    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise ValueError(f"{path} is not an MJCF file: {error}") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solids = static_solids(model, data)
    if not solids:
        raise ValueError(
            f"{path} is not a floor plan: no static geom meets the lidar's height of {LIDAR_HEIGHT_M} m"
        )
    start = _start(model, data)
    texts, numerics = _texts(model), _numerics(model)
    for name, values in numerics.items():
        if (name == "bounds" or name.startswith(ROOM)) and len(values) != 4:
            raise ValueError(f"{path}: the numeric {name} must be x0 y0 x1 y1, got {values}")
    bounds = numerics.get("bounds")
    if bounds is None:
        around = np.array(
            [s.bounds() for s in solids] + ([(*start.position, *start.position)] if start else [])
        )
        bounds = [*around[:, :2].min(axis=0).tolist(), *around[:, 2:].max(axis=0).tolist()]
    return Building(
        name=texts.get("name", Path(path).stem),
        kind=texts.get("kind", "plan"),
        low_m=(bounds[0], bounds[1]),
        high_m=(bounds[2], bounds[3]),
        solids=solids,
        start=start or Pose2.identity(),
        rooms=tuple(_rooms(numerics)),
        doors=tuple(_doors(model, data)),
    ), start


def _rooms(numerics: dict[str, list[float]]) -> list[Room]:
    return [
        Room(name.removeprefix(ROOM), (v[0], v[1]), (v[2], v[3]))
        for name, v in numerics.items()
        if name.startswith(ROOM)
    ]


def _doors(model: mujoco.MjModel, data: mujoco.MjData) -> list[Door]:
    from sim.mjcf_geoms import yaw_of

    panels = []
    for k in range(model.nsite):
        if model.site(k).name.startswith("door_"):
            (x, y, _), (half_x, half_y, half_z) = data.site_xpos[k].tolist(), model.site_size[k].tolist()
            panels.append(Box(x, y, half_x, half_y, yaw_of(data.site_xmat[k]), 2.0 * half_z, "door"))
    return [Door(panel) for panel in panels]


def _start(model: mujoco.MjModel, data: mujoco.MjData) -> Pose2 | None:
    from sim.mjcf_geoms import yaw_of

    for k in range(model.nsite):
        if model.site(k).name == "start":
            return Pose2(float(data.site_xpos[k, 0]), float(data.site_xpos[k, 1]), yaw_of(data.site_xmat[k]))
    return None


def _numerics(model: mujoco.MjModel) -> dict[str, list[float]]:
    return {model.numeric(k).name: model.numeric(k).data.tolist() for k in range(model.nnumeric)}


def _texts(model: mujoco.MjModel) -> dict[str, str]:
    import mujoco

    said = {}
    for k in range(model.ntext):
        begin = model.text_adr[k]
        data = bytes(model.text_data[begin : begin + model.text_size[k] - 1])  # less the closing zero
        said[mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXT, k)] = data.decode()
    return said
