"""A history keeps the first and the last generation, and a bounded number between them."""

import numpy as np
import pytest
from crcolony_dashboards.view_model.generation_history import (
    MIN_DRAWN,
    GenerationHistory,
    GenerationRow,
)
from crcolony_dashboards.view_model.generations import Spread


def row(number: int) -> GenerationRow:
    spread = Spread(1.0, 0.0, 1.0, 1.0)
    return GenerationRow(number, 7, spread, spread, spread, spread, None)


@pytest.mark.parametrize("count", [0, 1, 5, 400, 401, 5_000])
def test_rows_go_from_the_first_generation_to_the_last(count: int) -> None:
    """Evenly spaced but for the last, and never more than a screen can show."""
    history = GenerationHistory()
    for number in range(3, 3 + count):
        history.add(row(number))
    numbers = [row.number for row in history.rows]
    assert history.count == count
    assert len(numbers) == min(count, len(numbers)) <= 402
    if count:
        assert (numbers[0], numbers[-1]) == (3, 2 + count)
        assert len(set(np.diff(numbers[:-1]).tolist())) <= 1
        assert len(numbers) >= min(count, 150)


def test_a_figure_needs_five_generations() -> None:
    """Fewer would show chance."""
    history = GenerationHistory()
    for number in range(5):
        assert not history.is_drawn
        history.add(row(number))
    assert history.is_drawn
    assert MIN_DRAWN == 5
