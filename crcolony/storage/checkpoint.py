"""A checkpoint: a saved state in one file, with its arrays by path and everything else as MessagePack."""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
import numpy as np

_REST = "rest"
"""The entry of everything that is not an array."""
_MIN_SPARSE_SIZE = 10_000
"""Smaller arrays are stored as they are."""
_MAX_NONZERO = 0.4
"""An array with a smaller share of non-zero numbers is stored without its zeros: most weights have never changed."""


class CheckpointError(Exception):
    """A checkpoint is damaged, or not a checkpoint."""


def write_checkpoint(file: BinaryIO, state: Mapping[str, Any]) -> None:
    """Write a tree of dicts, lists, numbers, texts and arrays."""
    arrays: dict[str, np.ndarray] = {}
    rest = _extract_arrays(state, "", arrays)
    arrays[_REST] = np.frombuffer(msgspec.msgpack.encode(rest), dtype=np.uint8)
    np.savez(file, **arrays)  # type: ignore[arg-type]


def read_checkpoint(source: Path | BinaryIO) -> dict[str, Any]:
    """Read what `write_checkpoint` wrote; raises FileNotFoundError, or CheckpointError for damaged bytes."""
    try:
        opened = source.open("rb") if isinstance(source, Path) else nullcontext(source)
        with opened as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        saved: dict[str, Any] = _insert_arrays(
            msgspec.msgpack.decode(arrays.pop(_REST).tobytes()), arrays
        )
    except FileNotFoundError:
        raise
    except Exception as error:  # zipfile and numpy raise nearly anything for damaged bytes
        raise CheckpointError(str(error)) from None
    return saved


def _extract_arrays(tree: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    """Move every array of a tree into `arrays` and return the tree with each one's path in its place."""
    if isinstance(tree, np.ndarray):
        return _extract_array(tree, path, arrays)
    if isinstance(tree, Mapping):
        return {key: _extract_arrays(value, f"{path}.{key}", arrays) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_extract_arrays(value, f"{path}.{k}", arrays) for k, value in enumerate(tree)]
    return tree


def _extract_array(array: np.ndarray, path: str, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Move an array into `arrays`; a large one that is mostly zero as indices and values of the other numbers."""
    if array.size >= _MIN_SPARSE_SIZE:
        indices = np.flatnonzero(array.ravel().view(f"u{array.itemsize}"))  # -0.0 is not zero here
        if indices.size < _MAX_NONZERO * array.size:
            arrays[f"{path}@"], arrays[path] = indices, array.ravel()[indices]
            return {"sparse": path, "shape": list(array.shape)}
    arrays[path] = array
    return {"array": path}


def _insert_arrays(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(tree, dict):
        if set(tree) == {"array"}:
            return arrays[tree["array"]]
        if set(tree) == {"sparse", "shape"}:
            values = arrays[tree["sparse"]]
            array = np.zeros(tree["shape"], dtype=values.dtype)
            array.ravel()[arrays[f"{tree['sparse']}@"]] = values
            return array
        return {key: _insert_arrays(value, arrays) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_insert_arrays(value, arrays) for value in tree]
    return tree
