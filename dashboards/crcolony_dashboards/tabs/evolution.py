"""The evolution tab: by generation what agents did, their meta-parameters, and the selector of their modules."""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.chart import Chart, Line
from crcolony_dashboards.tabs.measure_lines import measure_line
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView
from crcolony_dashboards.view_model.comparison import INPUTS, SYMBOLS
from crcolony_dashboards.view_model.expected_end import format_waiting
from crcolony_dashboards.view_model.gene_statistics import QUANTILES
from crcolony_dashboards.view_model.generation_history import GenerationRow

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_PERIOD_S = 1.0
_REPEAT_S = 60.0
_SIZE = 1.9, 340.0
"""Width of a chart, and its height in pixels"""
_MEDIAN = QUANTILES.index(0.5)
_MEASURES = {"matings": "matings", "captures": "batteries", "conceptions": "offspring"}
"""Attributes of a generation, and their names"""


class EvolutionTab:
    """Draws the colony with most robots, when a generation has ended."""

    def __init__(self) -> None:
        self._throttle, self._drawn = Throttle(_PERIOD_S), ChangeDetector(_REPEAT_S)
        self._measures = Chart("/evolution/measures", "What an agent did: means", *_SIZE)
        self._genes = [
            Chart(f"/evolution/{module.name}", f"Learning of {module.name}: medians", *_SIZE, 1.0)
            for module in MODULES
        ]
        self._selector = Chart(
            "/evolution/selector",
            "Selector: weights, means; an agent mates while their sum is above 0",
            *_SIZE,
        )

    def layout(self) -> "rrb.Container":
        """Return the layout of the tab."""
        import rerun.blueprint as rrb

        charts = [self._measures, self._selector, *self._genes]
        return rrb.Grid(*(chart.layout() for chart in charts), grid_columns=2, name="Evolution")

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing before the end of a generation."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw all charts if they have changed."""
        if not self._throttle.is_due(moment.unix_s):
            return
        colony = view.main_colony()
        if colony is None:
            return
        history = colony.history
        waiting = "" if history.is_drawn else format_waiting(history, view.expected_end(colony))
        if not self._drawn.is_due((colony.name, history.count, waiting), moment.unix_s):
            return
        rows = history.rows if history.is_drawn else []
        lines = [
            line
            for number, (measure, name) in enumerate(_MEASURES.items())
            for line in measure_line(
                rows, measure, name, palette.series_colour(number), has_spread=False
            )
        ]
        self._measures.draw(streams, lines, waiting)
        unread = waiting or "The robots have not reported how their genes are read."
        for module, chart in enumerate(self._genes):
            chart.draw(streams, _meta_parameter_lines(rows, module), unread)
        self._selector.draw(streams, _selector_lines(rows), unread)


def _meta_parameter_lines(rows: list[GenerationRow], module: int) -> list[Line]:
    """Return a line for every meta-parameter of a module."""
    known = [(row.number, row.genes.meta_parameters) for row in rows if row.genes is not None]
    return [
        Line(
            SYMBOLS[meta],
            palette.series_colour(k),
            np.array([(number, genes[module, k, _MEDIAN]) for number, genes in known], dtype=float),
        )
        for k, meta in enumerate(META_PARAMETERS)
        if known
    ]


def _selector_lines(rows: list[GenerationRow]) -> list[Line]:
    """Return a line for every input of the selector."""
    known = [(row.number, row.genes.selector) for row in rows if row.genes is not None]
    return [
        Line(
            name,
            palette.series_colour(k),
            np.array([(number, weights[k]) for number, weights in known], dtype=float),
        )
        for k, name in enumerate(INPUTS)
        if known
    ]
