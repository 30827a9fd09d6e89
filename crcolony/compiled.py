"""The one place that says how hot functions are compiled.

Every small function of the control step is plain, readable Python that numba turns into machine code; small
functions are inlined into the ones that call them, so that composing them costs nothing. No fast-math: the same
seed must give the same history, bit for bit.

Compiled code is kept on disk, in a folder named by a digest of these sources. numba itself looks only at the file
of the outermost function and would keep running old code after a change in a function that was inlined.
"""

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


_UNCOMPILED = ("colony", "processes", "experiments")
"""Folders whose files matter to compiled code only if they hold some themselves."""


def _cache_folder() -> Path:
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.blake2b(numba.__version__.encode(), digest_size=8)
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        content = source.read_bytes()
        if b"@compiled" in content or source.parent.name not in _UNCOMPILED:
            digest.update(content)
    return Path(root) / "crcolony" / digest.hexdigest()


if not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(_cache_folder())  # type: ignore[attr-defined]


def is_first_start() -> bool:
    """Tell whether nothing is compiled yet, which will take about half a minute."""
    return not Path(numba.config.CACHE_DIR).exists()  # type: ignore[attr-defined]


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` with numba, keeping its Python signature for the type checker.

    Compiled functions may not allocate: numba's reference counting is off, which halves the time of a tick.
    """
    options: Any = {"cache": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
    jitted: Callable[Parameters, Result] = numba.njit(**options)(function)
    return jitted
