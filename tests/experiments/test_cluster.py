"""The same sweep on a Dask cluster."""

from dataclasses import replace

import pytest

from experiments.config import ExperimentConfig
from experiments.sweep import Sweep, sweep
from experiments.sweeping.matrix import Matrix
from sim.generators import BuildingConfig
from tests.experiments.made_up_runs import quick

distributed = pytest.importorskip("distributed")

SHORT = ExperimentConfig(time_limit_s=2.0, building=BuildingConfig("apartment", size_m=(10.0, 8.0)))
AXES = Matrix(kinds=("apartment",), seeds=(0, 2), experiment=SHORT)


@pytest.fixture(scope="module")
def scheduler():
    """The address of a small cluster in this process."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
    ) as cluster:
        yield cluster.scheduler_address


def test_runs_on_a_cluster_are_those_of_this_machine(tmp_path, scheduler):
    here = sweep(Sweep(out=tmp_path / "here", axes=AXES))
    there = sweep(Sweep(out=tmp_path / "there", axes=AXES, scheduler=scheduler))
    rows, same = list(there.rows()), list(here.rows())
    assert [row["status"] for row in rows] == ["time_limit", "time_limit"]
    assert [(row["key"], row["map_sha256"]) for row in rows] == [
        (row["key"], row["map_sha256"]) for row in same
    ]
    assert there.picture(rows[0]["key"]) == here.picture(rows[0]["key"])


def test_a_sweep_on_a_cluster_goes_on_where_it_was(tmp_path, scheduler):
    job = Sweep(out=tmp_path, axes=replace(AXES, seeds=(0, 9)), scheduler=scheduler)
    assert len(list(sweep(replace(job, shard="1/2"), work=quick).rows())) == 5
    rows = list(sweep(job, work=quick).rows())
    assert [row["seed"] for row in rows] == list(range(9))
