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

    def __init__(self, folders: Sequence[Path], all_parts: bool = False) -> None:
        """folders: as sweeps leave them, or single results.jsonl files. ValueError if one is neither.

        all_parts: not only what the last sweep into a folder asked for, see Store.rows_of_all_parts.
        """
        for folder in folders:
            if not (folder.is_file() or (folder / RESULTS).is_file() or (folder / ASKED).is_file()):
                raise ValueError(f"{folder} is no folder of a sweep: it has no {RESULTS}")
        self.folders = tuple(folders)
        self.all_parts = all_parts
        self.labels = labels(folders)

    def __iter__(self) -> Iterator[Row]:
        for folder, label in zip(self.folders, self.labels, strict=True):
            for row in self._rows(folder):
                if label:
                    row["options"] = {"folder": label} | row.get("options", {})
                yield row

    def _rows(self, folder: Path) -> Iterator[Row]:
        if folder.is_file():
            return read_lines(folder)
        return Store(folder).rows_of_all_parts() if self.all_parts else Store(folder).rows()

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
