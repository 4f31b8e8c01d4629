"""Many runs: kinds x sizes x seeds x strategies x noise x any option, here or on a cluster.

    python -m experiments.sweep --out runs/sweep --kinds office maze --seeds 0 20 --workers 2
    python -m experiments.sweep --matrix office.toml --shard 3/8
    python -m experiments.sweep --scheduler tcp://10.0.0.1:8786 --seeds 0 1000

Every run leaves a file of its own the moment it is done. A sweep that was stopped, killed or extended
goes on where it was; a worker that is killed costs its own run only. See docs/sweeps.md.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from experiments import config_file
from experiments.command import file_named, refuse_twice, refuse_with_plans
from experiments.exit_status import CTRL_C, INTERRUPTED, MISTAKE
from experiments.signals import StopRequest
from experiments.sweeping.matrix import AXIS_INSTEAD, OPTION_OF, Matrix, instead
from experiments.sweeping.recordings import Keep, record, recording_jobs, to_record
from experiments.words import say

if TYPE_CHECKING:
    from experiments.sweeping.jobs import Job
    from experiments.sweeping.pool import Work
    from experiments.sweeping.store import Store


@dataclass(frozen=True)
class Sweep:
    """Explore many buildings and gather what came of it.

    Exit status: 0 every run complete and honest, 1 not so, 2 a mistake in the options, 130 or 143
    interrupted.
    """

    out: Path = Path("runs/sweep")
    """The sweep's folder. Runs that are there already are kept and not run again."""
    matrix: Path | None = None
    """A .toml or .yaml file with any of the axes below. Options given beside it win."""
    workers: int = 1
    """Processes at a time, each on one thread."""
    scheduler: str | None = None
    """Address of a Dask scheduler, tcp://HOST:PORT: run on its workers instead."""
    shard: str = "1/1"
    """K/N: only every Nth run, beginning with the Kth. For job arrays; all may share one folder."""
    keep_recordings: str = "none"
    """worst:N, all or none: when all is done, run these once more with the recording on."""
    axes: Annotated[Matrix, tyro.conf.arg(name="")] = field(default_factory=Matrix)

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise ValueError(f"workers must be at least 1, got {self.workers}")
        Keep.parse(self.keep_recordings)
        self.share_of(range(0))

    def share_of(self, runs: range) -> range:
        """Of the runs' numbers those of this shard."""
        numbers = self.shard.split("/")
        if len(numbers) == 2 and all(number.isdecimal() for number in numbers):
            this, shards = map(int, numbers)
            if 1 <= this <= shards:
                return runs[this - 1 :: shards]
        raise ValueError(f"shard must be K/N with 1 <= K <= N, got {self.shard!r}")


def parse(arguments: Sequence[str]) -> Sweep:
    """The sweep that these arguments give: the defaults, then what --matrix says, then the options."""
    for option, axis in AXIS_INSTEAD.items():
        if file_named(f"--{option}", arguments) is not None:
            raise ValueError(instead(option, axis))
    refuse_twice([f"--{axis.replace('_', '-')}" for axis in (*OPTION_OF, "seeds", "vary")], arguments)
    file = file_named("--matrix", arguments)
    said = Sweep() if file is None else Sweep(axes=_read_matrix(file))
    asked = tyro.cli(Sweep, prog="python -m experiments.sweep", args=list(arguments), default=said)
    if asked.axes.plans:
        refuse_with_plans(("--kinds", "--building.size-m"), arguments, "--plans")
    return asked


def _read_matrix(file: Path) -> Matrix:
    from experiments.sweeping.matrix_file import read_matrix

    return read_matrix(file)


def sweep(asked: Sweep, stop: Callable[[], bool] = lambda: False, work: Work | None = None) -> Store:
    """Run what is missing or crashed, gather all that is there, record what is worth it."""
    from experiments.sweeping.code_version import code_version
    from experiments.sweeping.jobs import jobs_of
    from experiments.sweeping.pool import explore
    from experiments.sweeping.runner import open_lanes, run_missing
    from experiments.sweeping.store import Store

    code, total = code_version(), len(asked.axes)
    share = asked.share_of(range(total))
    read_plans(asked.axes)
    store = Store.create(asked.out)

    def jobs() -> Iterator[Job]:
        return jobs_of(asked.axes, code)

    with open_lanes(asked.workers, asked.scheduler) as lanes:
        store.ask({"code": code} | config_file.to_plain(asked))
        mine = islice(jobs(), share.start, None, share.step)
        tally = run_missing(mine, len(share), store, lanes, work or explore, stop)
        workers = sum(lane.workers() for lane in lanes)
    gather(store, jobs())
    say(tally.text(workers))
    if not stop() and keep_recordings(asked, store, jobs, stop):
        gather(store, jobs())
    return store


def read_plans(axes: Matrix) -> None:
    """Each plan once, before a thousand runs find the same mistake in it. ValueError for the first."""
    from experiments.experiment import make_building

    planned = (config for config in axes.variants if config.plan is not None)
    for config in {(c.plan, c.plan_resolution_m, c.start): c for c in planned}.values():
        make_building(config)


def gather(store: Store, jobs: Iterator[Job]) -> None:
    """Write down what there is of a sweep: results.jsonl, table.csv, table.txt."""
    from experiments.sweeping import table
    from experiments.sweeping.store import SHEET, TABLE

    store.gather(job.key for job in jobs)
    table.write_csv(store.rows, store.folder / SHEET)
    (store.folder / TABLE).write_text(text_of(store))


def text_of(store: Store) -> str:
    """The results as a table for people."""
    from experiments.sweeping import table
    from experiments.sweeping.groups import Naming, group

    return table.text_table(group(store.rows(), Naming.of(store.rows()))) + "\n"


RECORDINGS_A_PROCESS = 50
"""Each recording stream leaks some megabytes, so processes that record are replaced now and then."""


def keep_recordings(
    asked: Sweep, store: Store, jobs: Callable[[], Iterator[Job]], stop: Callable[[], bool]
) -> bool:
    """Run again what is worth looking at, on this machine: recordings are large. Whether there was any."""
    from experiments.sweeping.pool import results
    from experiments.sweeping.runner import open_lanes

    wanted = to_record(store, Keep.parse(asked.keep_recordings))
    todo = recording_jobs(jobs(), wanted, store)
    while batch := list(islice(todo, RECORDINGS_A_PROCESS * asked.workers)):
        with open_lanes(asked.workers, None) as lanes:
            for result in results(batch, lanes, record, stop):
                row = result.row
                say(f"recorded {row['name']} {row['seed']}: {row.get('error', row['status'])}")
    return bool(wanted)


def main(arguments: Sequence[str] | None = None) -> int:
    """Parse, sweep, print the table. Returns the exit status."""
    from experiments.sweeping.groups import is_good

    with StopRequest() as stop:
        try:
            asked = parse(sys.argv[1:] if arguments is None else arguments)
            store = sweep(asked, stop)
            print(text_of(store), end="")
            are_good = all(is_good(row) for row in store.rows())
        except (ValueError, OSError) as mistake:
            say(f"error: {mistake}")
            return MISTAKE
        except KeyboardInterrupt:  # asked twice
            return CTRL_C
        say(f"results in {store.folder}")
        if stop.signal is not None:
            return INTERRUPTED + stop.signal
        return 0 if are_good else 1


if __name__ == "__main__":
    sys.exit(main())
