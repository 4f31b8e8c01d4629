"""A sweep's results as a table for people (text) and as one for programs (CSV)."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from experiments.sweeping.groups import Group, columns_for
from experiments.sweeping.jobs import Row
from experiments.sweeping.store import aside

COUNTED = ("unknown_left",)
"""Lists of which a table holds the length."""
LEFT_OUT = ("curve", "config")


def text_table(groups: Sequence[Group]) -> str:
    """One line per kind and series: medians, and the worst where that is what counts."""
    columns = columns_for(groups)
    series = max((len(group.series) for group in groups), default=0) + 2
    kind = max((len(group.kind) for group in groups), default=0) + 2
    lines = [" " * (kind + series) + "".join(f"{column.title:>10}" for column in columns)]
    for group in groups:
        head = f"{group.kind:<{kind}}{group.series:<{series}}"
        if group.crashed == group.runs:
            lines.append(f"{head}{group.runs:>10}  all crashed")
        else:
            lines.append(head + "".join(f"{column.text(group):>10}" for column in columns))
    return "\n".join(lines)


def write_csv(rows: Callable[[], Iterable[Row]], file: Path) -> None:
    """One line per run, a column per value, nested names joined by dots. Reads the rows twice."""
    names = list(dict.fromkeys(name for row in rows() for name, _ in flat(row)))
    with aside(file) as beside, beside.open("w", newline="") as out:
        # meanwhile another shard may have added a run with more columns: its own table will have them
        writer = csv.DictWriter(out, names, restval="", extrasaction="ignore")
        writer.writeheader()
        for row in rows():
            writer.writerow(dict(flat(row)))


def flat(row: Row, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """(dotted name, value) of every single value; None is left out, so that its cell is empty."""
    for name, value in row.items():
        if isinstance(value, dict) and name not in LEFT_OUT:
            yield from flat(value, f"{prefix}{name}.")
        elif name in COUNTED:
            yield f"{prefix}{name}", len(value)
        elif value is not None and name not in LEFT_OUT:
            yield f"{prefix}{name}", " ".join(map(str, value)) if isinstance(value, list) else value
