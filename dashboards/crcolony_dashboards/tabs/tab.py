"""The interface of a tab, and what several tabs need."""

import re
from typing import TYPE_CHECKING, Protocol

from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.view_model.colony_view import ColonyView

if TYPE_CHECKING:
    import rerun.blueprint as rrb

MAX_ROBOT_LINES = 16
"""Up to so many robots have lines of their own; of more the distribution is drawn"""


class Tab(Protocol):
    """One tab of the dashboard."""

    def layout(self) -> "rrb.Container | rrb.View":
        """Return the views of the tab."""
        ...

    def setup(self, streams: RerunStreams) -> None:
        """Log static data, once, before anything else."""
        ...

    def draw(self, streams: RerunStreams, view: ColonyView, moment: Moment) -> None:
        """Log what is due; called ten times a second."""
        ...


def full_time_axis() -> "rrb.TimeAxis":
    """Return a time axis that always shows the whole recording, independent of other views."""
    import rerun.blueprint as rrb

    return rrb.TimeAxis(
        link="Independent",
        view_range=rrb.TimeRange(
            start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.infinite()
        ),
    )


def entity_name(name: str) -> str:
    """Return a name with the characters that an entity path may have."""
    return re.sub(r"[^A-Za-z0-9_.-]", "_", name.replace("#", "robot "))
