"""A checkpoint: the whole of a saved colony in one file, its arrays by path and the rest as MessagePack."""

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
import numpy as np

_REST = "rest"


class CheckpointError(Exception):
    """A checkpoint cannot be understood."""


def write_checkpoint(file: BinaryIO, colony: Mapping[str, Any]) -> None:
    """Write a tree of dicts, lists, numbers, texts and arrays."""
    arrays: dict[str, np.ndarray] = {}
    rest = _take_arrays(colony, "", arrays)
    arrays[_REST] = np.frombuffer(msgspec.msgpack.encode(rest), dtype=np.uint8)
    np.savez(file, **arrays)  # type: ignore[arg-type]


def read_checkpoint(path: Path) -> dict[str, Any]:
    """Read what `write_checkpoint` wrote; raises FileNotFoundError, or CheckpointError for anything damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        saved: dict[str, Any] = _put_arrays(
            msgspec.msgpack.decode(arrays.pop(_REST).tobytes()), arrays
        )
    except FileNotFoundError:
        raise
    except (
        AttributeError,
        EOFError,
        KeyError,
        OSError,
        TypeError,
        ValueError,
        msgspec.DecodeError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise CheckpointError(str(error)) from None
    return saved


def _take_arrays(tree: Any, path: str, arrays: dict[str, np.ndarray]) -> Any:
    """Move every array of a tree into `arrays`, leaving its path in its place."""
    if isinstance(tree, np.ndarray):
        arrays[path] = tree
        return {"array": path}
    if isinstance(tree, Mapping):
        return {key: _take_arrays(value, f"{path}.{key}", arrays) for key, value in tree.items()}
    if isinstance(tree, list | tuple):
        return [_take_arrays(value, f"{path}.{k}", arrays) for k, value in enumerate(tree)]
    return tree


def _put_arrays(tree: Any, arrays: Mapping[str, np.ndarray]) -> Any:
    if isinstance(tree, dict):
        if set(tree) == {"array"}:
            return arrays[tree["array"]]
        return {key: _put_arrays(value, arrays) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_put_arrays(value, arrays) for value in tree]
    return tree
