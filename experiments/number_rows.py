"""Text files of numbers, a row a line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SHOWN = 40
"""Of a line that does not fit, so many letters are quoted."""


def read_rows(path: Path, columns: int, what: str) -> NDArray[np.float64]:
    """(n, columns) at least one row, without blank lines and `#` comments.

    ValueError if this is not `what` it should be; it names the first line that does not fit.
    """
    try:
        lines = path.read_text().splitlines()
    except OSError as error:
        raise ValueError(f"cannot read the {what} {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no {what}: it is no text") from error
    rows: list[list[float]] = []
    for number, line in enumerate(lines, start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            words = []
        if len(words) != columns:
            got = repr(line.strip()[:SHOWN])
            raise ValueError(f"{path} is no {what}: line {number} must hold {columns} numbers, got {got}")
    if not rows:
        raise ValueError(f"{path} is no {what}: it holds no numbers")
    return np.array(rows, np.float64)
