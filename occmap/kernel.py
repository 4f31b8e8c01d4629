"""How kernels are compiled: when they are first called, and then kept on disk.

What compiling costs goes by the number of functions more than by their length: about 40 ms each. So do
numba's own: `min`, `max` and `np.empty` are compiled once for each set of types and of options below, `**`
and `reshape` take longer still, and `math`'s functions half of what `np`'s do.
"""

import os
from typing import Any

# numba colours the messages of all errors, also of the thousands that it drops while it tries signatures
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

from numba import njit

OPTIONS: dict[str, Any] = {"cache": True, "no_cfunc_wrapper": True}
"""Without the wrapper for callers in C, of whom there are none."""

kernel = njit(**OPTIONS)
fast_kernel = njit(**OPTIONS, fastmath=True, error_model="numpy")
"""The same where sums may be added up in any order, and divisions by zero are guarded against."""
part = njit(**OPTIONS, inline="always")
"""A part of one kernel, compiled within it where it is called and not on its own as well."""
