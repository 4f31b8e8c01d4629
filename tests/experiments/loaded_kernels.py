"""Run as a program: warm up, and print in how many shapes each kernel has been loaded, as JSON."""

import importlib
import json
import pkgutil
import re
from pathlib import Path

from numba.core.dispatcher import Dispatcher

import occmap
from experiments.config import ExperimentConfig
from experiments.warm_up import warm_up


def kernels():
    """Every kernel by name that something other than a kernel calls."""
    called = set()
    for file in Path(occmap.__path__[0]).rglob("*.py"):
        if not file.stem.endswith("kernels"):
            called |= set(re.findall(r"kernels(?:\.| import )(\w+)", file.read_text()))
    for info in pkgutil.walk_packages(occmap.__path__, "occmap."):
        for name, value in vars(importlib.import_module(info.name)).items():
            if isinstance(value, Dispatcher) and name in called:
                yield f"{info.name}.{name}", value


if __name__ == "__main__":
    warm_up(ExperimentConfig(pose="slam"))
    print(json.dumps({name: len(kernel.signatures) for name, kernel in kernels()}))
