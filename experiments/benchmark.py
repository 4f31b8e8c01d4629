"""What things cost, beside what they may cost.

    python -m experiments.benchmark
    python -m experiments.benchmark --parts loop start

Times are CPU time of one core where nothing else is said; ratios compare figures of one and the same run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import tyro

from experiments.benchmarking.figure import Figure, compared, ratio

Part = Literal["loop", "recording", "kernels", "matching", "planner", "start", "memory", "sweep", "large"]


@dataclass(frozen=True)
class Benchmark:
    """Measure what the parts of a run cost."""

    parts: tuple[Part, ...] = get_args(Part)[:-1]
    """loop: the whole of it, beside physics and lidar alone. recording: what rerun adds. kernels: a
    scan's. matching: slam's. planner: a way across a map. start: imports, compilation. memory: 60 m x 60 m.
    sweep: many runs, beside the runs themselves. large: buildings of 100 m and 200 m; takes an hour, so only
    if asked for."""
    seed: int = 0
    """Of the office that is explored."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ValueError(f"seed must not be negative, got {self.seed}")


def loop(seed: int) -> Iterator[Figure]:
    """The default office from beginning to end."""
    from experiments.benchmarking import loop as part

    yield from part.loop(seed)


def recording(seed: int) -> Iterator[Figure]:
    """The beginning of it, recorded."""
    from experiments.benchmarking import loop as part

    yield from part.recording(seed)


def kernels(seed: int) -> Iterator[Figure]:
    """What each scan of the same office costs the map."""
    from experiments.benchmarking.layers import layers

    yield from layers(seed)


def matching(seed: int) -> Iterator[Figure]:
    """What finding a scan in the map costs."""
    from experiments.benchmarking import matching as part

    yield from part.matching(seed)


def planner(seed: int) -> Iterator[Figure]:
    """Corner to corner on 800 x 800 cells with costs."""
    from experiments.benchmarking.planner import benchmark_planner

    speed = benchmark_planner(seed=seed)
    yield Figure("A* corner to corner, 800 x 800", speed.a_star_ms, "ms")
    yield Figure("A* / C", ratio(speed.a_star_ms, speed.a_star_in_c_ms), "", "1.35")
    yield from compared(speed.a_star_ms, speed.rivals_ms)
    yield Figure("cost to everywhere", speed.flood_ms, "ms")
    yield Figure("cost to everywhere / C", ratio(speed.flood_ms, speed.flood_in_c_ms), "", "1.3")
    yield from compared(speed.flood_ms, {"scipy's Dijkstra, graph included": speed.csgraph_ms})


def start(seed: int) -> Iterator[Figure]:
    """From nothing to the first scan."""
    from experiments.benchmarking import process as part

    yield from part.start()


def memory(seed: int) -> Iterator[Figure]:
    """A large office."""
    from experiments.benchmarking import process as part

    yield from part.memory(seed)


def sweep(seed: int) -> Iterator[Figure]:
    """Apartments, one and two at a time."""
    from experiments.benchmarking import sweep as part

    yield from part.throughput(seed)


def large(seed: int) -> Iterator[Figure]:
    """A large office and a larger warehouse."""
    from experiments.benchmarking import large as part

    yield from part.large(seed)


PARTS: dict[Part, Callable[[int], Iterator[Figure]]] = {
    "loop": loop,
    "recording": recording,
    "kernels": kernels,
    "matching": matching,
    "planner": planner,
    "start": start,
    "memory": memory,
    "sweep": sweep,
    "large": large,
}


def main() -> None:
    """Print a table, line by line as it is measured."""
    job = tyro.cli(Benchmark, prog="python -m experiments.benchmark")
    print(f"{'':<48}{'measured':>14}  {'':<24}aim")
    for part in job.parts:
        for figure in PARTS[part](job.seed):
            print(figure, flush=True)


if __name__ == "__main__":
    main()
