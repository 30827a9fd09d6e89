"""The genes tab: how every meta-parameter spreads over the agents, and what one agent has inherited."""

from typing import TYPE_CHECKING

import numpy as np

from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.agent_potentials import draw_agent, potential_views
from crcolony_dashboards.tabs.chart import Chart, Line
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.comparison import SYMBOLS
from crcolony_dashboards.view_model.expected_end import format_waiting
from crcolony_dashboards.view_model.generation_history import GenerationRow

if TYPE_CHECKING:
    import rerun.blueprint as rrb

_PERIOD_S = 1.0
_REPEAT_S = 60.0
_WIDTHS_PX = (0.7, 1.8, 0.7)
"""Of the lines of the 10 % quantile, the median and the 90 % quantile"""


class GenesTab:
    """Draws the colony with most robots, when a generation has ended.

    `agent` names the agent whose potentials are drawn; if empty, it is the one that mated most in the last generation.
    """

    def __init__(self, agent: str = "") -> None:
        self._agent = agent
        self._throttle, self._drawn = Throttle(_PERIOD_S), ChangeDetector(_REPEAT_S)
        self._drawn_agent, self._has_drawn_agent = ChangeDetector(_REPEAT_S), False
        self._charts = [
            Chart(f"/genes/{meta}", f"{SYMBOLS[meta]}: median, middle 80 %", 0.9, 260.0)
            for meta in META_PARAMETERS
        ]

    def layout(self) -> "rrb.Container":
        """Return the layout of the tab."""
        import rerun.blueprint as rrb

        return rrb.Grid(
            *(chart.layout() for chart in self._charts),
            *potential_views(),
            rrb.TextDocumentView(origin="/genes/agent", name="One agent: the best, or --agent"),
            grid_columns=4,
            name="Genes",
        )

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing before the first births."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the spread of meta-parameters and one agent, if they have changed."""
        if not self._throttle.is_due(moment.unix_s):
            return
        colony = view.main_colony()
        if colony is not None:
            self._draw_spreads(streams, view, colony, moment)
        self._draw_agent(streams, view, moment)

    def _draw_spreads(
        self, streams: RerunStreams, view: ColonyView, colony: Colony, moment: Moment
    ) -> None:
        history = colony.history
        waiting = "" if history.is_drawn else format_waiting(history, view.expected_end(colony))
        if not self._drawn.is_due((colony.name, history.count, waiting), moment.unix_s):
            return
        rows = history.rows if history.is_drawn else []
        unread = waiting or "The robots have not reported how their genes are read."
        for k, chart in enumerate(self._charts):
            chart.draw(streams, _spread_lines(rows, k), unread)

    def _draw_agent(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw the potentials of one agent, when it is another one than before."""
        agent, colony = self._choose_agent(view)
        genes = colony.generations.genes_of(agent) if colony is not None else None
        mind = view.mind_of(colony, len(genes)) if colony and genes is not None else None
        if genes is None or mind is None or not self._drawn_agent.is_due(agent, moment.unix_s):
            return
        self._has_drawn_agent = True
        draw_agent(streams, agent, genes, mind, view.name_of)

    def _choose_agent(self, view: ColonyView) -> tuple[str, Colony | None]:
        """Return the chosen agent, else the best of the last generation, else (at first) any in control of a robot."""
        for colony in view.colonies.values():
            if self._agent and colony.generations.genes_of(self._agent) is not None:
                return self._agent, colony
        for colony in view.colonies.values():
            if colony.best:
                return colony.best, colony
            for state in view.states(colony.name):
                if not self._has_drawn_agent and (
                    colony.generations.genes_of(state.agent) is not None
                ):
                    return state.agent, colony
        return "", None


def _spread_lines(rows: list[GenerationRow], meta: int) -> list[Line]:
    """Return three lines for every module: two thin ones, and the median with its name."""
    known = [(row.number, row.genes.meta_parameters) for row in rows if row.genes is not None]
    lines = []
    for module, colour in enumerate(palette.MODULES if known else ()):
        for k, width in enumerate(_WIDTHS_PX):
            is_median = width == max(_WIDTHS_PX)
            points = [(number, genes[module, meta, k]) for number, genes in known]
            lines.append(
                Line(
                    MODULES[module].name if is_median else "",
                    colour if is_median else palette.dimmed(colour),
                    np.array(points, dtype=float),
                    width,
                )
            )
    return lines
