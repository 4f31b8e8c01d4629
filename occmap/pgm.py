"""Portable grey maps: the images of Nav2 maps (netpbm formats P5 binary and P2 text)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HEADER = re.compile(rb"(P[25])" + 3 * rb"(?:\s|#[^\n]*\n)+(\d+)" + rb"\s")
"""Magic, width, height and the highest value, with comments between; one blank before the pixels."""


def write_pgm(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write (ny, nx) pixels, 0 black to 255 white, as P5, row 0 at the top of the picture."""
    ny, nx = pixels.shape
    path.write_bytes(f"P5\n{nx} {ny}\n255\n".encode() + np.ascontiguousarray(pixels).tobytes())


def read_pgm(path: Path) -> NDArray[np.float64]:
    """(ny, nx) brightness from 0 black to 1 white, row 0 at the top of the picture.

    ValueError if the file holds no whole image.
    """
    data = path.read_bytes()
    header = HEADER.match(data)
    if header is None:
        raise ValueError(f"{path} is not a PGM image (P2 or P5): it begins with {data[:12]!r}")
    nx, ny, highest = (int(header.group(k)) for k in (2, 3, 4))
    if not (nx > 0 and ny > 0 and 0 < highest < 65536):
        raise ValueError(f"{path} is no image: {nx} x {ny} pixels of values up to {highest}")
    body = data[header.end() :]
    if header.group(1) == b"P2":
        values = np.array(re.sub(rb"#[^\n]*", b"", body).split()[: nx * ny], np.float64)
    else:
        dtype = np.dtype(np.uint8 if highest < 256 else ">u2")
        values = np.frombuffer(body[: len(body) // dtype.itemsize * dtype.itemsize], dtype)[: nx * ny].astype(
            np.float64
        )
    if values.size < nx * ny:
        raise ValueError(f"{path} is cut short: {values.size} of {nx * ny} pixels")
    return values.reshape(ny, nx) / highest
