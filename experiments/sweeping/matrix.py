"""Which runs a sweep consists of: the cross product of axes over one experiment.

An axis is an option of the experiment and the values it takes. Kinds, sizes, strategies and the like
are axes with a short name; `vary` makes one of any other option. Seeds are the outermost axis, so that
a sweep stopped half way has seen half of the seeds of everything.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, get_args

import tyro

from experiments import config_file
from experiments.config import ExperimentConfig, PoseSource
from occmap.strategies import Strategy
from sim.generators import Kind

OPTION_OF = {
    "plans": "plan",
    "kinds": "building.kind",
    "sizes": "building.size_m",
    "strategies": "explorer.goals.strategy",
    "poses": "pose",
    "noise_scales": "noise_scale",
    "drift_scales": "drift_scale",
}
"""The option behind each named axis, in the order of the cross product; seeds apart."""


AXIS_INSTEAD = {"seed": "seeds", "plan": "plans", "building.kind": "kinds"}
"""Options of a single run that are axes of every sweep."""


def instead(option: str, axis: str) -> str:
    """What to say to somebody who gave a sweep one of those."""
    return f"{option} is what the runs of a sweep are told apart by: give {axis} instead"


@dataclass(frozen=True)
class Axis:
    """One option and the values it takes in a sweep."""

    option: str
    """Its dotted name, as config.json nests it."""
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Matrix:
    """Every combination of these is a run. An axis that is left empty stays as the experiment says."""

    kinds: tuple[Kind, ...] = get_args(Kind)
    """Kinds of building."""
    sizes: tuple[tuple[float, float], ...] = ()
    """W H pairs, in metres: outer sizes of the generated buildings."""
    seeds: tuple[int, int] = (0, 20)
    """Seeds, from FIRST up to but without LAST. A building and all chance in it grow from its seed."""
    plans: tuple[Path, ...] = ()
    """Explore these floor plans, with every seed, instead of generated buildings."""
    strategies: tuple[Strategy, ...] = ()
    """Ways to choose the next goal."""
    poses: tuple[PoseSource, ...] = ()
    """Where the robot's pose comes from."""
    noise_scales: tuple[float, ...] = ()
    """Multiples of the lidar's errors."""
    drift_scales: tuple[float, ...] = ()
    """Multiples of the odometry's errors."""
    vary: tuple[str, ...] = ()
    """NAME=V1,V2,...: any other option by its dotted name in config.json, as in lidar.beams=180,360."""
    experiment: Annotated[ExperimentConfig, tyro.conf.arg(name="")] = field(default_factory=ExperimentConfig)

    def __post_init__(self) -> None:
        if not 0 <= self.seeds[0] < self.seeds[1]:
            raise ValueError(f"seeds must be FIRST LAST with 0 <= FIRST < LAST, got {self.seeds}")
        if not self.plans and not self.kinds:
            raise ValueError("nothing to explore: give --kinds or --plans")
        if self.plans and self.sizes:
            raise ValueError("--sizes are of generated buildings: leave them or the --plans out")
        if not self.plans and self.experiment.plan_resolution_m is not None:
            raise ValueError("plan_resolution_m is the size of a plan's pixels: give the --plans too")
        given, default = self.experiment, ExperimentConfig()
        for option, axis in AXIS_INSTEAD.items():
            value = functools.reduce(getattr, option.split("."), given)
            is_default = value == functools.reduce(getattr, option.split("."), default)
            if not is_default and getattr(self, axis) != (value,):
                raise ValueError(instead(option, axis))
        for plan in self.plans:
            if not plan.is_file():
                raise ValueError(f"no plan file at {plan}")

    @functools.cached_property
    def axes(self) -> tuple[Axis, ...]:
        """All axes but the seeds; ValueError for a value that its option does not take."""
        named = [Axis(option, getattr(self, name)) for name, option in OPTION_OF.items()]
        if self.plans:
            named = [axis for axis in named if axis.option != "building.kind"]
        axes = [axis for axis in named if axis.values] + [axis_of(text) for text in self.vary]
        options = [axis.option for axis in axes]
        for axis in axes:
            if axis.option == "seed" or options.count(axis.option) > 1:
                raise ValueError(f"{axis.option} is varied twice")
            twice = [value for value in axis.values if axis.values.count(value) > 1]
            if twice:
                raise ValueError(f"{axis.option} takes {twice[0]} twice")
        return tuple(axes)

    @functools.cached_property
    def variants(self) -> tuple[ExperimentConfig, ...]:
        """The experiments that each seed goes through; ValueError for a combination that cannot be."""
        variants = []
        for values in itertools.product(*(axis.values for axis in self.axes)):
            config = self.experiment
            for axis, value in zip(self.axes, values, strict=True):
                config = with_option(config, axis.option.split("."), value)
            variants.append(config)
        return tuple(variants)

    def __len__(self) -> int:
        """How many runs there are, without making any."""
        return (self.seeds[1] - self.seeds[0]) * len(self.variants)

    def experiments(self) -> Iterator[ExperimentConfig]:
        """Every run, one at a time: a million of them need no memory."""
        for seed in range(*self.seeds):
            for variant in self.variants:
                yield replace(variant, seed=seed)


def axis_of(text: str) -> Axis:
    """The axis that `NAME=V1,V2,...` describes; the values are written as in YAML."""
    import yaml

    option, equals, values = text.partition("=")
    if not equals or not values.strip():
        raise ValueError(f"vary needs NAME=V1,V2,..., got {text!r}")
    try:
        listed = yaml.safe_load(f"[{values}]")
    except yaml.YAMLError as error:
        raise ValueError(f"vary {text!r}: its values do not parse") from error
    return Axis(option, tuple(checked(option, _number(value)) for value in listed))


def _number(value: Any) -> Any:
    """What YAML 1.1 takes for text, 1e-3, as the number that it is."""
    if isinstance(value, str) and "e" in value.lower():
        try:
            return float(value)
        except ValueError:
            pass
    return value


def text_of(option: str, values: Sequence[Any]) -> str:
    """The `NAME=V1,V2,...` that describes an axis."""
    return f"{option}={json.dumps(list(values), default=str)[1:-1]}"


def checked(option: str, value: Any) -> Any:
    """The value as the config holds it; ValueError if there is no such option or it takes no such value."""
    data: Any = value
    for name in reversed(option.split(".")):
        data = {name: data}
    config = config_file.from_plain(ExperimentConfig, data, where=f"vary {option}")
    return functools.reduce(getattr, option.split("."), config)


def with_option(config: Any, names: Sequence[str], value: Any) -> Any:
    """The same nested dataclass with one value replaced."""
    if not dataclasses.is_dataclass(config) or isinstance(config, type):
        raise ValueError(f"{'.'.join(names)} lies within no part of the experiment")
    inner = value if len(names) == 1 else with_option(getattr(config, names[0]), names[1:], value)
    return replace(config, **{names[0]: inner})
