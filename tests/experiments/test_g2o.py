"""g2o files: what they say becomes a graph, and broken ones are refused by line."""

from pathlib import Path

import numpy as np
import pytest

from experiments.logs.g2o import read_g2o

SQUARE = """\
VERTEX_SE2 10 0 0 0
VERTEX_SE2 20 1.2 0.1 1.4
VERTEX_SE2 30 1.1 0.9 3.0
VERTEX_SE2 40 0.1 1.1 -1.5
FIX 10
EDGE_SE2 10 20 1 0 1.5707963267948966 100 0 0 100 0 400
EDGE_SE2 20 30 1 0 1.5707963267948966 100 0 0 100 0 400
EDGE_SE2 30 40 1 0 1.5707963267948966 100 0 0 100 0 400
EDGE_SE2 40 10 1 0 1.5707963267948966 100 1 2 100 3 400
"""


def test_a_square_closes(tmp_path: Path):
    path = tmp_path / "square.g2o"
    path.write_text(SQUARE)
    graph = read_g2o(path)
    assert graph.optimise().cost < 1e-9
    np.testing.assert_allclose(graph.poses[:, :2], [(0, 0), (1, 0), (1, 1), (0, 1)], atol=1e-5)


def test_every_number_of_a_file_is_in_its_graph(tmp_path: Path):
    (tmp_path / "a.g2o").write_text(SQUARE)
    graph = read_g2o(tmp_path / "a.g2o")
    np.testing.assert_array_equal(graph.poses[:, :2], [(0, 0), (1.2, 0.1), (1.1, 0.9), (0.1, 1.1)])
    np.testing.assert_array_equal(graph.poses[:, 2], [0, 1.4, 3.0, -1.5])
    np.testing.assert_array_equal(graph.ends, [(0, 1), (1, 2), (2, 3), (3, 0)])
    np.testing.assert_array_equal(graph.measured, [(1, 0, np.pi / 2)] * 4)
    np.testing.assert_array_equal(graph.information[3], [(100, 1, 2), (1, 100, 3), (2, 3, 400)])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("VERTEX_SE2 0 0 0\n", "line 1"),
        ("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0\n", "line 2: an edge has 6 numbers"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n", "line 1: unknown tag VERTEX_SE3:QUAT"),
        ("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\n", "joins 0 and 1"),
    ],
)
def test_a_broken_file_is_refused_by_line(tmp_path: Path, text: str, message: str):
    path = tmp_path / "broken.g2o"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_g2o(path)
