"""Mean, band and number of runs by generation, compared with values found by hand."""

import numpy as np
import pytest

from crcolony.results.plots.bands import band_of

T_OF_3 = 4.30265
"""Student's t for 95 %, two-sided, of 3 values, from a printed table."""
T_OF_4 = 3.18245
"""Of 4 values."""


def table(*values: float, first: int = 0) -> dict[str, np.ndarray]:
    """Return the table of a run whose quantity had these values."""
    generation = np.arange(first, first + len(values), dtype=float)
    return {"generation": generation, "x": np.array(values)}


def test_three_runs_have_the_interval_of_student() -> None:
    """1, 2 and 6 have the mean 3 and the variance 7."""
    band = band_of([table(1.0, 5.0), table(2.0, 5.0), table(6.0, 5.0)], "x")
    half = T_OF_3 * np.sqrt(7.0 / 3.0)
    assert band.generation.tolist() == [0.0, 1.0]
    assert band.mean == pytest.approx([3.0, 5.0])
    assert band.low == pytest.approx([3.0 - half, 5.0], rel=1e-5)
    assert band.high == pytest.approx([3.0 + half, 5.0], rel=1e-5)
    assert band.count.tolist() == [3, 3]


def test_of_two_runs_the_band_goes_from_one_to_the_other() -> None:
    """Whichever is above, as far as both go."""
    band = band_of([table(1.0, 8.0, 3.0), table(2.0, 4.0)], "x")
    assert band.mean.tolist() == [1.5, 6.0]
    assert (band.low.tolist(), band.high.tolist()) == ([1.0, 4.0], [2.0, 8.0])
    assert band.count.tolist() == [2, 2]


def test_one_run_is_its_own_band() -> None:
    """One run has no uncertainty to show."""
    band = band_of([table(1.0, 8.0)], "x")
    assert band.low.tolist() == band.mean.tolist() == band.high.tolist() == [1.0, 8.0]
    assert band.count.tolist() == [1, 1]


def test_runs_of_unequal_length_are_drawn_as_far_as_three_go() -> None:
    """The interval is that of the runs that have ended a generation."""
    tables = [table(0.0, 1.0, 9.0), table(2.0, 2.0, 9.0), table(4.0, 6.0), table(2.0)]
    band = band_of(tables, "x")
    assert band.count.tolist() == [4, 3]
    assert band.mean == pytest.approx([2.0, 3.0])
    half = [T_OF_4 * np.sqrt(8.0 / 3.0 / 4.0), T_OF_3 * np.sqrt(7.0 / 3.0)]
    assert band.high - band.mean == pytest.approx(half, rel=1e-5)


def test_generations_are_matched_by_their_number() -> None:
    """Not by their place in the table."""
    band = band_of([table(1.0, 2.0, 3.0), table(4.0, 5.0, first=1)], "x")
    assert band.generation.tolist() == [1.0, 2.0]
    assert band.mean.tolist() == [3.0, 4.0]
