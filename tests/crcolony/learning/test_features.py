"""Tile coding and normalised RBF networks are those of section 2.7."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from crcolony.compiled import FloatArray, IntArray
from crcolony.learning.features import (
    FeatureMap,
    NormalizedRBF,
    TileCoding,
    distinct_offsets,
    grid_axis,
    grid_rbf_value,
    uniform_offsets,
)

LOW = np.array([-1.0, 2.0])
HIGH = np.array([1.0, 7.0])

coordinates = st.floats(-10.0, 10.0)
states = st.tuples(coordinates, coordinates).map(np.array)
tile_counts = st.tuples(st.integers(1, 12), st.integers(1, 12)).map(np.array)
far = coordinates | st.floats(-1e4, 1e4)
anything = st.floats(allow_nan=True, allow_infinity=True)


def tile_coding(tilings: int, tiles: tuple[int, int]) -> TileCoding:
    """Return a tile coding of the box from LOW to HIGH."""
    return TileCoding(LOW, HIGH, np.array(tiles), uniform_offsets(tilings, 2))


@given(states, tile_counts, st.integers(1, 9))
def test_a_state_activates_the_cell_it_lies_in_once_in_every_tiling(
    state: FloatArray, tiles: IntArray, tilings: int
) -> None:
    """Tile k of a state is k grids plus the row-major cell of a plain computation."""
    coding = TileCoding(LOW, HIGH, tiles, uniform_offsets(tilings, 2))
    inside = np.clip(state, LOW, HIGH)
    cells = np.floor((inside - LOW) * (tiles / (HIGH - LOW)) + coding.offsets).astype(int)
    expected = [
        tiling * np.prod(tiles + 1) + np.ravel_multi_index(tuple(cell), tuple(tiles + 1))
        for tiling, cell in enumerate(cells)
    ]
    indices, values = coding(state)
    assert indices.tolist() == expected
    assert values.tolist() == [1.0] * tilings


@given(anything, anything, tile_counts, st.integers(1, 9))
@example(np.nan, np.inf, np.array([2, 3]), 2)
def test_no_state_has_a_tile_outside_the_table(
    x: float, y: float, tiles: IntArray, tilings: int
) -> None:
    """Even infinite and NaN coordinates give one valid tile in every tiling."""
    coding = TileCoding(LOW, HIGH, tiles, uniform_offsets(tilings, 2))
    indices, _ = coding(np.array([x, y]))
    assert (indices // (coding.size // tilings)).tolist() == list(range(tilings))


@pytest.mark.parametrize("offset", [0.0, np.nextafter(1.0, 0.0)])
def test_the_upper_corner_has_a_tile_of_its_own(offset: float) -> None:
    """At the upper border the last cell is active, even where rounding would step beyond it."""
    coding = TileCoding(LOW, HIGH, np.array([8, 8]), np.full((1, 2), offset))
    assert coding(HIGH)[0].tolist() == [80]


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.sampled_from([1, 2, 4, 8, 16]))
def test_tilings_are_those_of_the_reference_software(x: float, y: float, tilings: int) -> None:
    """Cells agree with Sutton's tiles3, which counts displaced cells without wrapping offsets."""
    coding = TileCoding(np.zeros(2), np.ones(2), np.array([8, 8]), uniform_offsets(tilings, 2))
    quantised = [int(np.floor(8 * coordinate * tilings)) for coordinate in (x, y)]
    expected = []
    for tiling in range(tilings):
        cell = 0
        for axis, q in enumerate(quantised):
            displacement = tiling * (1 + 2 * axis)
            cell = cell * 9 + (q + displacement) // tilings - displacement // tilings
        expected.append(tiling * 81 + cell)
    assert coding(np.array([x, y]))[0].tolist() == expected


@given(st.integers(1, 40), st.integers(1, 5))
def test_offsets_are_evenly_spread_along_the_first_axis(tilings: int, dimensions: int) -> None:
    """Along the first axis every multiple of 1/N of a tile is one tiling's offset."""
    offsets = uniform_offsets(tilings, dimensions)
    assert offsets.shape == (tilings, dimensions)
    assert offsets.min() >= 0.0
    assert offsets.max() < 1.0
    assert np.allclose(offsets[:, 0], np.arange(tilings) / tilings)


def test_an_impossible_tile_coding_is_refused() -> None:
    """An empty box, no tiles, offsets of a whole tile and shapes that disagree raise ValueError."""
    offsets = uniform_offsets(4, 2)
    tiles = np.array([3, 3])
    for arguments in [
        (HIGH, LOW, tiles, offsets),
        (LOW, HIGH, np.array([3, 0]), offsets),
        (LOW, HIGH, tiles, offsets + 1.0),
        (LOW, HIGH, tiles, uniform_offsets(4, 3)),
        (LOW[:1], HIGH, tiles, offsets),
    ]:
        with pytest.raises(ValueError):
            TileCoding(*arguments)
    with pytest.raises(ValueError):
        tile_coding(4, (3, 3))(np.zeros(3))
    with pytest.raises(ValueError):
        uniform_offsets(0, 2)


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_rbf_features_sum_to_one_however_far_the_state_is(x: float, y: float) -> None:
    """Features are never negative or NaN and sum to 1, also where every Gaussian underflows."""
    features = NormalizedRBF.grid(LOW, HIGH, np.array([4, 5]))
    indices, values = features(np.array([x, y]))
    assert indices.tolist() == list(range(20))
    assert values.min() >= 0.0
    assert values.sum() == pytest.approx(1.0, abs=1e-12)


@given(states)
def test_rbf_features_are_equation_2_27(state: FloatArray) -> None:
    """Near the centres, where nothing underflows, features equal the printed quotient."""
    centres = np.array([[0.0, 0.0], [2.0, 1.0], [-3.0, 4.0]])
    widths = np.array([5.0, 4.0, 6.0])
    responses = np.exp(-np.sum((state - centres) ** 2, axis=1) / (2.0 * widths**2))
    _, values = NormalizedRBF(centres, widths)(state)
    np.testing.assert_allclose(values, responses / responses.sum(), rtol=1e-9)


@given(far, far, st.integers(1, 6), st.integers(1, 6), st.integers(0, 2**32))
@example(1e3, -1e3, 4, 4, 0)
def test_a_grid_network_factorises_into_its_axes(
    x: float, y: float, nx: int, ny: int, seed: int
) -> None:
    """The fast value of a grid equals that of the general network with the same weights."""
    weights = np.random.default_rng(seed).normal(size=nx * ny)
    centres_x, width_x = grid_axis(LOW[0], HIGH[0], nx)
    centres_y, width_y = grid_axis(LOW[1], HIGH[1], ny)
    value = grid_rbf_value(
        x, y, centres_x, width_x, centres_y, width_y, weights, np.empty(nx), np.empty(ny)
    )
    _, features = NormalizedRBF.grid(LOW, HIGH, np.array([nx, ny]))(np.array([x, y]))
    assert value == pytest.approx(float(features @ weights), abs=1e-7)


def test_an_impossible_rbf_network_is_refused() -> None:
    """Widths that are zero or do not fit the centres, and empty axes, raise ValueError."""
    centres = np.zeros((3, 2))
    for widths in [np.zeros(3), np.ones(2), -np.ones((3, 2))]:
        with pytest.raises(ValueError):
            NormalizedRBF(centres, widths)
    with pytest.raises(ValueError):
        grid_axis(1.0, 0.0, 3)
    with pytest.raises(ValueError):
        grid_axis(0.0, 1.0, 0)


def test_both_are_feature_maps() -> None:
    """A learner can use either, by its size and its features."""
    maps: list[tuple[FeatureMap, int]] = [
        (tile_coding(4, (3, 2)), 4 * 4 * 3),
        (NormalizedRBF.grid(LOW, HIGH, np.array([4, 5])), 20),
    ]
    for features, size in maps:
        indices, values = features(LOW)
        assert features.size == size
        assert indices.max() < size
        assert indices.shape == values.shape


@given(st.integers(1, 40), st.integers(1, 5))
def test_offsets_along_an_axis_are_as_many_as_stated(tilings: int, dimensions: int) -> None:
    """Tilings that share a factor with an axis' multiple line up along it."""
    offsets = uniform_offsets(tilings, dimensions)
    for axis in range(dimensions):
        assert distinct_offsets(tilings, axis) == len(set(offsets[:, axis].tolist()))
