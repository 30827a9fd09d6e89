"""The generations of a colony that have ended, as they are drawn: a bounded number of rows, the first and the last."""

from dataclasses import dataclass

from crcolony_dashboards.view_model.gene_statistics import GeneStatistics
from crcolony_dashboards.view_model.generations import Spread

MIN_DRAWN = 5
"""A figure of fewer generations would show chance; until then a text says so"""
_MAX_ROWS = 400
"""Kept at a time; of more generations every second, fourth … one is kept"""


@dataclass(frozen=True, eq=False)
class GenerationRow:
    """What is drawn of one generation."""

    number: int
    agents: int
    matings: Spread
    captures: Spread
    conceptions: Spread
    energy: Spread
    genes: GeneStatistics | None
    """None if they could not be decoded"""


class GenerationHistory:
    """Keeps the rows of generations in order of their numbers."""

    def __init__(self) -> None:
        self.count = 0
        """How many generations were added"""
        self._rows: list[GenerationRow] = []
        self._last: GenerationRow | None = None
        self._stride = 1

    def add(self, row: GenerationRow) -> None:
        """Add the next generation."""
        if self.count % self._stride == 0:
            self._rows.append(row)
        if len(self._rows) > _MAX_ROWS:
            del self._rows[1::2]
            self._stride *= 2
        self._last = row
        self.count += 1

    @property
    def rows(self) -> list[GenerationRow]:
        """Rows in order, evenly spaced, from the first generation to the last."""
        if self._last is None or self._rows[-1] is self._last:
            return list(self._rows)
        return [*self._rows, self._last]

    @property
    def is_drawn(self) -> bool:
        """Whether there are enough generations for a figure."""
        return self.count >= MIN_DRAWN
