"""Pose graphs in g2o's text format: VERTEX_SE2 and EDGE_SE2 lines, others are refused by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from occmap.geometry import Pose2
from occmap.localization.pose_graph import PoseGraph

_UPPER = np.triu_indices(3)


def read_g2o(path: Path) -> PoseGraph:
    """The graph of a g2o file, its nodes numbered in the order of their ids."""
    vertices: dict[int, Pose2] = {}
    edges: list[tuple[int, int, Pose2, np.ndarray]] = []
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#") or words[0] == "FIX":
            continue
        try:
            if words[0] == "VERTEX_SE2":
                vertices[int(words[1])] = Pose2(*map(float, words[2:5]))
            elif words[0] == "EDGE_SE2":
                measured = Pose2(*map(float, words[3:6]))
                edges.append((int(words[1]), int(words[2]), measured, _symmetric(words[6:12])))
            else:
                raise ValueError(f"unknown tag {words[0]}; a 2D pose graph has VERTEX_SE2 and EDGE_SE2")
        except (IndexError, TypeError, ValueError) as error:
            raise ValueError(f"{path}, line {number}: {error}") from error
    graph = PoseGraph()
    node_of = {vertex: graph.add_node(vertices[vertex]) for vertex in sorted(vertices)}
    for i, j, i_from_j, information in edges:
        if i not in node_of or j not in node_of:
            raise ValueError(f"{path}: an edge joins {i} and {j}, but one of them is no vertex of the file")
        graph.add_edge(node_of[i], node_of[j], i_from_j, information)
    return graph


def _symmetric(words: list[str]) -> np.ndarray:
    """(3, 3) matrix from its upper triangle, row by row."""
    if len(words) != 6:
        raise ValueError(f"an edge has 6 numbers of information, got {len(words)}")
    matrix = np.zeros((3, 3))
    matrix[_UPPER] = [float(word) for word in words]
    return matrix + np.triu(matrix, 1).T
