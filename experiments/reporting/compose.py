"""Puts a report together: reads the runs, draws, and writes the page."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from experiments.reporting import page
from experiments.reporting.coverage import bundles
from experiments.reporting.figures import coverage_figure, metres_figure, png
from experiments.reporting.page import Shown
from experiments.sweeping.groups import Group, Naming, group, is_good
from experiments.sweeping.jobs import Row
from experiments.sweeping.runs import Runs
from experiments.sweeping.store import Store
from experiments.sweeping.worst import Badness

PAGE = "index.html"
TABLE_TEXT = """Explored is the share of the area that could be seen at all from where the robot fits.
Honest: the robot's last word agrees with the truth. Point at a column's title for its meaning; the fewest
metres, of those that always came to the end, are bold."""
CURVES_TEXT = """The line is the median run, the band holds the middle half of all runs, the dotted upright
is where the median run ended. On the right what was still unexplored, on a logarithmic scale: the tail is
where explorers differ."""
METRES_TEXT = "One dot a run; the bar spans the middle half, the upright is the median."
FAILURES_TEXT = """Runs that did not end complete, or whose claim to be complete is not true. A recording
opens with <code>rerun recording.rrd</code>; <code>python -m experiments.explore --config config.json</code>
runs the same again."""
WORST_TEXT = """First what failed, then what collided or explored less than 99 %, then what drove most against
the median of its own group."""


def write_report(folders: Sequence[Path], out: Path | None, title: str, worst: int, failures: int) -> Path:
    """Write page and pictures; returns the page's place. ValueError if there is nothing to report."""
    runs = Runs(folders)
    naming = Naming.of(runs)
    groups = group(runs, naming)
    if not groups:
        raise ValueError(f"no run is done yet in {', '.join(map(str, folders))}")
    out = out or runs.folder_of(next(iter(runs))) / "report"
    out.mkdir(parents=True, exist_ok=True)
    people = Lineup(runs, naming, Badness(groups, naming), out)
    sections = [
        page.heading(title, in_short(runs, groups)),
        page.tiles(tiles_of(groups)),
        page.section("By building and way of running", TABLE_TEXT, page.group_table(groups)),
        *drawn(runs, naming, groups, out),
        failure_section(people, sum(not is_good(row) for row in runs), failures),
        worst_section(people, worst),
    ]
    (out / PAGE).write_text(page.page(title, sections))
    return out / PAGE


def in_short(runs: Runs, groups: Sequence[Group]) -> str:
    """One line about what this is."""
    buildings = len({row.get("building_id", row.get("name")) for row in runs})
    code = ", ".join(sorted({row["code"][:8] for row in runs if "code" in row}))
    number = sum(group.runs for group in groups)
    where = ", ".join(str(folder) for folder in runs.folders)
    return f"{number} runs in {buildings} buildings, from {where}" + (f"; code {code}" if code else "")


def tiles_of(groups: Sequence[Group]) -> list[tuple[str, str, str]]:
    """(number, what it is, good or bad) of all runs together."""
    number = sum(group.runs for group in groups)

    def share(count: int, what: str) -> tuple[str, str, str]:
        return f"{count} of {number}", what, "good" if count == number else "bad"

    def together(figure: str) -> np.ndarray:
        return np.concatenate([group[figure] for group in groups])

    tiles = [
        share(sum(g.complete for g in groups), "complete"),
        share(sum(g.honest for g in groups), "honest"),
    ]
    explored, metres, hits, ratio = map(together, ("explored", "metres", "collisions", "ratio"))
    if len(explored):
        tiles.append((f"{np.median(explored):.2%}", "explored, median", ""))
        tiles.append((f"{explored.min():.2%}", "explored, least", ""))
        tiles.append((f"{hits.sum():.0f}", "collisions", "bad" if hits.any() else "good"))
        tiles.append((f"{metres.sum() / 1000.0:.1f} km", "driven, all together", ""))
    if len(ratio):
        tiles.append((f"{np.median(ratio):.2f}", "times the oracle's way, median", ""))
    return tiles


def drawn(runs: Runs, naming: Naming, groups: Sequence[Group], out: Path) -> list[str]:
    """The sections of figures, each a file of its own too; none if no run has a curve."""
    by_kind = bundles(runs, naming)
    if not by_kind:
        return []
    parts = [
        ("coverage.png", coverage_figure(by_kind), "How a building becomes known", CURVES_TEXT),
        ("metres.png", metres_figure(groups), "Metres driven", METRES_TEXT),
    ]
    sections = []
    for name, figure, title, text in parts:
        data = png(figure)
        (out / name).write_bytes(data)
        sections.append(page.section(title, text, page.picture(data, title)))
    return sections


class Lineup:
    """The runs to look at, with their pictures and recordings, the worst first."""

    def __init__(self, runs: Runs, naming: Naming, badness: Badness, out: Path) -> None:
        self._runs, self._naming, self._badness, self._out = runs, naming, badness, out

    def worst(self, number: int) -> list[Shown]:
        """The worst of all."""
        return [self._shown(row) for row in self._badness.worst(self._runs, number)]

    def failures(self, number: int) -> list[Shown]:
        """The worst of those that failed."""
        failed = (row for row in self._runs if not is_good(row))
        return [self._shown(row) for row in self._badness.worst(failed, number)]

    def _shown(self, row: Row) -> Shown:
        folder = self._runs.folder_of(row)
        picture = Store(folder).picture(row["key"]) if "key" in row else b""
        recorded = folder / row["recording"] if "recording" in row else None
        links = {}
        for name in ("recording.rrd", "coverage.png", "config.json"):
            if recorded is not None and (recorded / name).exists():
                links[Path(name).stem] = quote(os.path.relpath(recorded / name, self._out))
        if not links and "config" in row:
            links["config"] = quote(self._config_file(row))
        return Shown(row, self._naming.series(row), self._badness.why(row), picture, links)

    def _config_file(self, row: Row) -> str:
        """Write down how to repeat a run; returns the file's place within the report's folder."""
        file = self._out / "configs" / f"{row['name']}-{row['seed']}-{row['key'][:8]}.json"
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(row["config"], indent=2) + "\n")
        return f"configs/{file.name}"


def failure_section(people: Lineup, total: int, most: int) -> str:
    """What went wrong, if anything."""
    if not total:
        return page.section("Failures", "None: every run is complete and honest.", "")
    shown = people.failures(most)
    return page.section(f"Failures: {total}", FAILURES_TEXT, page.failure_table(shown, total - len(shown)))


def worst_section(people: Lineup, number: int) -> str:
    """Pictures of the runs to look at first."""
    shown = people.worst(number)
    return page.section(f"The worst {len(shown)} runs", WORST_TEXT + page.map_key(), page.gallery(shown))
