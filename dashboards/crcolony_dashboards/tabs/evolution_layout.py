"""Layout of the evolution tab: measures above, meta-parameters in the middle, the selector and one agent below."""

from typing import TYPE_CHECKING

from crcolony.robot.genes import META_PARAMETERS
from crcolony.robot.modules import MODULES
from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.tab import full_time_axis

if TYPE_CHECKING:
    import rerun.blueprint as rrb

MEASURES = {
    "matings": "Matings of an agent",
    "captures": "Batteries an agent captured",
    "conceptions": "Offspring an agent conceived",
}
"""Attributes of `Generation` that are plotted, and their titles"""
SYMBOLS = {"alpha": "α", "gamma": "γ", "lambda": "λ", "tau": "τ", "tau_decay": "decay of τ"}
"""Of the meta-parameters"""


def evolution_layout() -> "rrb.Container":
    """Return the layout of the tab."""
    import rerun.blueprint as rrb

    measures = [
        rrb.TimeSeriesView(
            origin=f"/evolution/{name}",
            name=f"{title}: mean ± sd",
            axis_x=full_time_axis(),
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for name, title in MEASURES.items()
    ]
    genes = [
        rrb.TimeSeriesView(
            origin=f"/evolution/genes/{module.name}/{meta}",
            name=f"{module.name} {SYMBOLS[meta]}",
            axis_x=full_time_axis(),
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for module in MODULES
        for meta in META_PARAMETERS
    ]
    potentials = [
        rrb.Spatial2DView(
            origin=f"/evolution/potential/{module.name}",
            name=f"Potential of {module.name}: distance up, bearing across",
            background=palette.BACKGROUND,
        )
        for module in MODULES
    ]
    return rrb.Vertical(
        rrb.Horizontal(*measures),
        rrb.Grid(*genes, grid_columns=len(META_PARAMETERS)),
        rrb.Horizontal(
            *potentials,
            rrb.TimeSeriesView(
                origin="/evolution/selector",
                name="Weights of the selector: mean of all agents",
                axis_x=full_time_axis(),
            ),
            rrb.TextDocumentView(origin="/evolution/agent", name="Agent"),
            column_shares=[1, 1, 1.4, 0.8],
        ),
        row_shares=[1, 1.6, 1.2],
        name="Evolution",
    )
