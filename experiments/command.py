"""The command line of the main job."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import tyro

from experiments import config_file
from experiments.config import ExperimentConfig


@dataclass(frozen=True)
class Command:
    """Drop a robot into a building it has never seen, let it explore to the end, and keep a map of it.

    With no options: a generated office, a robot that works out by slam where it is, and a folder in
    runs/ with the recording, a video, the map, the curves and summary.json. Exit status: 0 complete or
    sealed in, 1 the same but for a recording or a film that failed, 2 a mistake in the options, 3 time limit,
    4 stuck, 5 physics fault, 130 or 143 interrupted.

    The first boxes are about the run, the building and the robot. From `map` on they tune the robot's mind,
    part by part: a first run needs none of them.
    """

    out: Path | None = None
    """The run's folder. By default a new one, runs/<building>-<seed>. One that holds a run is refused."""
    record: bool = True
    """Write recording.rrd, to scrub through with `rerun`."""
    video: bool = True
    """Write exploration.mp4."""
    config: Path | None = None
    """Run again what this config.json says. Options given beside it win, and are named."""
    experiment: Annotated[ExperimentConfig, tyro.conf.arg(name="")] = field(default_factory=ExperimentConfig)


def parse(arguments: Sequence[str]) -> Command:
    """The command that these arguments give. Prints and exits for --help and for options that do not parse;
    ValueError for values that make no sense."""
    file = file_named("--config", arguments)
    said = ExperimentConfig() if file is None else config_file.read(ExperimentConfig, file)
    command = tyro.cli(
        Command, prog="python -m experiments.explore", args=list(arguments), default=Command(experiment=said)
    )
    if command.experiment.plan is not None:
        is_said_here = file is None or is_given("--plan", arguments)
        plan = "--plan" if is_said_here else f"the plan that {file} names (--plan None leaves it out)"
        refuse_with_plans(("--building.kind", "--building.size-m"), arguments, plan)
    if file is not None:
        for line in changes(file, said, command.experiment):
            print(line, file=sys.stderr)
    return command


def refuse_with_plans(options: Sequence[str], arguments: Sequence[str], plans: str) -> None:
    """ValueError if one of these options, which only generated buildings heed, is on the command line."""
    for option in options:
        if is_given(option, arguments):
            raise ValueError(f"{option} is for generated buildings and does not go with {plans}")


def refuse_twice(options: Sequence[str], arguments: Sequence[str]) -> None:
    """ValueError if one of these options of many values is there twice: the last would win, unnoticed."""
    for option in options:
        if sum(is_given(option, [argument]) for argument in arguments) > 1:
            raise ValueError(f"{option} is given twice: give all values after the first")


def changes(file: Path, said: ExperimentConfig, asked: ExperimentConfig) -> Iterator[str]:
    """What the command line made of a file's config, a line each."""
    for name, before, after in differences(config_file.to_plain(said), config_file.to_plain(asked)):
        yield f"{file} says {name} = {before}; the command line wins with {after}"
    pinned = said.building.seed
    if said.seed != asked.seed and pinned is not None and pinned == asked.building.seed:
        yield f"building and start stay those of building.seed {pinned}: give --building.seed for others"


def is_given(option: str, arguments: Sequence[str]) -> bool:
    """Whether an option is among the arguments, in whatever spelling the command line takes."""
    return any(argument.partition("=")[0].replace("_", "-") == option for argument in arguments)


def file_named(option: str, arguments: Sequence[str]) -> Path | None:
    """What an option names whose file holds the defaults of all others, so that it is needed first.

    Of an option that is given twice the last, as with all others.
    """
    named: Path | None = None
    for argument, following in pairwise([*arguments, None]):
        if argument == option and following is not None:
            named = Path(following)
        elif argument is not None and argument.startswith(f"{option}="):
            named = Path(argument.removeprefix(f"{option}="))
    return named


def differences(before: Any, after: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """(name, before, after) of every value in which two plain configs differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in before:
            yield from differences(before[key], after[key], f"{name}.{key}" if name else key)
    elif before != after:
        yield name, before, after
