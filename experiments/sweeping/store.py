"""A sweep's folder. Each run is a file of its own, written aside and renamed: it is there whole or not.

runs/3f/3fa2....json     a run's result           runs/3f/3fa2....png   its map, small
runs/3f/3fa2....failed   of one that crashed: it is run again by the next sweep
runs/3f/3fa2....more     what others found out about the run later
results.jsonl            the results of the last sweep, a line each, in the order of its matrix
table.csv, table.txt     the same as columns; by kind and strategy
sweep.json               what was asked for, and which code answered
recordings/              runs that were recorded
"""

from __future__ import annotations

import json
import os
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from experiments.sweeping.jobs import CRASHED, Result, Row, experiment_of

RESULTS, TABLE, SHEET, ASKED, RUNS, RECORDINGS = (
    "results.jsonl",
    "table.txt",
    "table.csv",
    "sweep.json",
    "runs",
    "recordings",
)
IDENTIFYING = ("key", "name", "seed", "status")
"""What every result has, also that of a run that crashed."""


class Store:
    """Results by key. Any number of processes may write to one folder at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @staticmethod
    def create(folder: Path) -> Store:
        """Make the folder, or go on with one that a sweep left; ValueError if it cannot be written to."""
        try:
            (folder / RUNS).mkdir(parents=True, exist_ok=True)
            is_writable = os.access(folder, os.W_OK | os.X_OK)
        except OSError as error:
            raise ValueError(f"cannot write to --out {folder}: {error.strerror}") from error
        if not is_writable:
            raise ValueError(f"cannot write to --out {folder}: permission denied")
        if (folder / RESULTS).exists() and not (folder / ASKED).exists():
            raise ValueError(f"--out {folder} holds results that no sweep of this kind wrote: choose another")
        return Store(folder)

    def has(self, key: str) -> bool:
        """Whether this run is done."""
        return self._file(key, ".json").exists()

    def read(self, key: str) -> Row | None:
        """The result of a run, also of one that crashed; None if it has not been run."""
        for suffix in (".json", ".failed"):
            file = self._file(key, suffix)
            try:
                return result_in(file.read_text(), str(file)) | self._more(key)
            except FileNotFoundError:
                continue
        return None

    def add(self, key: str, fields: Row) -> None:
        """Add to a run's result what was found out about it later, such as how long its way had to be."""
        write_aside(self._file(key, ".more"), json.dumps(self._more(key) | fields, allow_nan=False).encode())

    def write(self, result: Result) -> None:
        """Keep a result. A crash does not replace a success, a success replaces a crash."""
        key, has_crashed = result.row["key"], result.row["status"] == CRASHED
        self._file(key, "").parent.mkdir(exist_ok=True)
        if result.picture:
            write_aside(self._file(key, ".png"), result.picture)
        text = json.dumps(result.row, allow_nan=False)
        write_aside(self._file(key, ".failed" if has_crashed else ".json"), text.encode())
        if not has_crashed:
            self._file(key, ".failed").unlink(missing_ok=True)

    def picture(self, key: str) -> bytes:
        """The small PNG of a run's map; empty if there is none."""
        file = self._file(key, ".png")
        return file.read_bytes() if file.exists() else b""

    def rows(self) -> Iterator[Row]:
        """The results of the last sweep; while that is still running, all that are there."""
        try:
            for row in read_lines(self.folder / RESULTS):
                yield row | self._more(row["key"])
            return
        except FileNotFoundError:  # it is still running, or another shard has just begun
            pass
        code = self._code()
        yield from (row for row in map(self.read, self._keys()) if row is not None and row["code"] == code)

    def _code(self) -> str:
        """Which code the last sweep ran."""
        file = self.folder / ASKED
        try:
            return json.loads(file.read_text())["code"]
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise ValueError(f"{file} does not say which code a sweep ran: no sweep wrote it") from error

    def rows_of_all_parts(self) -> Iterator[Row]:
        """The results of the last sweep, and then those of earlier ones of the same code and experiment, but
        for other seeds, buildings or options that it told its runs apart by."""
        seen, experiments = set(), set()
        for row in self.rows():
            seen.add(row["key"])
            experiments.add(experiment_of(row))
            yield row
        for row in map(self.read, self._keys()):
            if row is not None and row["key"] not in seen and experiment_of(row) in experiments:
                yield row

    def _keys(self) -> Iterator[str]:
        """Of all runs, sorted."""
        for shelf in sorted((self.folder / RUNS).glob("*")):
            yield from sorted({file.stem for file in shelf.iterdir() if file.suffix in (".json", ".failed")})

    def ask(self, asked: dict[str, Any]) -> None:
        """Begin a sweep: note what is asked for. What was gathered from the last one no longer holds."""
        write_aside(self.folder / ASKED, (json.dumps(asked, indent=2) + "\n").encode())
        for name in (RESULTS, TABLE, SHEET):
            (self.folder / name).unlink(missing_ok=True)

    def gather(self, keys: Iterable[str]) -> None:
        """Write results.jsonl: of these runs those that are done."""
        rows = (row for row in map(self.read, keys) if row is not None)
        lines = (json.dumps(row | self._recording(row), allow_nan=False) for row in rows)
        write_lines(self.folder / RESULTS, lines)

    def recording_folder(self, row: Row) -> Path:
        """Where the recording of a run goes."""
        return self.folder / RECORDINGS / f"{row['name']}-{row['seed']}-{row['key'][:8]}"

    def _recording(self, row: Row) -> Row:
        """Names the folder of a run's recording, from the sweep's, if it was kept."""
        folder = self.recording_folder(row)
        kept = (folder / "recording.rrd").exists()
        return {"recording": str(folder.relative_to(self.folder))} if kept else {}

    def _more(self, key: str) -> Row:
        """What was added to a result later."""
        try:
            return json.loads(self._file(key, ".more").read_text())
        except FileNotFoundError:
            return {}

    def _file(self, key: str, suffix: str) -> Path:
        return self.folder / RUNS / key[:2] / f"{key}{suffix}"


def read_lines(file: Path) -> Iterator[Row]:
    """The rows of a results.jsonl."""
    with file.open() as lines:
        for number, line in enumerate(lines, start=1):
            yield result_in(line, f"{file}, line {number},")


def result_in(text: str, where: str) -> Row:
    """A result as it was written; ValueError tells where something else stands."""
    try:
        row = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"{where} is no result: {error}") from error
    missing = [name for name in IDENTIFYING if not (isinstance(row, dict) and name in row)]
    if missing:
        raise ValueError(f"{where} is no result: it has no {', '.join(missing)}")
    return row


@contextmanager
def aside(file: Path) -> Iterator[Path]:
    """A name beside the file that nobody else writes to, renamed at the end: nobody ever reads half of it."""
    beside = file.with_name(f".{file.name}.{uuid.uuid4().hex[:8]}")
    yield beside
    beside.replace(file)


def write_aside(file: Path, data: bytes) -> None:
    """The whole file at once."""
    with aside(file) as beside:
        beside.write_bytes(data)


def write_lines(file: Path, lines: Iterable[str]) -> None:
    """Line by line."""
    with aside(file) as beside, beside.open("w") as out:
        for line in lines:
            out.write(line + "\n")
