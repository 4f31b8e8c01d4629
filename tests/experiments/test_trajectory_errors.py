"""ATE and RPE agree with the evo tool on the same TUM files."""

from pathlib import Path

import numpy as np
import pytest

from experiments.trajectory_errors import absolute, aligned, associated, relative
from experiments.tum_file import Trajectory, read_tum, write_tum
from occmap.geometry import Pose2


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """A reference, and an estimate that drifts away from it, in another frame and with gaps."""
    rng = np.random.default_rng(0)
    true, believed = [Pose2.identity()], [Pose2(3.0, 1.0, 0.6)]
    for _ in range(299):
        step = Pose2(*rng.normal((0.2, 0.0, 0.0), (0.05, 0.02, 0.2)))
        true.append(true[-1] @ step)
        believed.append(believed[-1] @ step @ Pose2(*rng.normal(0.0, (0.01, 0.01, 0.01))))
    times_s = np.cumsum(rng.uniform(0.05, 0.15, 300)) + 1.6e9
    kept = np.sort(rng.permutation(300)[:270])
    paths = tmp_path / "reference.tum", tmp_path / "estimate.tum"
    write_tum(paths[0], Trajectory.of(times_s.tolist(), true))
    write_tum(paths[1], Trajectory.of((times_s[kept] + 0.002).tolist(), [believed[k] for k in kept]))
    return paths


def test_alignment_undoes_any_rigid_motion(files: tuple[Path, Path]):
    poses = read_tum(files[0]).poses
    moved = [Pose2(4.0, -2.0, 2.5) @ Pose2(*row) for row in poses.tolist()]
    back = aligned(poses, np.array([(p.x_m, p.y_m, p.yaw_rad) for p in moved]))
    np.testing.assert_allclose(back[:, :2], poses[:, :2], atol=1e-9)


@pytest.mark.parametrize("align", [False, True])
def test_ate_agrees_with_evo(files: tuple[Path, Path], align: bool):
    ours = absolute(read_tum(files[0]), read_tum(files[1]), align)
    theirs = evo_ape(files, align)
    for name in ("rmse", "mean", "median", "std", "max"):
        assert getattr(ours, name) == pytest.approx(theirs[name], rel=1e-6)


@pytest.mark.parametrize(("delta", "unit"), [(1, "frames"), (7, "frames"), (0.5, "m"), (3.0, "m")])
def test_rpe_agrees_with_evo(files: tuple[Path, Path], delta: float, unit):
    metres, degrees = relative(read_tum(files[0]), read_tum(files[1]), delta, unit)
    for ours, part in ((metres, "translation_part"), (degrees, "rotation_angle_deg")):
        theirs = evo_rpe(files, delta, unit, part)
        for name in ("rmse", "mean", "median", "std", "max"):
            assert getattr(ours, name) == pytest.approx(theirs[name], rel=1e-5)


def test_trajectories_of_different_times_are_refused(files: tuple[Path, Path]):
    reference = read_tum(files[0])
    with pytest.raises(ValueError, match="no stamps in common"):
        associated(reference, Trajectory(reference.times_s + 1e6, reference.poses))


def evo_ape(files: tuple[Path, Path], align: bool) -> dict[str, float]:
    evo_pair, metrics = synchronised(files)
    if align:
        evo_pair[1].align(evo_pair[0])
    metric = metrics.APE(metrics.PoseRelation.translation_part)
    metric.process_data(evo_pair)
    return metric.get_all_statistics()


def evo_rpe(files: tuple[Path, Path], delta: float, unit: str, part: str) -> dict[str, float]:
    evo_pair, metrics = synchronised(files)
    units = {"frames": metrics.Unit.frames, "m": metrics.Unit.meters}
    metric = metrics.RPE(metrics.PoseRelation[part], delta=delta, delta_unit=units[unit])
    metric.process_data(evo_pair)
    return metric.get_all_statistics()


def synchronised(files: tuple[Path, Path]):
    """evo's own reading and association of the two files."""
    pytest.importorskip("evo", reason="needs the extra dev")
    from evo.core import metrics, sync
    from evo.tools import file_interface

    reference, estimate = (file_interface.read_tum_trajectory_file(str(path)) for path in files)
    return sync.associate_trajectories(reference, estimate), metrics
