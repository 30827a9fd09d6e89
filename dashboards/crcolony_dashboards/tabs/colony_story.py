"""What stands beside the arena: the present state, the last events, matings and energy by generation, and evolution."""

from typing import TYPE_CHECKING

from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.chart import Chart, Line
from crcolony_dashboards.tabs.measure_lines import measure_line
from crcolony_dashboards.throttle import ChangeDetector, Throttle
from crcolony_dashboards.view_model.colony_view import Colony, ColonyView
from crcolony_dashboards.view_model.comparison import format_comparison
from crcolony_dashboards.view_model.expected_end import format_waiting
from crcolony_dashboards.view_model.status_text import format_events, format_status

if TYPE_CHECKING:
    import rerun.blueprint as rrb

STATUS, EVENTS, EVOLVED = "/colony/now", "/colony/events", "/colony/evolved"
_PERIOD_S = 1.0
_REPEAT_S = 60.0
"""What has not changed is drawn again so often, for viewers that connect late"""


class ColonyStory:
    """Draws once a second what has changed."""

    def __init__(self) -> None:
        self._throttle = Throttle(_PERIOD_S)
        self._matings = Chart("/colony/matings", "Matings of an agent, by generation", 1.0, 230.0)
        self._energy = Chart("/colony/energy", "Mean energy, by generation", 1.0, 230.0, top=1.0)
        self._texts = {path: ChangeDetector(_REPEAT_S) for path in (STATUS, EVENTS, EVOLVED)}
        self._charts = ChangeDetector(_REPEAT_S)

    def layout(self) -> "rrb.Container":
        """Return the layout: texts above, charts below."""
        import rerun.blueprint as rrb

        return rrb.Vertical(
            rrb.Horizontal(
                rrb.Vertical(
                    rrb.TextDocumentView(origin=STATUS, name="Now"),
                    rrb.TextDocumentView(origin=EVENTS, name="The last five events"),
                ),
                rrb.TextDocumentView(origin=EVOLVED, name="The evolved against the founders"),
                column_shares=[1, 1.45],
            ),
            rrb.Horizontal(self._matings.layout(), self._energy.layout()),
            row_shares=[1.7, 1],
        )

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw texts and charts that have changed."""
        if not self._throttle.is_due(moment.unix_s):
            return
        main = view.main_colony()
        waiting = _waiting(view, main)
        self._draw_text(streams, STATUS, "\n".join(format_status(view, moment.unix_s)), moment)
        self._draw_text(streams, EVENTS, format_events(view.events, view.period_s()), moment)
        evolved = format_comparison(main.history, waiting) if main is not None else waiting
        self._draw_text(streams, EVOLVED, evolved, moment)
        drawn = [colony for colony in view.colonies.values() if colony.history.is_drawn]
        counts = [(colony.name, colony.history.count) for colony in view.colonies.values()]
        if self._charts.is_due((counts, "" if drawn else waiting), moment.unix_s):
            self._draw_charts(streams, view, drawn, waiting)

    def _draw_charts(
        self, streams: RerunStreams, view: ColonyView, drawn: list[Colony], waiting: str
    ) -> None:
        """Draw a line for every colony, which keeps its colour."""
        matings: list[Line] = []
        energies: list[Line] = []
        for number, colony in enumerate(view.colonies.values()):
            if colony in drawn:
                name = colony.name if len(view.colonies) > 1 else ""
                colour = palette.series_colour(number)
                rows = colony.history.rows
                matings += measure_line(rows, "matings", name or "matings", colour)
                energies += measure_line(rows, "energy", name or "energy", colour)
        self._matings.draw(streams, matings, waiting)
        self._energy.draw(streams, energies, waiting)

    def _draw_text(self, streams: RerunStreams, path: str, text: str, moment: Moment) -> None:
        import rerun as rr

        if self._texts[path].is_due(text, moment.unix_s):
            streams.log(path, rr.TextDocument(text, media_type="text/markdown"))


def _waiting(view: ColonyView, colony: Colony | None) -> str:
    if colony is None:
        return "No robot is on the network yet."
    return format_waiting(colony.history, view.expected_end(colony))
