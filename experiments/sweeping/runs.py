"""The results of sweeps, to be read again and again without ever being all in memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from experiments.sweeping.jobs import Row
from experiments.sweeping.store import ASKED, RESULTS, Store, read_lines


class Runs:
    """All runs of one or several sweeps; each iteration reads them anew.

    Where there are several, `options` of each run says which folder it is from, as if that were an option
    like any other.
    """

    def __init__(self, folders: Sequence[Path]) -> None:
        """folders: as sweeps leave them, or single results.jsonl files. ValueError if one is neither."""
        for folder in folders:
            if not (folder.is_file() or (folder / RESULTS).is_file() or (folder / ASKED).is_file()):
                raise ValueError(f"{folder} is no folder of a sweep: it has no {RESULTS}")
        self.folders = tuple(folders)
        self.labels = labels(folders)

    def __iter__(self) -> Iterator[Row]:
        for folder, label in zip(self.folders, self.labels, strict=True):
            rows = read_lines(folder) if folder.is_file() else Store(folder).rows()
            for row in rows:
                if label:
                    row["options"] = {"folder": label} | row.get("options", {})
                yield row

    def folder_of(self, row: Row) -> Path:
        """The folder that a run lies in."""
        folder = self.folders[self.labels.index(row.get("options", {}).get("folder", ""))]
        return folder.parent if folder.is_file() else folder


def labels(folders: Sequence[Path]) -> list[str]:
    """As much of each path's end as tells them apart; nothing where there is but one."""
    if len(folders) < 2:
        return [""] * len(folders)
    parts = [folder.resolve().parts for folder in folders]
    depth = 1
    while len({part[-depth:] for part in parts}) < len(set(parts)):
        depth += 1
    return ["/".join(part[-depth:]) for part in parts]
