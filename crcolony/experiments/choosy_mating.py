"""Liberal or choosy mating (thesis 6.1): take every partner, or wait for one with much energy?

From founders that forage and mate, three societies evolve in a world with as many batteries as usual, and in one with
half as many: in one all are liberal, in one all are choosy, in one how choosy an agent is evolves.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from crcolony.experiments.colonies.mating_traits import by_threshold
from crcolony.experiments.colonies.trait_societies import (
    COLUMNS,
    plan_societies,
    societies_of,
    society_ahead,
    trait_moves,
)
from crcolony.experiments.framework.experiment import Experiment, Job, Plan, Row, values_of
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORLDS = {"default": (), "scarce": ("arena.packs_per_robot=1.0",)}
LIBERAL, CHOOSY, EVOLVING = "liberal", "choosy", "evolving"
CHOOSY_ENERGY = 0.7
"""Energy that a choosy agent asks for"""
SOCIETIES = {
    LIBERAL: partial(by_threshold, threshold=0.0),
    CHOOSY: partial(by_threshold, threshold=CHOOSY_ENERGY),
    EVOLVING: partial(by_threshold, threshold=None),
}
GENERATIONS = 25


def plan_jobs(plan: Plan) -> list[Job]:
    """Return for each world and seed a run of the founders and then of all societies."""
    return plan_societies(plan, WORLDS, GENERATIONS, SOCIETIES)


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw what the societies achieve in both worlds, a point a run, and choosiness by generation."""
    from crcolony.results.plots.style import LINES, PAGE_IN, format_axes, new_figure

    figure = new_figure(PAGE_IN, 2.3)
    matings, *panels = figure.subplots(1, 1 + len(WORLDS))
    ticks: list[tuple[float, str]] = []
    for k, world in enumerate(WORLDS):
        own = societies_of(rows, world)
        for j, society in enumerate(SOCIETIES):
            values = values_of(own, "energy_weighted_matings_end", society)
            at = len(ticks) + 0.3 * k
            matings.plot([at] * values.size, values, "o", color=LINES[j]["color"], alpha=0.5)
            matings.plot(at, values.mean(), "_", color="black", markersize=10)
            ticks.append((at, f"{society}, {world}"))
        for line, society in ((LINES[0], LIBERAL), (LINES[2], EVOLVING)):
            points, quartiles = quartiles_of(own, society, "generation", "choosiness")
            label = f"{society} (neutral)" if society == LIBERAL else society
            draw_quartiles(panels[k], points, quartiles, label, line)
        format_axes(panels[k], f"choosiness, {world}", top=1.0)
        panels[k].set_xlabel("generation")
    format_axes(matings, "energy-weighted matings, end")
    matings.set_xticks([at for at, _ in ticks], [name for _, name in ticks], rotation=90)
    panels[0].legend()
    return figure


EXPERIMENT = Experiment(
    name="choosy-mating",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        **{
            f"choosy-ahead-{world}": partial(
                society_ahead, "energy_weighted_matings_end", 1, world, CHOOSY, LIBERAL
            )
            for world in WORLDS
        },
        "choosy-forages": partial(society_ahead, "captures_end", 1, "default", CHOOSY, LIBERAL),
        **{
            f"liberal-evolves-{world}": partial(
                trait_moves, "choosiness", -1, world, EVOLVING, LIBERAL
            )
            for world in WORLDS
        },
    },
    draw=draw,
)
