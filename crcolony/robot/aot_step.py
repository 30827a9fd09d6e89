"""The control step compiled ahead of time: a robot's own process needs no compiler and no wait.

numba compiles `step.step_robot` once for this machine; its object code is stored beside numba's own
cache. A process that finds it there loads it with llvmlite alone, without importing numba. All
arrays are passed as one table of addresses and shapes, which is made once. The code is the same, so
both ways give the same robots, bit for bit.
"""

import ctypes
import ctypes.util
import hashlib
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from crcolony.body.contract import ACTION_WIDTH, OBSERVATION_WIDTH
from crcolony.compiled import FloatArray, cache_folder, is_switched_off
from crcolony.robot.state import Robots, StepParameters
from crcolony.robot.step import step_robot

Step = Callable[[int, FloatArray, FloatArray], None]
"""Advances robot i of a batch by one control step: reads an observation, writes an action."""

_POINTERS = {"float64": "float_pointer", "int64": "int_pointer", "uint64": "word_pointer"}
"""Names, in the generated source, of the functions that turn an address into a pointer."""
_UNREACHABLE = ("numba_gil_ensure", "numba_gil_release", "NRT_MemInfo_call_dtor")
"""Functions of numba that the machine code would call if the step raised an exception, which it
cannot."""
_owners: list[Any] = []
"""Owners of loaded machine code, which have to outlive every call."""


def load_step(robots: Robots, parameters: StepParameters) -> Step:
    """Return the control step of these robots as machine code, which is compiled first if there is
    none yet."""
    if is_switched_off():
        return lambda i, observation, action: step_robot(robots, parameters, i, observation, action)
    layout = _layout(robots, parameters)
    path = _path(layout)
    if not path.exists():
        _compile(path, layout)
    return _bind(_load(path), robots, parameters)


def _layout(robots: Robots, parameters: StepParameters) -> tuple[tuple[str, str, str, int], ...]:
    """Return class, name, type and dimensions of every field: all that the machine code depends
    on."""
    return tuple(
        (type(owner).__name__, name, value.dtype.name, value.ndim)
        for owner in (robots, parameters)
        for name, value in zip(owner._fields, map(np.asarray, owner), strict=True)
    )


def _path(layout: Sequence[tuple[str, str, str, int]]) -> Path:
    """Return the file of the machine code for this machine and layout."""
    from llvmlite import binding  # type: ignore[import-untyped]

    machine = (
        f"{sys.platform} {binding.get_host_cpu_name()} {binding.get_host_cpu_features().flatten()}"
    )
    digest = hashlib.blake2b(f"{machine}\n{layout}".encode(), digest_size=8).hexdigest()
    return cache_folder() / f"step-{digest}.o"


def _bind(code: Any, robots: Robots, parameters: StepParameters) -> Step:
    """Return the step over these arrays, which it keeps alive."""
    table = _table(robots, parameters)
    observed, acted = np.zeros(OBSERVATION_WIDTH), np.zeros(ACTION_WIDTH)
    addresses = (table.ctypes.data, observed.ctypes.data, acted.ctypes.data)

    def step(i: int, observation: FloatArray, action: FloatArray) -> None:
        observed[:] = observation
        code(addresses[0], i, addresses[1], addresses[2])
        action[:] = acted

    step.owners = (table, robots, parameters)  # type: ignore[attr-defined]
    return step


def _table(*owners: Robots | StepParameters) -> np.ndarray:
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


def _load(path: Path) -> Any:
    """Load machine code; the code for another machine has another file name."""
    from llvmlite import binding

    entry, _, code = path.read_bytes().partition(b"\n")
    binding.load_library_permanently(ctypes.util.find_library("m"))  # for exp()
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
    words = (ctypes.c_uint64, ctypes.c_int64, ctypes.c_uint64, ctypes.c_uint64)
    return ctypes.CFUNCTYPE(None, *words)(engine.get_function_address(entry.decode()))


def _compile(path: Path, layout: Sequence[tuple[str, str, str, int]]) -> None:
    """Compile the step with numba, and write its object code, whole or not at all."""
    import numba
    from numba import types

    signature = types.void(types.uint64, types.int64, types.uint64, types.uint64)
    function = numba.cfunc(signature, error_model="numpy")(_entry(layout))
    library: Any = function._library  # type: ignore[attr-defined]
    _, _, (code, *_) = library.serialize_using_object_code()
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f"{path.name}.{os.getpid()}.part")
    draft.write_bytes(function.native_name.encode() + b"\n" + code)
    draft.replace(path)


def _entry(layout: Sequence[tuple[str, str, str, int]]) -> Callable[..., None]:
    """Return the function that reads robots and parameters from the table and calls
    `step_robot`."""
    fields: dict[str, list[str]] = {"Robots": [], "StepParameters": []}
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
def entry(address, i, observation, action):
    table = carray(word_pointer(address), ({at},))
    robots = Robots({", ".join(fields["Robots"])})
    parameters = StepParameters({", ".join(fields["StepParameters"])})
    observed = carray(float_pointer(observation), ({OBSERVATION_WIDTH},))
    acted = carray(float_pointer(action), ({ACTION_WIDTH},))
    step_robot(robots, parameters, i, observed, acted)
"""
    names = {
        "Robots": Robots,
        "StepParameters": StepParameters,
        "step_robot": step_robot,
        **_pointers(),
    }
    exec(source, names)
    entry: Callable[..., None] = names["entry"]
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
        "int_pointer": pointer_to(types.int64, ir.IntType(64)),
        "word_pointer": pointer_to(types.uint64, ir.IntType(64)),
    }
