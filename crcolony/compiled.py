"""How hot functions are compiled: the only file with the options of numba.

Every small function of the control step is plain, readable Python that numba turns into machine
code; small functions are inlined into the ones that call them, so that composing them costs
nothing. No fast-math: the same seed must give the same history, bit for bit.

Compiled code is cached on disk (`code_cache.py`), in a folder named by a digest of the sources, of
the versions that compile them, and of this machine's processor: a home may be shared by machines,
and an SD card moves. numba itself checks only the file of the outermost function, and would keep
using old code after a change in a function that was inlined.

numba is imported when something has to be compiled or called, not before: it takes half a second
and 100 MB, and a robot's own process does without it (`robot/aot_step.py`).
"""

import functools
import hashlib
import os
import platform
from collections.abc import Callable
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any, Generic, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from crcolony.code_cache import find_folder, guard, share_between_installations

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
AnyFloatArray = NDArray[np.floating[Any]]
"""Weights: 64 bits where a single learner has them, 32 bits where many agents do."""
RowArray = NDArray[np.signedinteger[Any]]
"""Rows of a table, in as few bytes as they need."""

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

COMPILED_SOURCES = (
    "learning",
    "evolution",
    "body",
    "robot",
    "world",
    "experiments/worlds",
    "in_process/colony.py",
    "randomness.py",
    "compiled.py",
)
"""The files, and folders of files, of which compiled code is made."""


def is_compiled_source(module: str) -> bool:
    """Return whether a module, by its full name, is one of these."""
    path = module.removeprefix("crcolony.").replace(".", "/")
    return module.startswith("crcolony.") and any(
        path == name.removesuffix(".py") or path.startswith(f"{name}/") for name in COMPILED_SOURCES
    )


def source_digest(package: Path) -> str:
    """Return a hash of the sources, in a package folder, of which compiled code is made."""
    digest = hashlib.blake2b(digest_size=8)
    for name in COMPILED_SOURCES:
        path = package / name
        for source in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(source.read_bytes())
    return digest.hexdigest()


def machine_digest() -> str:
    """Return a hash of what else decides on machine code: processor, and versions of the compiler."""
    from llvmlite import binding  # type: ignore[import-untyped]

    try:
        features = binding.get_host_cpu_features().flatten()
    except RuntimeError:  # LLVM does not know them for every architecture
        features = ""
    parts = (
        binding.get_process_triple(),
        binding.get_host_cpu_name(),
        features,
        platform.python_version(),
        *map(version, ("numba", "llvmlite", "numpy", "pymunk")),
    )
    return hashlib.blake2b("\n".join(parts).encode(), digest_size=4).hexdigest()


@functools.cache
def cache_folder() -> Path | None:
    """Return the folder of the code that these sources are compiled to on this machine; None if
    none can be kept."""
    return find_folder(f"{source_digest(Path(__file__).parent)}-{machine_digest()}")


def is_first_start() -> bool:
    """Return whether nothing is compiled yet, which will take about a minute."""
    folder = cache_folder()
    return folder is None or not any(folder.iterdir())


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

        folder = cache_folder()
        numba.config.CACHE_DIR = str(folder or "")  # type: ignore[attr-defined]
        options: Any = {"error_model": "numpy", "forceinline": True, "_nrt": False}
        jitted: Any = numba.njit(cache=folder is not None, **options)(self.py_func)
        if folder is not None:
            guard(jitted, folder)
            if is_compiled_source(self.py_func.__module__):
                share_between_installations(jitted, folder)
        compiled_function: Callable[Parameters, Result] = jitted
        return compiled_function

    @property
    def _numba_type_(self) -> Any:
        """The type that numba needs where a compiled function calls this one."""
        return self.dispatcher._numba_type_  # type: ignore[attr-defined]

    def __call__(self, *args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        return self.dispatcher(*args, **kwargs)


def direct(
    function: Callable[Parameters, Result], *examples: Parameters.args, **_: Parameters.kwargs
) -> Callable[Parameters, Result]:
    """Return a compiled function for arguments of the same types as these examples, which it does not check.

    With dozens of arrays the check takes longer than most calls do.
    """
    if not isinstance(function, Compiled):
        return function
    import numba

    dispatcher: Any = function.dispatcher
    types = tuple(map(numba.typeof, examples))
    dispatcher.compile(types)
    entry_point: Callable[Parameters, Result] = dispatcher.overloads[types].entry_point
    return entry_point


def compiled(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Compile `function` with numba, keeping its Python signature for the type checker.

    Compiled functions may not allocate: numba's reference counting is off, which halves the time of
    a tick.
    """
    if is_switched_off():
        return function
    return Compiled(function)


@compiled
def as_index(number: float | np.signedinteger[Any]) -> int:
    """Return a number that is not negative as an index: of a signed one numba checks whether it counts from the end."""
    return np.uint64(number)  # type: ignore[return-value]
