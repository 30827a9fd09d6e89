"""Layout of the arena tab: a large view coloured by module, a small one by founder, and the status text."""

from typing import TYPE_CHECKING

from crcolony_dashboards.tabs import palette

if TYPE_CHECKING:
    import rerun.blueprint as rrb

ROOT = "/arena/world"
"""Entities below it are in metres of the first arena, with y up"""
STATUS = "/arena/now"
_HALF_VIEW = 1.08
"""Half the width of the view; the arenas are scaled to reach from -1 to 1"""
_TRAIL_S = 4.0
"""How long a trail is visible"""


def arena_layout() -> "rrb.Container":
    """Return the layout of the tab."""
    import rerun.blueprint as rrb

    bounds = rrb.VisualBounds2D(
        x_range=(-_HALF_VIEW, _HALF_VIEW), y_range=(-_HALF_VIEW, _HALF_VIEW)
    )
    trail = [
        rrb.VisibleTimeRange(
            timeline,
            start=rrb.TimeRangeBoundary.cursor_relative(seconds=-_TRAIL_S),
            end=rrb.TimeRangeBoundary.cursor_relative(),
        )
        for timeline in ("wall", "sim")
    ]
    return rrb.Horizontal(
        rrb.Spatial2DView(
            origin="/arena",
            contents=[f"+ {ROOT}/**", f"- {ROOT}/founders"],
            name="Arena: face foraging blue, mating pink; ring hungry red to full green",
            background=palette.BACKGROUND,
            visual_bounds=bounds,
            overrides={f"{ROOT}/trails": [rrb.VisibleTimeRanges(trail)]},
        ),
        rrb.Vertical(
            rrb.TextDocumentView(origin=STATUS, name="Now"),
            rrb.Spatial2DView(
                origin="/arena",
                contents=[f"+ {ROOT}/walls", f"+ {ROOT}/founders"],
                name="By founder of the agent in control",
                background=palette.BACKGROUND,
                visual_bounds=bounds,
            ),
        ),
        column_shares=[2.2, 1],
        name="Arena",
    )
