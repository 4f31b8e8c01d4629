"""The walls of one map held against those of another."""

import math
from pathlib import Path

import pytest

from experiments.map_agreement import map_agreement
from experiments.score_map import main
from occmap.geometry import Pose2
from occmap.map_server import NavMap, save_map
from tests.ascii_maps import ascii_state

ELL = """
#......
#......
#######
"""
ROOM = """
#######
#.....#
#.....#
#######
"""


def drawn(text: str, origin: Pose2 | None = None) -> NavMap:
    return NavMap(ascii_state(text), 0.1, origin or Pose2.identity())


def test_a_map_agrees_with_itself():
    agreement = map_agreement(drawn(ROOM), drawn(ROOM))
    assert (agreement.occupied, agreement.seen, agreement.share) == (18, 18, 1.0)
    assert (agreement.mean_m, agreement.p95_m) == (0.0, 0.0)


@pytest.mark.parametrize("cells_off", [1, -1])
def test_a_cell_off_is_within_a_cell(cells_off: int):
    agreement = map_agreement(drawn(ROOM, Pose2(0.1 * cells_off, 0.0, 0.0)), drawn(ROOM))
    assert agreement.share == 1.0
    assert agreement.p95_m == pytest.approx(0.1)


def test_a_wall_in_the_middle_of_what_the_reference_saw_free_is_held_against_the_map():
    reference = drawn("#..........\n" * 3)
    agreement = map_agreement(drawn("#....#.....\n" * 3), reference)
    assert (agreement.seen, agreement.share) == (6, 0.5)
    assert agreement.mean_m == pytest.approx(0.25)


def test_what_the_reference_does_not_know_is_left_out():
    agreement = map_agreement(drawn("#..#..#\n"), drawn("#..#\n"))
    assert (agreement.occupied, agreement.seen, agreement.share) == (3, 2, 1.0)
    assert map_agreement(drawn("###\n"), drawn("???\n")).share is None


def test_a_reference_without_walls_agrees_with_none():
    agreement = map_agreement(drawn("#..\n"), drawn("...\n"))
    assert (agreement.share, agreement.mean_m) == (0.0, None)


def test_maps_are_placed_by_their_origins_turned_or_not():
    """The same walls in a grid whose x axis points along the world's y."""
    straight = drawn(ELL)
    turned = NavMap(straight.state.T[::-1], 0.1, Pose2(0.1 * straight.state.shape[1], 0.0, math.pi / 2))
    agreement = map_agreement(turned, straight)
    assert (agreement.seen, agreement.share) == (9, 1.0)
    assert agreement.mean_m == 0.0


def test_the_command_prints_what_it_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    room = drawn(ROOM)
    path = save_map(tmp_path / "map", room.state, room.resolution_m, room.origin)
    assert main([str(path), str(path)]) == 0
    out = capsys.readouterr().out
    assert "18 occupied cells, 18 of them" in out
    assert "100.00 % of those lie within one cell" in out


def test_the_picture_of_a_map_is_taken_for_what_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    room = drawn(ROOM)
    path = save_map(tmp_path / "room", room.state, room.resolution_m, room.origin)
    assert main([str(path), str(tmp_path / "room.pgm")]) == 2
    assert "give the room.yaml beside it" in capsys.readouterr().err


def test_a_missing_map_is_the_user_s_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    assert main([str(tmp_path / "no.yaml"), str(tmp_path / "no.yaml")]) == 2
    assert "no.yaml" in capsys.readouterr().err
