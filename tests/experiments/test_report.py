"""One page about many runs."""

import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from experiments import config_file
from experiments.config import ExperimentConfig
from experiments.report import main
from experiments.reporting.coverage import Bundle
from experiments.sweep import Sweep, sweep
from experiments.sweeping.matrix import Matrix
from tests.experiments.made_up_runs import failing

VOID = {"meta", "img", "br", "link"}


class Page(HTMLParser):
    """Reads a page; complains of tags that do not close in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[str] = []
        self.links: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        if tag == "img":
            self.images.append(given["src"])
        if tag == "a":
            self.links.append(given["href"])
        assert tag != "link", "the page needs no other file"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def swept(tmp_path) -> Path:
    axes = Matrix(kinds=("maze", "hall"), seeds=(0, 4), strategies=("nearest", "utility"))
    store = sweep(Sweep(out=tmp_path / "sweep", axes=axes), work=failing)
    (stuck, *_) = (row for row in store.rows() if row["status"] == "stuck")
    recording = store.recording_folder(stuck) / "recording.rrd"
    recording.parent.mkdir(parents=True)
    recording.write_bytes(b"")
    sweep(Sweep(out=tmp_path / "sweep", axes=axes), work=failing)  # the results name the recording
    return tmp_path / "sweep"


def test_a_report_is_one_page_that_holds_all_it_shows(swept, capsys):
    assert main([str(swept)]) == 0
    file = Path(capsys.readouterr().out.strip())
    assert file == swept / "report" / "index.html"
    page = Page(file.read_text())
    assert len(page.images) == 2 + 10
    assert all(image.startswith("data:image/png;base64,") for image in page.images)
    text = " ".join(page.texts)
    for expected in (
        "16 runs in 8 buildings",
        "12 of 16",
        "Failures: 4",
        "stuck, 50.00% explored",
        "utility",
    ):
        assert expected in text
    assert (file.parent / "coverage.png").read_bytes().startswith(b"\x89PNG")
    assert (file.parent / "metres.png").read_bytes().startswith(b"\x89PNG")


def test_failures_link_to_their_recordings(swept, tmp_path, capsys):
    assert main([str(swept), "--out", str(tmp_path / "elsewhere")]) == 0
    file = Path(capsys.readouterr().out.strip())
    links = set(Page(file.read_text()).links)
    assert all((file.parent / link).is_file() for link in links)
    assert sum(link.endswith("recording.rrd") for link in links) == 1


def test_what_was_not_recorded_can_be_repeated(swept, capsys):
    assert main([str(swept)]) == 0
    file = Path(capsys.readouterr().out.strip())
    configs = [link for link in Page(file.read_text()).links if link.startswith("configs/")]
    said = json.loads((file.parent / configs[0]).read_text())
    assert config_file.from_plain(ExperimentConfig, said, where="config").seed == said["seed"] == 3


def test_several_sweeps_are_told_apart(swept, tmp_path, capsys):
    other = tmp_path / "other"
    axes = Matrix(kinds=("maze",), seeds=(0, 2), strategies=("nearest",))
    sweep(Sweep(out=other, axes=axes), work=failing)
    assert main([str(swept), str(other), "--worst", "0"]) == 0
    text = " ".join(Page(Path(capsys.readouterr().out.strip()).read_text()).texts)
    assert "nearest, folder sweep" in text
    assert "nearest, folder other" in text


def test_what_holds_no_runs_is_a_mistake(tmp_path, capsys):
    assert main([str(tmp_path / "nowhere")]) == 2
    assert "nowhere" in capsys.readouterr().err
    sweep(Sweep(out=tmp_path), stop=lambda: True)
    assert main([str(tmp_path)]) == 2
    assert "no run" in capsys.readouterr().err


def test_a_run_that_is_over_keeps_what_it_had_explored():
    def curve(end_m: float, explored: float) -> dict:
        values = {"metres": [0.0, end_m], "seconds": [0.0, end_m], "explored": [0.0, explored]}
        return {name: np.array(value, np.float32) for name, value in values.items()}

    bundle = Bundle("maze", "", [curve(10.0, 1.0), curve(20.0, 1.0), curve(40.0, 1.0)])
    low, median, high = bundle.quartiles("metres", np.array([0.0, 20.0, 40.0]))
    assert median == pytest.approx([0.0, 1.0, 1.0])
    assert low == pytest.approx([0.0, 0.75, 1.0])
    assert high == pytest.approx([0.0, 1.0, 1.0])
    assert bundle.end("metres") == 20.0
