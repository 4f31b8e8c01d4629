"""Run as a program: warm up, explore another room; print the kernels that were loaded only then, as JSON."""

from __future__ import annotations

import importlib
import json
import pkgutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

import occmap
from occmap.body import Body
from occmap.explorer import Explorer
from occmap.explorer_config import ExplorerConfig
from occmap.geometry import Pose2
from occmap.grid import GridConfig
from occmap.localization import SlamLocalizer, state_file
from occmap.localization.map_localizer import MapLocalizer
from occmap.scan import Scan
from occmap.sensor_model import SensorModelConfig
from occmap.warm_up import warm_up
from tests.occmap.explored_worlds import FLAT, Exploration
from tests.occmap.localization.drives import RING, RING_LAP, drive, observe


def shapes() -> dict[str, int]:
    """In how many shapes each kernel is in memory."""
    modules = [
        importlib.import_module(info.name) for info in pkgutil.walk_packages(occmap.__path__, "occmap.")
    ]
    return {
        f"{value.py_func.__module__}.{value.py_func.__name__}": len(value.signatures)
        for module in modules
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }


def make_explorer(kind: str, state: str) -> Explorer:
    match kind:
        case "slam":
            return Explorer(localizer=SlamLocalizer())
        case "map":
            return Explorer(localizer=MapLocalizer(state_file.load(Path(state))))
        case "large cones":
            config = ExplorerConfig(GridConfig(resolution_m=0.1), SensorModelConfig(beam_width_rad=0.1))
            return Explorer(config, body=Body(radius_m=0.5, period_s=0.5))
        case _:
            return Explorer()


def as_drivers_have_it(scan: Scan) -> Scan:
    """Clockwise, in single precision, not to be written to; and whole numbers."""
    ranges_m: Any = scan.ranges_m.astype(np.float32)[::-1]
    ranges_m.flags.writeable = False
    return Scan(scan.bearings_rad[::-1], ranges_m, 12, 0)


def live(explorer: Explorer) -> None:
    """See all that there is to be seen, at first with a driver's own types, and drive twice round a block."""
    flat = Exploration(FLAT, explorer)
    for _ in range(10):
        seen = flat.observe()
        explorer.decide(replace(seen, scan=as_drivers_have_it(seen.scan), robot_from_lidar=Pose2(0, 0, 0)))
    flat.run(120.0)
    explorer.certificate()
    localizer = explorer.perception.localizer
    if isinstance(localizer, SlamLocalizer):
        afresh = SlamLocalizer(localizer.config)
        for seen in observe(RING, drive([*RING_LAP, *RING_LAP, RING_LAP[0]]), np.random.default_rng(0)):
            afresh.update(seen)
        afresh.finish()
        afresh.map()


if __name__ == "__main__":
    explorer = make_explorer(*sys.argv[1:])
    warm_up(explorer)
    is_untouched = explorer.grid.state.size == 0
    warm = shapes()
    live(explorer)
    late = [name for name, n in shapes().items() if n != warm[name]]
    print(json.dumps({"late": late, "is_untouched": is_untouched}))
