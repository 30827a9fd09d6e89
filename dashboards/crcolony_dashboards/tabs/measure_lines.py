"""What agents did in every generation as lines of a chart: the mean, and thin lines around the middle 80 %."""

from collections.abc import Sequence

import numpy as np

from crcolony_dashboards.tabs.chart import Line
from crcolony_dashboards.tabs.palette import Colour, dimmed
from crcolony_dashboards.view_model.generation_history import GenerationRow
from crcolony_dashboards.view_model.generations import Spread

_THIN = 0.7


def measure_line(
    rows: Sequence[GenerationRow], measure: str, name: str, colour: Colour, has_spread: bool = True
) -> list[Line]:
    """Return the lines of one measure, an attribute of `GenerationRow`."""
    spreads: list[Spread] = [getattr(row, measure) for row in rows]
    numbers = [float(row.number) for row in rows]

    def line(name: str, colour: Colour, values: list[float], width: float) -> Line:
        return Line(name, colour, np.column_stack([numbers, values]), width)

    lines = []
    if has_spread:
        lines = [
            line("", dimmed(colour), [spread.low for spread in spreads], _THIN),
            line("", dimmed(colour), [spread.high for spread in spreads], _THIN),
        ]
    return [*lines, line(name, colour, [spread.mean for spread in spreads], 1.8)]
