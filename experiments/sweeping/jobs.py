"""One run of a sweep: what is to be done, what it is known by, and what is kept of it."""

from __future__ import annotations

import functools
import hashlib
import json
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from experiments import config_file
from experiments.config import ExperimentConfig
from experiments.sweeping.code_version import code_version
from experiments.sweeping.matrix import OPTION_OF, Matrix

Row = dict[str, Any]
"""One run's result as JSON holds it: what the run was, the fields of summary.json, and its curve."""
CRASHED, INTERRUPTED = "crashed", "interrupted"
DEFAULT: Row = config_file.to_plain(ExperimentConfig())
WHICH_BUILDING = ("plan", "building.kind")
"""Options that a row tells by its name; all others that vary are among its `options`."""


@dataclass(frozen=True)
class Job:
    """A run to be done, here or on another machine."""

    config: ExperimentConfig
    code: str
    """The code version that is to run it."""
    options: tuple[str, ...] = ()
    """Dotted names of what may tell the sweep's runs apart, beside building and seed."""

    @functools.cached_property
    def key(self) -> str:
        """Names the run by everything that decides its result: config, building, seed and code."""
        plain = config_file.to_plain(self.config.pinned()) | {"plan": content_hash(self.config.plan)}
        return hashlib.sha256((json.dumps(plain, sort_keys=True) + self.code).encode()).hexdigest()[:16]

    @property
    def name(self) -> str:
        """The plan, or the kind of building."""
        return self.config.building.kind if self.config.plan is None else self.config.plan.stem

    def identity(self) -> Row:
        """The fields of a row that are known before it is run."""
        c = self.config.pinned()
        said = changed(config_file.to_plain(c), DEFAULT)
        building = content_hash(c.plan) or {"kind": c.building.kind} | said["building"]
        return {
            "key": self.key,
            "name": self.name,
            "is_plan": c.plan is not None,
            "seed": c.seed,
            "building_id": json.dumps([building, c.building_seed, c.start]),
            "options": {name: config_file.to_plain(option_of(c, name)) for name in self.options},
            "config": said,
            "code": self.code,
        }


@dataclass(frozen=True)
class Result:
    """What came of a job."""

    row: Row
    picture: bytes = b""
    """A small PNG of the map; empty if the run crashed."""


def jobs_of(matrix: Matrix, code: str | None = None) -> Iterator[Job]:
    """Every run of a sweep, one at a time."""
    version = code_version() if code is None else code
    options = (*OPTION_OF.values(), *(axis.option for axis in matrix.axes))
    told_apart_by = tuple(dict.fromkeys(name for name in options if name not in WHICH_BUILDING))
    for config in matrix.experiments():
        yield Job(config, version, told_apart_by)


def run_job(job: Job, stop: Callable[[], bool] = lambda: False) -> Result:
    """Run it without recording. A mistake or a crash is a result too."""
    begun = time.perf_counter()
    try:
        if code_version() != job.code:
            raise RuntimeError(f"this process runs code {code_version()}, the sweep asks for {job.code}")
        result = _explored(job, stop)
    except Exception as error:
        return crashed(job, f"{type(error).__name__}: {error}")
    result.row["job_s"] = time.perf_counter() - begun
    return result


def _explored(job: Job, stop: Callable[[], bool]) -> Result:
    """Prepare, run, score. `run_s` is the time for that, `job_s` includes what the sweep adds to it."""
    from experiments.experiment import prepare
    from experiments.run import run
    from experiments.summary import summarise
    from experiments.summary_parts import finite
    from experiments.sweeping.curve import curve_of
    from experiments.sweeping.picture import map_picture

    begun = time.perf_counter()
    done = run(prepare(job.config), stop=stop)
    summary = finite(asdict(summarise(done)))
    run_s = time.perf_counter() - begun
    row = job.identity() | summary | {"curve": curve_of(done.curve.samples), "run_s": run_s}
    return Result(row, map_picture(done))


def crashed(job: Job, error: str) -> Result:
    """The result of a run that has none."""
    return Result(job.identity() | {"status": CRASHED, "error": error})


def experiment_of(row: Row) -> str:
    """What a run has in common with all of its sweep, in however many parts that was run: code and config,
    but for seed, building and all options that tell its runs apart."""
    apart = tuple(f"{option}." for option in ("seed", "building", "plan", *row.get("options", {})))
    same = [leaf for leaf in leaves(row.get("config", {})) if not f"{leaf[0]}.".startswith(apart)]
    return json.dumps([row.get("code"), sorted(same)])


def leaves(plain: Row, within: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted name, value) of every single value of a plain config."""
    for name, value in plain.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{within}{name}.")
        else:
            yield within + name, value


def changed(plain: Row, default: Row) -> Row:
    """What of a config differs from another, nested alike: `config_file.from_plain` makes it whole again."""
    found = {}
    for name, value in plain.items():
        if isinstance(value, dict) and isinstance(default[name], dict):
            value = changed(value, default[name])
            if not value:
                continue
        elif value == default[name]:
            continue
        found[name] = value
    return found


def option_of(config: Any, option: str) -> Any:
    """The value behind a dotted name."""
    return functools.reduce(getattr, option.split("."), config)


def content_hash(plan: Path | None) -> str | None:
    """A fingerprint of a floor plan's files, wherever they lie; its path if they cannot be read."""
    from sim.nav2_map import read_map_yaml

    if plan is None:
        return None
    try:
        beside = (read_map_yaml(plan)[0],) if plan.suffix.lower() in (".yaml", ".yml") else _included(plan)
        return _hash_of(tuple((file, file.stat().st_mtime_ns) for file in (plan, *beside)))
    except (OSError, ValueError, ET.ParseError):  # the run will say what is wrong with it
        return str(plan)


def _included(plan: Path) -> tuple[Path, ...]:
    """The files that an MJCF plan includes, and those that they include: all named from the plan's folder."""
    found: dict[Path, None] = {}
    waiting = [plan] if plan.suffix.lower() == ".xml" else []
    while waiting:
        files = [plan.parent / node.get("file", "") for node in ET.parse(waiting.pop()).iter("include")]
        waiting += [file for file in files if file not in found]
        found |= dict.fromkeys(files)
    return tuple(found)


@functools.lru_cache(maxsize=256)
def _hash_of(files: tuple[tuple[Path, int], ...]) -> str:
    """Of the contents alone; the times only tell when to read them again."""
    sha = hashlib.sha256()
    for file, _ in files:
        sha.update(file.read_bytes())
    return sha.hexdigest()[:16]
