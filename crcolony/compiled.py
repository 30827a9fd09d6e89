"""The one place that says how hot functions are compiled.

Every small function of the control step is plain, readable Python that numba turns into machine code; small
functions are inlined into the ones that call them, so that composing them costs nothing. No fast-math: the same
seed must give the same history, bit for bit.

Compiled code is kept on disk, in a folder named by a digest of these sources. numba itself looks only at the file
of the outermost function and would keep running old code after a change in a function that was inlined.

numba is imported when something has to be compiled or called, not before: it takes half a second and 100 MB, and a
robot's own process does without (`robot/ready_made.py`).
"""

import functools
import hashlib
import os
from collections.abc import Callable
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

_HASHED = ("learning", "evolution", "body", "robot", "world")
"""The packages whose code compiled functions are made of, beside `randomness.py` and this file."""


@functools.cache
def cache_folder() -> Path:
    """Return where compiled code is kept."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return Path(os.environ["NUMBA_CACHE_DIR"])
    root = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    digest = hashlib.blake2b(version("numba").encode(), digest_size=8)
    package = Path(__file__).parent
    sources = [source for name in _HASHED for source in (package / name).rglob("*.py")]
    sources += [
        package / "randomness.py",
        package / "compiled.py",
        package / "in_process/colony.py",
    ]
    for source in sorted(sources):
        digest.update(source.read_bytes())
    return Path(root) / "crcolony" / digest.hexdigest()


def is_first_start() -> bool:
    """Tell whether nothing is compiled yet, which will take about half a minute."""
    return not cache_folder().exists()


def is_switched_off() -> bool:
    """Tell whether numba was told to compile nothing (NUMBA_DISABLE_JIT), so that all of this runs as plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


class Compiled(Generic[Parameters, Result]):
    """A function that numba compiles when it is first called, or when a compiled function is that calls it."""

    def __init__(self, function: Callable[Parameters, Result]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

    @cached_property
    def dispatcher(self) -> Callable[Parameters, Result]:
        """What numba makes of the function."""
        import numba

        numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]
        options: Any = {"cache": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
        jitted: Callable[Parameters, Result] = numba.njit(**options)(self.py_func)
        return jitted

    @property
    def _numba_type_(self) -> Any:
        """numba asks for this where a compiled function calls another."""
        return self.dispatcher._numba_type_  # type: ignore[attr-defined]

    def __call__(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        return self.dispatcher(*args, **kwargs)


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` with numba, keeping its Python signature for the type checker.

    Compiled functions may not allocate: numba's reference counting is off, which halves the time of a tick.
    """
    if is_switched_off():
        return function
    return Compiled(function)
