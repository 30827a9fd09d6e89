"""How hot functions are compiled: the only file with the options of numba.

Every small function of the control step is plain, readable Python that numba turns into machine
code; small functions are inlined into the ones that call them, so that composing them costs
nothing. No fast-math: the same seed must give the same history, bit for bit.

Compiled code is cached on disk, in a folder named by a digest of the sources. numba itself checks
only the file of the outermost function, and would keep using old code after a change in a function
that was inlined.

numba is imported when something has to be compiled or called, not before: it takes half a second
and 100 MB, and a robot's own process does without it (`robot/aot_step.py`).
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

COMPILED_SOURCES = (
    "learning",
    "evolution",
    "body",
    "robot",
    "world",
    "in_process/colony.py",
    "randomness.py",
    "compiled.py",
)
"""The files, and folders of files, of which compiled code is made."""


def source_digest(package: Path) -> str:
    """Return a hash of the sources, in a package folder, of which compiled code is made, and of
    numba's version."""
    digest = hashlib.blake2b(version("numba").encode(), digest_size=8)
    for name in COMPILED_SOURCES:
        path = package / name
        for source in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(source.read_bytes())
    return digest.hexdigest()


@functools.cache
def cache_folder() -> Path:
    """Return the folder of compiled code: in NUMBA_CACHE_DIR, or else in the user's cache, one for
    every digest."""
    root = os.environ.get("NUMBA_CACHE_DIR")
    if not root:
        cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        root = str(Path(cache) / "crcolony")
    return Path(root) / source_digest(Path(__file__).parent)


def is_first_start() -> bool:
    """Return whether nothing is compiled yet, which will take about half a minute."""
    return not cache_folder().exists()


def is_switched_off() -> bool:
    """Return whether NUMBA_DISABLE_JIT is set, so that all of this runs as plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


class Compiled(Generic[Parameters, Result]):
    """A function that numba compiles when it, or a compiled function that calls it, is first
    called."""

    def __init__(self, function: Callable[Parameters, Result]) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function

    @cached_property
    def dispatcher(self) -> Callable[Parameters, Result]:
        """The function as numba has compiled it."""
        import numba

        numba.config.CACHE_DIR = str(cache_folder())  # type: ignore[attr-defined]
        options: Any = {"cache": True, "error_model": "numpy", "forceinline": True, "_nrt": False}
        jitted: Callable[Parameters, Result] = numba.njit(**options)(self.py_func)
        return jitted

    @property
    def _numba_type_(self) -> Any:
        """The type that numba needs where a compiled function calls this one."""
        return self.dispatcher._numba_type_  # type: ignore[attr-defined]

    def __call__(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        return self.dispatcher(*args, **kwargs)


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` with numba, keeping its Python signature for the type checker.

    Compiled functions may not allocate: numba's reference counting is off, which halves the time of
    a tick.
    """
    if is_switched_off():
        return function
    return Compiled(function)
