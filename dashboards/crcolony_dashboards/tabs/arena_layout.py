"""The views of the arena: robots by module and energy, and robots by founder."""

from typing import TYPE_CHECKING

from crcolony_dashboards.rerun_streams import ARENA_TIMELINE
from crcolony_dashboards.tabs import palette

if TYPE_CHECKING:
    import rerun.blueprint as rrb

ROOT = "/arena/world"
"""Entities below it are in metres of the first arena, with y up"""
_HALF_VIEW = 1.08
"""Half the width of the view; the arenas are scaled to reach from -1 to 1"""
_TRAIL_S = 4.0
"""How long a trail is visible"""


def arena_view() -> "rrb.View":
    """Return the view of the arena."""
    import rerun.blueprint as rrb

    trail = [
        rrb.VisibleTimeRange(
            timeline,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-_TRAIL_S),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        )
        for timeline in ("wall", "sim", ARENA_TIMELINE)
    ]
    return rrb.Spatial2DView(
        origin="/arena",
        contents=[f"+ {ROOT}/**", f"- {ROOT}/founders"],
        name="Arena",
        background=palette.BACKGROUND,
        visual_bounds=_bounds(),
        overrides={f"{ROOT}/trails": [rrb.VisibleTimeRanges(trail)]},
    )


def founders_view() -> "rrb.View":
    """Return the view of the arena in which every robot has the colour of its agent's main founder."""
    import rerun.blueprint as rrb

    return rrb.Spatial2DView(
        origin="/arena",
        contents=[f"+ {ROOT}/walls", f"+ {ROOT}/founders"],
        name="Robots by founder of the agent in control",
        background=palette.BACKGROUND,
        visual_bounds=_bounds(),
    )


def _bounds() -> "rrb.VisualBounds2D":
    import rerun.blueprint as rrb

    return rrb.VisualBounds2D(x_range=(-_HALF_VIEW, _HALF_VIEW), y_range=(-_HALF_VIEW, _HALF_VIEW))
