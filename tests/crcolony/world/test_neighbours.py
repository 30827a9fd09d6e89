"""A search returns exactly the points that are near, and visits only the cells around."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.world.neighbours import Cells, collect_near, new_cells, sort_into_cells


def visited(cells: Cells, x: float, y: float, range_m: float) -> int:
    """Return how many points lie in the cells that a search at x, y visits."""
    corner = cells.grid[:2]
    low = ((np.array([x, y]) - range_m - corner) * cells.grid[2]).astype(int).clip(0)
    high = ((np.array([x, y]) + range_m - corner) * cells.grid[2]).astype(int)
    total = 0
    for row in range(low[1], min(high[1], cells.shape[1] - 1) + 1):
        for column in range(low[0], min(high[0], cells.shape[0] - 1) + 1):
            cell = row * cells.shape[0] + column
            total += int(cells.start[cell + 1] - cells.start[cell])
    return total


@given(
    st.integers(0, 2**32),
    st.integers(1, 60),
    st.floats(0.5, 20.0),
    st.floats(0.5, 20.0),
    st.floats(0.01, 5.0),
    st.floats(0.01, 5.0),
)
def test_a_search_returns_what_brute_force_returns(
    seed: int, points: int, width_m: float, height_m: float, cell_m: float, range_m: float
) -> None:
    """Every point within range with its offsets and squared distance, and no other; also beyond the
    border."""
    rng = np.random.default_rng(seed)
    positions = (rng.random((points, 2)) - 0.5) * [width_m, height_m] * 1.1
    cells = new_cells(width_m, height_m, cell_m, points)
    sort_into_cells(cells, positions)
    found = np.zeros((points, 4))
    x, y = (rng.random(2) - 0.5) * [width_m, height_m]
    count = collect_near(cells, x, y, range_m, found)
    offsets = positions - [x, y]
    squared = offsets[:, 0] * offsets[:, 0] + offsets[:, 1] * offsets[:, 1]
    expected = np.flatnonzero(squared <= range_m * range_m)
    assert sorted(found[:count, 0]) == expected.tolist()
    for point, dx, dy, distance in found[:count]:
        assert (dx, dy) == tuple(offsets[int(point)])
        assert distance == squared[int(point)]


@given(st.integers(0, 2**32), st.integers(1, 200))
def test_sorting_puts_every_point_into_its_cell_in_order(seed: int, points: int) -> None:
    """Every index is in one cell, and in a cell the smaller index comes first."""
    rng = np.random.default_rng(seed)
    positions = (rng.random((points, 3)) - 0.5) * 10.0
    cells = new_cells(10.0, 10.0, 1.0, points)
    sort_into_cells(cells, positions)
    assert sorted(cells.order) == list(range(points))
    for c in range(cells.start.size - 1):
        members = cells.order[cells.start[c] : cells.start[c + 1]]
        assert (cells.cell[members] == c).all()
        assert (np.diff(members) > 0).all()


def test_the_cost_of_a_search_does_not_grow_with_the_colony() -> None:
    """At the same density a search visits hardly more points among 1,600 robots than among 100."""
    mean = {}
    for robots in (100, 1600):
        width_m = np.sqrt(1.21 * robots)
        positions = (np.random.default_rng(1).random((robots, 2)) - 0.5) * width_m
        cells = new_cells(width_m, width_m, 1.5, robots)
        sort_into_cells(cells, positions)
        mean[robots] = np.mean([visited(cells, x, y, 1.5) for x, y in positions])
    assert mean[1600] < 1.3 * mean[100] < 40.0


@pytest.mark.parametrize("robots", [1, 4, 1000])
def test_the_number_of_cells_is_bounded_by_the_number_of_points(robots: int) -> None:
    """An arena of a kilometre and a range of a millimetre do not need a million of cells."""
    cells = new_cells(1000.0, 1000.0, 0.001, robots)
    assert cells.start.size <= 4 * robots + 1


def test_points_beyond_the_length_of_the_output_are_left_out() -> None:
    """The scratch array is never overrun."""
    positions = np.zeros((10, 2))
    cells = new_cells(1.0, 1.0, 1.0, 10)
    sort_into_cells(cells, positions)
    found = np.zeros((4, 4))
    assert collect_near(cells, 0.0, 0.0, 0.5, found) == 4
    assert found[:, 0].tolist() == [0, 1, 2, 3]
