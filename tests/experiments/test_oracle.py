"""An oracle's tour sees enough, is no longer than a way given, and is the known one where that is known."""

import json
from dataclasses import replace
from itertools import pairwise, permutations
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from experiments.config import ExperimentConfig
from experiments.experiment import prepare
from experiments.maps import write_truth
from experiments.oracle import figures
from experiments.oracle.__main__ import main
from experiments.oracle.bound import lower_bound_m, path_bound, spanning_tree
from experiments.oracle.floor import LEAST_SEEN, Floor
from experiments.oracle.run_files import read_run
from experiments.oracle.samples import chances
from experiments.oracle.search import Seen, TourSearch
from experiments.oracle.tour import ENOUGH, OracleConfig, metres, near_shortest_tour, seen_along
from experiments.oracle.ways import Ways
from experiments.run import run
from experiments.summary import summarise
from experiments.tum_file import Trajectory, write_tum
from occmap.geometry import Pose2
from occmap.pgm import write_pgm
from sim.building import Box
from sim.starts import BODY_RADIUS_M
from sim.truth import TruthGrid, explorable, truth_grid
from tests.ascii_maps import ascii_map
from tests.experiments.commands import mistake
from tests.sim.rooms import room

RESOLUTION_M = 0.1
FEW = OracleConfig(rounds=15, more_rounds=10)

FOUR_ROOMS = """####################
                #....#........#....#
                #....#........#....#
                #..................#
                #....#........#....#
                #....#........#....#
                ###.####....####.###
                #....#........#....#
                #....#........#....#
                #..................#
                #....#........#....#
                ####################"""


WEST = ((0.0, 0.0), (5.4, 0.0), (5.4, 6.0), (0.0, 6.0))
"""A boundary around the rooms on the left."""


def floor_of(wall: np.ndarray, start: tuple[float, float], range_m: float = 12.0) -> Floor:
    truth, pose = TruthGrid(RESOLUTION_M, (0.0, 0.0), wall), Pose2(*start, 0.0)
    return Floor(truth, explorable(truth, pose, BODY_RADIUS_M, range_m), pose, BODY_RADIUS_M, range_m)


def drawn(picture: str, cells: int = 5) -> np.ndarray:
    """Walls of a drawing whose characters are squares of so many cells."""
    return np.kron(ascii_map(picture) == "#", np.ones((cells, cells), bool))


def corridor(length_m: float, width_m: float = 1.0) -> np.ndarray:
    wall = np.ones((round(width_m / RESOLUTION_M) + 2, round(length_m / RESOLUTION_M) + 2), bool)
    wall[1:-1, 1:-1] = False
    return wall


@pytest.fixture(scope="module")
def rooms() -> Floor:
    return floor_of(drawn(FOUR_ROOMS), (5.0, 1.5))


def test_a_room_in_sight_from_the_start_needs_no_way():
    oracle = near_shortest_tour(floor_of(corridor(6.0, 4.0), (2.0, 2.0)), config=FEW)
    assert oracle.length_m == 0.0
    assert oracle.lower_bound_m == 0.0
    assert oracle.seen == 1.0


@pytest.mark.parametrize(("start_m", "known_m"), [(1.0, 23.85), (10.0, 10.0 - 5.0 + 20.0 - 5.0 - 0.15)])
def test_in_a_corridor_the_shortest_way_is_known(start_m, known_m):
    """With a range of 5 m, all but 15 cm of 30 m: to the far end less the range, the near end first."""
    oracle = near_shortest_tour(floor_of(corridor(30.0), (start_m, 0.6), range_m=5.0), config=FEW)
    turn_m = 0.0 if start_m < 5.0 else 5.0  # there and back
    assert oracle.length_m == pytest.approx(known_m + turn_m, abs=0.35)
    assert 0.85 * (30.0 - 5.0 - start_m - 0.25) < oracle.lower_bound_m <= oracle.length_m


def test_a_tour_is_seen_to_see_enough_by_the_definition_of_explorable(rooms):
    oracle = near_shortest_tour(rooms, config=FEW)
    assert ENOUGH <= oracle.seen == seen_along(rooms, oracle.path)
    cells = rooms.cells_of(oracle.path) - 1
    assert np.all(~rooms.truth.wall[cells[:, 1], cells[:, 0]])
    assert np.allclose(oracle.path[0], (5.05, 1.55), atol=0.06)
    assert np.hypot(*np.diff(oracle.path, axis=0).T).max() <= RESOLUTION_M + 1e-9
    assert 0.0 < oracle.lower_bound_m < oracle.length_m == pytest.approx(metres(oracle.path))


def test_the_same_seed_gives_the_same_tour(rooms):
    one, other = (near_shortest_tour(rooms, config=FEW) for _ in range(2))
    assert np.array_equal(one.path, other.path)


def test_a_tour_is_never_longer_than_a_trail_that_sees_enough(rooms):
    best = near_shortest_tour(rooms, config=FEW)
    hasty = OracleConfig(rounds=0, more_rounds=0)
    assert near_shortest_tour(rooms, config=hasty).length_m >= best.length_m
    assert near_shortest_tour(rooms, [best.path], hasty).length_m <= best.length_m


def test_a_trail_may_come_back_to_where_it_began(rooms):
    there = near_shortest_tour(rooms, config=FEW).path
    round_trip = np.concatenate((there, there[::-1], there))
    assert near_shortest_tour(rooms, [round_trip], FEW).length_m <= metres(there) + 1e-9


def test_a_trail_that_sees_too_little_is_no_answer(rooms):
    stands = np.array([(5.05, 1.55), (5.05, 1.65)])
    oracle = near_shortest_tour(rooms, [stands], FEW)
    assert oracle.length_m > metres(stands)
    assert oracle.seen >= ENOUGH


@pytest.fixture
def walled_up() -> Floor:
    """Two rooms without a door between them, both said to be explorable."""
    wall = drawn("""##########
                    #....#...#
                    #....#...#
                    #....#...#
                    ##########""")
    return Floor(TruthGrid(RESOLUTION_M, (0.0, 0.0), wall), ~wall, Pose2(1.5, 1.25, 0.0), BODY_RADIUS_M, 12.0)


def test_where_nobody_sees_enough_there_are_no_figures(walled_up):
    oracle = near_shortest_tour(walled_up, config=FEW)
    assert oracle.seen < ENOUGH
    assert figures.compared(oracle, walled_up, oracle.path) == figures.OracleFigures(None, None, None)


def test_where_no_tour_sees_enough_a_trail_that_does_is_the_answer(walled_up):
    trail = np.array([(1.5, 1.25), (2.0, 1.25), (3.75, 1.25), (4.0, 1.25)])
    oracle = near_shortest_tour(walled_up, [trail], FEW)
    found = figures.compared(oracle, walled_up, trail)
    assert oracle.seen >= ENOUGH
    assert found.oracle_m == oracle.length_m <= metres(trail)
    assert found.oracle_lower_bound_m == 0.0  # of robots that pass through walls nothing is known
    assert found.competitive_ratio == metres(trail) / oracle.length_m


def test_what_a_search_counts_is_what_it_would_count_afresh(rooms):
    ways = Ways(rooms)
    search = TourSearch(rooms, ways, 0.99, np.random.default_rng(1))
    stops = search.improved([rooms.start_place], rounds=3)
    seen = Seen(rooms, ways, stops[:3])
    before = seen.gain().copy()
    seen.replace([], stops[2:])
    after = Seen(rooms, ways, stops)
    assert np.array_equal(seen.counts, after.counts)
    assert seen.weight == after.weight >= search.needed
    assert np.array_equal(seen.gain(), after.gain())
    assert not np.array_equal(before, seen.gain())


def test_ways_are_the_same_there_and_back(rooms):
    ways = Ways(rooms)
    far = int(np.argmax(ways.distance_m(rooms.start_place)))
    there, back = ways.leg(rooms.start_place, far), ways.leg(far, rooms.start_place)
    assert there is back
    straight_m = np.hypot(*(rooms.places[far] - rooms.places[rooms.start_place])) * RESOLUTION_M
    assert straight_m <= there.length_m <= ways.distance_m(far)[rooms.start_place] + 1e-4


def test_a_bound_on_paths_is_below_the_shortest_and_above_the_tree():
    rng = np.random.default_rng(3)
    points = rng.uniform(0.0, 10.0, (7, 2))
    away = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    shortest = min(sum(away[a, b] for a, b in pairwise((0, *order))) for order in permutations(range(1, 7)))
    tree, degree = spanning_tree(away)
    assert degree.sum() == 2 * 6
    assert tree <= path_bound(away) <= shortest + 1e-9
    assert path_bound(np.zeros((1, 1))) == 0.0


@pytest.mark.parametrize(
    ("size_m", "start", "range_m", "solids"),
    [
        ((5.46, 1.24), (2.36, 0.54), 3.0, ()),
        ((4.43, 1.42), (2.078, 1.073), 12.0, (Box(0.889, 1.034, 0.667, 0.05, 1.174),)),
    ],
)
def test_no_tour_is_shorter_than_the_bound_wherever_it_stops(size_m, start, range_m, solids):
    """In small rooms some centimetres count: a few cells ahead a robot sees what no place sees."""
    pose = Pose2(*start, 0.0)
    truth = truth_grid(room(*size_m, pose, solids), 0.05)
    floor = Floor(truth, explorable(truth, pose, BODY_RADIUS_M, range_m), pose, BODY_RADIUS_M, range_m)
    assert lower_bound_m(floor, ENOUGH) <= near_shortest_tour(floor, config=FEW).length_m


@pytest.mark.parametrize("start", [(1.05, 0.45), (1.15, 0.45)])
def test_places_are_as_dense_as_a_narrow_corridor_needs_them(start):
    """Its axis may lie between the places of a coarse lattice."""
    wall = np.ones((60, 30), bool)
    wall[2:7, 2:28] = False
    wall[2:58, 20:25] = False
    floor = floor_of(wall, start, range_m=3.0)
    assert floor.seen_share(floor.places) >= LEAST_SEEN
    assert near_shortest_tour(floor, config=FEW).seen >= ENOUGH


def test_a_way_leads_wherever_the_explorable_area_is_seen_from():
    """Where a body fits at two cells that meet at a corner, it is taken to fit between them."""
    wall = corridor(6.0, 6.0)
    wall[30, 1:20] = True  # x up to 1.9 m
    wall[25, 22:-1] = True  # x from 2.2 m
    floor = floor_of(wall, (2.05, 0.55), range_m=3.0)
    oracle = near_shortest_tour(floor, config=FEW)
    assert oracle.seen >= ENOUGH
    assert oracle.path[:, 1].max() > 3.5


def test_chances_add_up_and_none_is_more_than_certain():
    chance = chances(np.array([100.0, 1.0, 1.0, 1.0, 1.0]), 3)
    assert chance.max() == 1.0
    assert chance.sum() == pytest.approx(3.0, abs=0.5)


def eastmost_m(floor: Floor) -> float:
    """How far east the body's axis can be, in `world`."""
    return floor.world_from(np.argwhere(floor.stands)[:, ::-1])[:, 0].max()


def in_four_rooms(folder) -> ExperimentConfig:
    """An experiment in them, from a plan that this leaves in a folder."""
    plan = folder / "rooms.png"
    Image.fromarray(np.where(drawn(FOUR_ROOMS)[::-1], 0, 255).astype(np.uint8)).save(plan)
    return ExperimentConfig(plan=plan, plan_resolution_m=RESOLUTION_M, start=(5.0, 1.5, 0.0))


def leave_run(folder, floor: Floor, trail: np.ndarray, **config: object) -> None:
    """What a finished run's folder holds, as far as an oracle reads it."""
    write_truth(floor.truth, folder / "truth")
    mask = explorable(floor.truth, Pose2(*trail[0], 0.0), BODY_RADIUS_M, floor.range_m)
    write_pgm(folder / "explorable.pgm", np.where(mask[::-1], 255, 0).astype(np.uint8))
    poses = np.column_stack((trail, np.zeros(len(trail))))
    write_tum(folder / "truth.tum", Trajectory(0.1 * np.arange(len(trail)), poses))
    (folder / "config.json").write_text(json.dumps({"lidar": {"max_range_m": floor.range_m}} | config))


def test_the_command_answers_for_runs_of_one_task_together(tmp_path, capsys, rooms):
    short = near_shortest_tour(rooms, config=FEW).path
    long = np.concatenate((short, short[::-1]))
    for name, trail in (("long", long), ("short", short)):
        (tmp_path / name).mkdir()
        leave_run(tmp_path / name, rooms, trail)
    assert main([str(tmp_path / "long"), str(tmp_path / "short"), "--rounds", "5"]) == 0
    answers = [json.loads((tmp_path / name / "oracle.json").read_text()) for name in ("long", "short")]
    assert answers[0]["oracle_m"] == answers[1]["oracle_m"] <= metres(short) + 1e-6
    assert answers[0]["competitive_ratio"] == pytest.approx(2.0 * answers[1]["competitive_ratio"])
    assert answers[1]["competitive_ratio"] >= 1.0
    assert Image.open(tmp_path / "short" / "oracle.png").width > 500
    assert "short" in capsys.readouterr().out


def test_the_command_refuses_what_is_no_run(tmp_path, capsys):
    assert "is not the folder of a run that has ended" in mistake(main, [str(tmp_path)], capsys)


def test_the_command_leaves_figures_out_where_there_are_none(tmp_path, capsys, walled_up):
    leave_run(tmp_path, walled_up, np.array([(1.5, 1.25), (1.6, 1.25)]))
    both = walled_up.free[1:-1, 1:-1]
    write_pgm(tmp_path / "explorable.pgm", np.where(both[::-1], 255, 0).astype(np.uint8))
    assert main([str(tmp_path), "--rounds", "1"]) == 0
    answer = json.loads((tmp_path / "oracle.json").read_text(), parse_constant=pytest.fail)
    assert answer["oracle_m"] is answer["oracle_lower_bound_m"] is answer["competitive_ratio"] is None
    assert "inf" not in capsys.readouterr().out


def test_no_way_leaves_a_boundary(tmp_path, rooms):
    leave_run(tmp_path, rooms, np.array([(1.5, 1.5), (4.0, 1.5)]), boundary=WEST)
    run = read_run(tmp_path)
    assert run.task != replace(run, boundary=()).task
    assert eastmost_m(run.floor()) < 5.4 < 9.0 < eastmost_m(rooms)


def test_a_run_within_a_boundary_is_measured_by_ways_within_it(tmp_path, monkeypatch):
    asked = replace(in_four_rooms(tmp_path), start=(1.5, 1.5, 0.0), boundary=WEST)
    monkeypatch.setattr(figures, "near_shortest_tour", lambda *_: None)
    monkeypatch.setattr(figures, "compared", lambda oracle, floor, trail: floor)
    done = SimpleNamespace(experiment=prepare(asked), trajectory=SimpleNamespace(true=np.zeros((1, 3))))
    assert eastmost_m(figures.oracle_of(done)) < 5.4  # type: ignore[arg-type]


def test_a_run_whose_doors_closed_is_refused(tmp_path, capsys, rooms):
    leave_run(tmp_path, rooms, np.array([(5.0, 1.5), (4.0, 1.5)]), faults={"close_doors_at_s": 5.0})
    assert "doors closed in this run" in mistake(main, [str(tmp_path)], capsys)


def test_the_command_wants_a_run(capsys):
    assert "name at least one folder" in mistake(main, [], capsys)


def test_a_summary_has_the_oracle_that_was_asked_for(tmp_path):
    summary = summarise(run(prepare(replace(in_four_rooms(tmp_path), time_limit_s=3.0, oracle=True))))
    assert summary.status == "time_limit"
    assert summary.oracle_m is not None
    assert summary.oracle_lower_bound_m is not None
    assert 0.0 < summary.oracle_lower_bound_m < summary.oracle_m
    assert summary.competitive_ratio is None  # it has seen too little to be compared
