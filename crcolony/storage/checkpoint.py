"""A checkpoint: the whole of a saved colony in one file, its arrays by path and the rest as MessagePack."""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
import numpy as np

_REST = "rest"
_LARGE, _SPARSE = 10_000, 0.4
"""An array of so many numbers, of which at most this share is not zero, is stored without its zeros: what most agents
have learnt about most tiles is nothing."""


class CheckpointError(Exception):
    """A checkpoint cannot be understood."""


def write_checkpoint(file: BinaryIO, colony: Mapping[str, Any]) -> None:
    """Write a tree of dicts, lists, numbers, texts and arrays."""
    arrays: dict[str, np.ndarray] = {}
    rest = _take_arrays(colony, "", arrays)
    arrays[_REST] = np.frombuffer(msgspec.msgpack.encode(rest), dtype=np.uint8)
    np.savez(file, **arrays)  # type: ignore[arg-type]


def read_checkpoint(source: Path | BinaryIO) -> dict[str, Any]:
    """Read what `write_checkpoint` wrote; raises FileNotFoundError, or CheckpointError for anything damaged."""
    try:
        opened = source.open("rb") if isinstance(source, Path) else nullcontext(source)
        with opened as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        saved: dict[str, Any] = _put_arrays(
            msgspec.msgpack.decode(arrays.pop(_REST).tobytes()), arrays
        )
    except FileNotFoundError:
        raise
    except Exception as error:  # damaged bytes lead zipfile and numpy to raise nearly anything
        raise CheckpointError(str(error)) from None
    return saved


def _take_arrays(tree: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    """Move every array of a tree into `arrays`, leaving its path in its place."""
    if isinstance(tree, np.ndarray):
        return _take_array(tree, path, arrays)
    if isinstance(tree, Mapping):
        return {key: _take_arrays(value, f"{path}.{key}", arrays) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_take_arrays(value, f"{path}.{k}", arrays) for k, value in enumerate(tree)]
    return tree


def _take_array(array: np.ndarray, path: str, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Move an array into `arrays`: a large one that is mostly zero as places and values of the rest."""
    if array.size >= _LARGE:
        places = np.flatnonzero(array.ravel().view(f"u{array.itemsize}"))  # -0.0 is not zero here
        if places.size < _SPARSE * array.size:
            arrays[f"{path}@"], arrays[path] = places, array.ravel()[places]
            return {"sparse": path, "shape": list(array.shape)}
    arrays[path] = array
    return {"array": path}


def _put_arrays(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(tree, dict):
        if set(tree) == {"array"}:
            return arrays[tree["array"]]
        if set(tree) == {"sparse", "shape"}:
            values = arrays[tree["sparse"]]
            array = np.zeros(tree["shape"], dtype=values.dtype)
            array.ravel()[arrays[f"{tree['sparse']}@"]] = values
            return array
        return {key: _put_arrays(value, arrays) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_put_arrays(value, arrays) for value in tree]
    return tree
