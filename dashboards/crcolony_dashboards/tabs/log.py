"""Log: what happens, in words. Of one kind of thing no more than a few lines a second are written out."""

from typing import TYPE_CHECKING

from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.throttle import Throttle
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb


class LogTab:
    """Writes once a second."""

    def __init__(self) -> None:
        self._beat = Throttle(1.0)

    def layout(self) -> "rrb.View":
        """Return the place of the log."""
        import rerun.blueprint as rrb

        return rrb.TextLogView(origin="/log", name="Log")

    def setup(self, streams: RerunStreams) -> None:
        """Nothing was said yet."""

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Write what was said since the last time."""
        import rerun as rr

        if self._beat.is_due(moment.unix_s):
            for line in view.take_log_lines():
                streams.log(f"/log/{line.kind}", rr.TextLog(line.text, level=line.level))
