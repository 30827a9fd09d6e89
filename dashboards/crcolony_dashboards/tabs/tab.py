"""What every tab of the dashboard can do."""

import re
from typing import TYPE_CHECKING, Protocol

from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb

FEW_ROBOTS = 16
"""So many have lines of their own; more are a distribution"""


class Tab(Protocol):
    """One page: where it is laid out, what stays as it is, and what is drawn again and again."""

    def layout(self) -> "rrb.Container | rrb.View":
        """Return its place in the blueprint."""
        ...

    def setup(self, streams: RerunStreams) -> None:
        """Draw what never changes."""
        ...

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Draw what is due at this moment."""
        ...


def whole_past() -> "rrb.TimeAxis":
    """Return a time axis that always shows everything up to now, whatever other views show."""
    import rerun.blueprint as rrb

    return rrb.TimeAxis(
        link="Independent",
        view_range=rrb.TimeRange(
            start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite()
        ),
    )


def safe(name: str) -> str:
    """Return a name as it may stand in the path of an entity."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name.replace("#", "robot "))
