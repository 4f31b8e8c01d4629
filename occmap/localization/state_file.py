"""A SlamLocalizer in one file: submaps, graph, track and mapped scans, to be continued or localised in.

What is read back goes on exactly as the one that was written would have. The file is a compressed
pickle, read by an unpickler that knows nothing but this package's classes and NumPy's arrays, so that
a file from a stranger can do no harm.
"""

from __future__ import annotations

import copyreg
import gzip
import io
import pickle
import zlib
from pathlib import Path
from typing import Any

from occmap.localization.pose_graph import PoseGraph
from occmap.localization.slam import SlamLocalizer
from occmap.mapper import Mapper

MAGIC = b"occmap slam state 7\n"

KNOWN = {
    ("collections", "OrderedDict"),
    ("collections", "deque"),
    ("copyreg", "__newobj__"),
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
}


def save(path: Path, slam: SlamLocalizer) -> None:
    """Write all that the localizer knows. It may go on afterwards."""
    payload = io.BytesIO()
    _Writer(payload, protocol=5).dump(slam)
    with open(path, "wb") as file:
        file.write(MAGIC)
        file.write(gzip.compress(payload.getvalue(), compresslevel=1, mtime=0))


def load(path: Path) -> SlamLocalizer:
    """The localizer as it was saved. ValueError if the file is not one of ours."""
    content = Path(path).read_bytes()
    if not content.startswith(MAGIC):
        raise ValueError(
            f"{path} is not a saved SLAM state of this version: it does not begin with {MAGIC!r}"
        )
    try:
        slam = _Reader(io.BytesIO(gzip.decompress(content[len(MAGIC) :]))).load()
    except (pickle.UnpicklingError, EOFError, OSError, AttributeError, zlib.error) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    if not isinstance(slam, SlamLocalizer):
        raise ValueError(f"{path} holds a {type(slam).__name__}, not a SlamLocalizer")
    slam.told.hand_over()
    return slam


class _Writer(pickle.Pickler):
    """Leaves out what is made again at once: kernels, work space, factorisations."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, Mapper):
            return Mapper, (obj.config,)
        if isinstance(obj, PoseGraph):
            return copyreg.__newobj__, (PoseGraph,), obj.__dict__ | {"_equations": None}  # type: ignore[attr-defined]
        return NotImplemented


class _Reader(pickle.Unpickler):
    """Loads a class only from the module that defines it.

    A dotted name, or one that a module merely imported, could reach any object in Python.
    """

    def find_class(self, module_name: str, global_name: str, /) -> Any:
        if (module_name, global_name) in KNOWN:
            return super().find_class(module_name, global_name)
        if module_name.startswith("occmap.") and "." not in global_name:
            found = super().find_class(module_name, global_name)
            if isinstance(found, type) and found.__module__ == module_name:
                return found
        raise pickle.UnpicklingError(f"it names {module_name}.{global_name}, which no saved state does")
