"""The log tab: events and status changes as lines of text, at most a few of each kind a second."""

from typing import TYPE_CHECKING

from crcolony_dashboards.rerun_streams import TIMELINES, Moment, RerunStreams
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView
from crcolony_dashboards.view_model.status_text import format_line

if TYPE_CHECKING:
    import rerun.blueprint as rrb


class LogTab:
    """Writes once a second, since the view model counts the lines of a second."""

    def __init__(self) -> None:
        self._throttle = Throttle(1.0)

    def layout(self) -> "rrb.View":
        """Return the log view."""
        import rerun.blueprint as rrb

        # Rerun makes the column of times too narrow: lines begin with the colony's own time instead
        columns = rrb.archetypes.TextLogColumns(
            timeline_columns=[
                rrb.encodings.TimelineColumn(timeline=name, visible=False) for name in TIMELINES
            ],
            text_log_columns=[
                rrb.encodings.TextLogColumn(kind=kind) for kind in ("LogLevel", "Body")
            ],
        )
        return rrb.TextLogView(origin="/log", name="Log", columns=columns)

    def setup(self, streams: RerunStreams) -> None:
        """Draw nothing: there is nothing to draw yet."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Write the lines since the last call."""
        import rerun as rr

        if self._throttle.is_due(moment.unix_s):
            for line in view.pop_log_lines():
                text = format_line(line, view.period_s())
                streams.log("/log", rr.TextLog(text, level=line.level))
