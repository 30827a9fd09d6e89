"""A checkpoint is read as it was written, and damaged bytes are refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from crcolony.storage.checkpoint import CheckpointError, read_checkpoint, write_checkpoint

LEAVES = (
    st.integers(-(2**60), 2**60)
    | st.floats(allow_nan=False)
    | st.text()
    | st.none()
    | st.booleans()
    | arrays(np.float64, array_shapes(max_side=4), elements=st.floats(allow_nan=False))
    | arrays(np.uint64, 3)
)
NAMES = st.text("abcde", min_size=1, max_size=4)
TREES = st.dictionaries(
    NAMES,
    st.recursive(
        LEAVES,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3),
        max_leaves=8,
    ),
    max_size=4,
)


def same(one: object, other: object) -> bool:
    if isinstance(one, np.ndarray):
        assert isinstance(other, np.ndarray)
        return (one.dtype, one.shape) == (
            other.dtype,
            other.shape,
        ) and one.tobytes() == other.tobytes()
    if isinstance(one, dict):
        assert isinstance(other, dict)
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if isinstance(one, list):
        assert isinstance(other, list)
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


@given(TREES)
def test_what_is_written_is_read_unchanged(
    tmp_path_factory: pytest.TempPathFactory, tree: dict[str, object]
) -> None:
    """Any tree of dicts, lists, numbers, texts and arrays."""
    path = tmp_path_factory.mktemp("tree") / "checkpoint.npz"
    with path.open("wb") as file:
        write_checkpoint(file, tree)
    assert same(read_checkpoint(path), tree)


def test_arrays_that_are_mostly_zero_take_little_room(tmp_path: Path) -> None:
    """They are read in their shape and exactly; dense ones too."""
    sparse = np.zeros((200, 500))
    sparse[::7, ::13] = np.random.default_rng(1).normal(size=sparse[::7, ::13].shape)
    sparse[1, 1] = -0.0
    dense = np.random.default_rng(2).normal(size=(100, 200))
    path = tmp_path / "checkpoint.npz"
    sizes = []
    for tree in ({"a": sparse}, {"a": dense}):
        with path.open("wb") as file:
            write_checkpoint(file, tree)
        assert same(read_checkpoint(path), tree)
        sizes.append(path.stat().st_size)
    assert sizes[0] < 0.1 * sparse.nbytes
    assert sizes[1] > dense.nbytes


@given(st.binary(max_size=200), st.integers(0, 10**6), st.integers(1, 255))
def test_damage_is_refused_or_changes_nothing(
    tmp_path_factory: pytest.TempPathFactory, noise: bytes, place: int, flip: int
) -> None:
    """Random bytes are refused; one changed byte is found by its checksum, or is not part of the data."""
    path = tmp_path_factory.mktemp("damage") / "checkpoint.npz"
    path.write_bytes(noise)
    with pytest.raises(CheckpointError):
        read_checkpoint(path)
    tree = {"a": np.arange(30.0), "b": {"c": [1, "two", None]}, "d": np.zeros(20_000)}
    with path.open("wb") as file:
        write_checkpoint(file, tree)
    content = bytearray(path.read_bytes())
    content[place % len(content)] ^= flip
    path.write_bytes(content)
    try:
        read = read_checkpoint(path)
    except CheckpointError:
        return
    assert same(read, tree)
