"""A piece of a real log, made harder in every way: no wrong loop, and the true relations still hold."""

from pathlib import Path

import numpy as np
import pytest

from experiments.logs.log import RecordedLog, read_log
from experiments.logs.perturbations import PERTURBATIONS
from experiments.relations import read_relations, score_relations
from experiments.replaying.runner import ReplayConfig, replay
from experiments.stress_slam import main
from occmap.localization import SlamLocalizer
from tests.occmap.localization.drives import RING, RING_LAP, drive, errors_m, observe

DATA = Path(__file__).parent.parent / "data"
LOG, RELATIONS = DATA / "intel_part.clf.gz", DATA / "intel_part.relations"
HARDER = [way for way in PERTURBATIONS if way not in ("as it is", "a minute missing")]


@pytest.mark.parametrize("way", HARDER)
def test_a_real_log_made_harder_keeps_its_relations(way: str):
    replayed = replay(PERTURBATIONS[way](read_log(LOG)), ReplayConfig())
    score = score_relations(replayed.laser, read_relations(RELATIONS))
    assert score.translation_m.mean < 0.03
    assert score.translation_m.max < 0.15
    assert score.rotation_deg.mean < 0.6


@pytest.mark.parametrize("way", ["no odometry", "backwards", "5 m range", "120 deg wide", "drift"])
def test_two_laps_made_harder_still_close(way: str):
    poses = drive([*RING_LAP, *RING_LAP, RING_LAP[0]])
    log = RecordedLog(tuple(observe(RING, poses, np.random.default_rng(0))), has_odometry=True)
    slam = SlamLocalizer()
    for seen in PERTURBATIONS[way](log).observations:
        slam.update(seen)
    slam.finish()
    driven = poses[::-1] if way == "backwards" else poses
    assert errors_m(driven, [pose for _, pose in slam.trajectory()]).max() < 0.15
    assert slam.loops.believed


def test_the_stamps_stay_whatever_is_made_harder():
    log = read_log(LOG)
    stamps = {seen.time_s for seen in log.observations}
    for way, perturbed in PERTURBATIONS.items():
        assert {seen.time_s for seen in perturbed(log).observations} <= stamps, way


def test_the_table_has_a_line_for_each_way(capsys):
    assert main([str(LOG), "--only", "8 m range", "turned"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(" | ")[1] for line in lines[2:]] == ["8 m range", "turned"]
    assert all(line.endswith("| 0 |") for line in lines[2:])
    with pytest.raises(SystemExit, match="2"):
        main([str(LOG), "--only", "nonsense"])
