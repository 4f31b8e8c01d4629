"""The command that prints the table of errors and times."""

import math
from pathlib import Path

import pytest

from experiments.benchmark_slam import main
from tests.experiments.commands import mistake

DATA = Path(__file__).parent.parent / "data"

SQUARE = "".join(f"VERTEX_SE2 {k} {k * 0.9} {k * 0.1} {k * 1.4}\n" for k in range(4)) + "".join(
    f"EDGE_SE2 {k} {(k + 1) % 4} 1 0 {math.pi / 2} 100 0 0 100 0 400\n" for k in range(4)
)


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_a_row_a_log_and_a_row_a_graph(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    (tmp_path / "square.g2o").write_text(SQUARE)
    assert main([str(DATA / "intel_part.clf.gz"), str(tmp_path / "square.g2o")]) == 0
    lines = capsys.readouterr().out.splitlines()
    log = cells(next(line for line in lines if line.startswith("| intel_part")))
    assert log[1] == "400"
    assert float(log[2].split()[0]) < 0.0229
    assert float(log[3].split()[0]) < 0.453
    graph = cells(next(line for line in lines if line.startswith("| square")))
    assert graph[1:3] == ["4", "4"]
    assert float(graph[4]) == 0.0
    assert "numba" in lines[-1]


@pytest.mark.parametrize("arguments", [[], ["none.log"], ["broken.g2o"]])
def test_mistakes_exit_with_2_and_a_word_of_why(tmp_path: Path, arguments, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.g2o").write_text("VERTEX_SE2 0\n")
    assert mistake(main, arguments, capsys)
