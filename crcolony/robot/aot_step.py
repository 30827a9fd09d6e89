"""The control step compiled ahead of time: a robot's own process needs no compiler and no wait.

numba compiles `paged_step.step_page` once for this machine; its object code is stored beside
numba's own cache, behind a line with the name of its function and a digest, by which a damaged file
is known. A process that finds it there loads it with llvmlite alone, without importing numba. All
arrays are passed as one table of addresses and shapes, which is made once: a call passes two
numbers. The code is the same, so both ways give the same robots, bit for bit.
"""

import contextlib
import ctypes
import ctypes.util
import functools
import hashlib
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.body.shared_pages import Page, new_page
from crcolony.compiled import cache_folder, is_switched_off
from crcolony.robot.paged_step import step_page
from crcolony.robot.state import Robots, StepParameters

PagedStep = Callable[[int, int], int]
"""`step_page` of some robots and a page: for robot i and a tick, or `NOTHING`"""

_POINTERS = {
    "float64": "float_pointer",
    "float32": "single_pointer",
    "int64": "int_pointer",
    "int32": "long_row_pointer",
    "int16": "row_pointer",
    "uint64": "word_pointer",
}
"""Names, in the generated source, of the functions that turn an address into a pointer."""
_UNREACHABLE = ("numba_gil_ensure", "numba_gil_release", "NRT_MemInfo_call_dtor")
"""Functions of numba that the machine code would call if the step raised an exception, which it
cannot."""
_owners: list[Any] = []
"""Owners of loaded machine code, which have to outlive every call."""


def load_step(robots: Robots, parameters: StepParameters, page: Page | None = None) -> PagedStep:
    """Return the control step of these robots, on a page or a new one, as machine code, which is
    compiled first if there is none yet."""
    page = page or new_page()
    if is_switched_off():
        return lambda i, tick: step_page(robots, parameters, page, i, tick)
    path = machine_code_path(robots, parameters)
    entry, code = (path and _read(path)) or _compile(_layout(robots, parameters, page))
    if path is not None and not path.exists():
        _write(path, entry, code)
    return _bind(_link(entry, code), robots, parameters, page)


def machine_code_path(robots: Robots, parameters: StepParameters) -> Path | None:
    """Return the file of the machine code for these robots, which may not exist yet; None if
    nothing is compiled, or nothing can be kept."""
    folder = None if is_switched_off() else cache_folder()
    if folder is None:
        return None
    layout = str(_layout(robots, parameters, new_page()))
    return folder / f"step-{hashlib.blake2b(layout.encode(), digest_size=8).hexdigest()}.o"


def _layout(*owners: Robots | StepParameters | Page) -> tuple[tuple[str, str, str, int], ...]:
    """Return class, name, type and dimensions of every field: all that the machine code depends
    on."""
    return tuple(
        (type(owner).__name__, name, value.dtype.name, value.ndim)
        for owner in owners
        for name, value in zip(owner._fields, map(np.asarray, owner), strict=True)
    )


def _read(path: Path) -> tuple[bytes, bytes] | None:
    """Return the name of the function and the object code of a file; None if it is missing, or
    damaged, and then deleted."""
    try:
        head, _, code = path.read_bytes().partition(b"\n")
        entry, _, digest = head.partition(b" ")
        if digest == _digest(code):
            return entry, code
        path.unlink()
    except OSError:
        pass
    return None


def _write(path: Path, entry: bytes, code: bytes) -> None:
    """Write a file as a whole or not at all; if that is impossible, each start compiles."""
    draft = path.with_name(f"{path.name}.{os.getpid()}.part")
    with contextlib.suppress(OSError):
        try:
            draft.write_bytes(entry + b" " + _digest(code) + b"\n" + code)
            draft.replace(path)
        finally:
            draft.unlink(missing_ok=True)


def _digest(code: bytes) -> bytes:
    return hashlib.blake2b(code, digest_size=16).hexdigest().encode()


def _bind(code: Any, robots: Robots, parameters: StepParameters, page: Page) -> PagedStep:
    """Return the step over these arrays, which it keeps alive."""
    table = _table(robots, parameters, page)
    address: int = table.ctypes.data

    def step(i: int, tick: int) -> int:
        events: int = code(address, i, tick)
        return events

    step.owners = (table, robots, parameters, page)  # type: ignore[attr-defined]
    return step


def _table(*owners: Robots | StepParameters | Page) -> np.ndarray:
    """Return all fields as words: the address and shape of an array, or the bits of a number."""
    words: list[int] = []
    for owner in owners:
        for value in owner:
            if isinstance(value, np.ndarray):
                assert value.flags.c_contiguous, "the machine code has no strides"
                words += [value.ctypes.data, *value.shape]
            elif isinstance(value, int | np.integer):
                words.append(int(value) & (2**64 - 1))
            else:
                words.append(int(np.float64(value).view(np.uint64)))
    return np.array(words, dtype=np.uint64)


@functools.cache
def math_library() -> str:
    """Return the name of the C library's functions of mathematics; where no tool can search for it, as in a small
    container, that of Linux."""
    return ctypes.util.find_library("m") or "libm.so.6"


def _link(entry: bytes, code: bytes) -> Any:
    """Return the function of this name of object code for this machine, of which one is enough for
    all robots of a process."""
    from llvmlite import binding  # type: ignore[import-untyped]

    binding.load_library_permanently(math_library())  # for exp()
    for name in _UNREACHABLE:
        if binding.address_of_symbol(name) is None:
            binding.add_symbol(name, binding.address_of_symbol("abort"))
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    target = binding.Target.from_default_triple()
    module = binding.parse_assembly("")
    module.triple = target.triple
    machine = target.create_target_machine(jit=True, codemodel="jitdefault")
    engine = binding.create_mcjit_compiler(module, machine)
    content = binding.ObjectFileRef.from_data(code)
    engine.add_object_file(content)
    engine.finalize_object()
    _owners.extend((engine, module, machine, content, code))
    words = (ctypes.c_uint64, ctypes.c_int64, ctypes.c_int64)
    return ctypes.CFUNCTYPE(ctypes.c_int64, *words)(engine.get_function_address(entry.decode()))


def _compile(layout: Sequence[tuple[str, str, str, int]]) -> tuple[bytes, bytes]:
    """Compile the step with numba; return the name of its function and its object code."""
    import numba
    from numba import types

    signature = types.int64(types.uint64, types.int64, types.int64)
    function = numba.cfunc(signature, error_model="numpy")(_entry(layout))
    library: Any = function._library  # type: ignore[attr-defined]
    _, _, (code, *_) = library.serialize_using_object_code()
    return function.native_name.encode(), code


def _entry(layout: Sequence[tuple[str, str, str, int]]) -> Callable[..., int]:
    """Return the function that reads robots, parameters and page from the table and calls
    `step_page`."""
    fields: dict[str, list[str]] = {"Robots": [], "StepParameters": [], "Page": []}
    at = 0
    for owner, name, dtype, dimensions in layout:
        if dimensions:
            shape = "".join(f"int64(table[{at + 1 + axis}])," for axis in range(dimensions))
            value = f"carray({_POINTERS[dtype]}(table[{at}]), ({shape}))"
        elif dtype == "float64":
            value = f"carray(float_pointer(address + uint64({8 * at})), (1,))[0]"
        else:
            value = f"int64(table[{at}])"
        fields[owner].append(f"{name}={value}")
        at += 1 + dimensions
    source = f"""
def entry(address, i, tick):
    table = carray(word_pointer(address), ({at},))
    robots = Robots({", ".join(fields["Robots"])})
    parameters = StepParameters({", ".join(fields["StepParameters"])})
    page = Page({", ".join(fields["Page"])})
    return step_page(robots, parameters, page, i, tick)
"""
    names = {
        "Robots": Robots,
        "StepParameters": StepParameters,
        "Page": Page,
        "step_page": step_page,
        **_pointers(),
    }
    exec(source, names)
    entry: Callable[..., int] = names["entry"]
    return entry


def _pointers() -> dict[str, Any]:
    """Return the names that the generated source uses: numba's functions for pointers and
    arrays."""
    from llvmlite import ir
    from numba import carray, types  # type: ignore[attr-defined]
    from numba.extending import intrinsic

    def pointer_to(numba_type: Any, llvm_type: Any) -> Any:
        @intrinsic
        def pointer(_context: Any, address: Any) -> Any:
            def generate(_: Any, builder: Any, __: Any, arguments: Any) -> Any:
                return builder.inttoptr(arguments[0], llvm_type.as_pointer())

            pointer_type: Any = types.CPointer(numba_type)  # type: ignore[no-untyped-call]
            return pointer_type(types.uint64), generate

        return pointer

    return {
        "carray": carray,
        "int64": np.int64,
        "uint64": np.uint64,
        "float_pointer": pointer_to(types.float64, ir.DoubleType()),
        "single_pointer": pointer_to(types.float32, ir.FloatType()),
        "int_pointer": pointer_to(types.int64, ir.IntType(64)),
        "long_row_pointer": pointer_to(types.int32, ir.IntType(32)),
        "row_pointer": pointer_to(types.int16, ir.IntType(16)),
        "word_pointer": pointer_to(types.uint64, ir.IntType(64)),
    }
