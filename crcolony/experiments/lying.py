"""Lying about health, and the ability to resist it (thesis 6.1): may agents deceive those with whom they mate?

An agent conceives by its own energy and by the energy that its partner seems to have. From founders that forage and
mate, three societies evolve: in one all are honest, in one they may lie, in one they may lie and doubt.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from crcolony.experiments.colonies.mating_traits import by_shown_health
from crcolony.experiments.colonies.trait_societies import (
    COLUMNS,
    plan_societies,
    societies_of,
    society_ahead,
    trait_moves,
)
from crcolony.experiments.framework.experiment import (
    Experiment,
    Job,
    Plan,
    Row,
    pairs_of,
    values_of,
)
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORLD = "default"
HONEST, LYING, DOUBTING = "honest", "lying", "doubting"
SOCIETIES = {
    HONEST: partial(by_shown_health, lies=False, doubts=False),
    LYING: partial(by_shown_health, lies=True, doubts=False),
    DOUBTING: partial(by_shown_health, lies=True, doubts=True),
}
GENERATIONS = 30


def plan_jobs(plan: Plan) -> list[Job]:
    """Return for each seed a run of the founders and then of all societies."""
    return plan_societies(plan, {WORLD: ()}, GENERATIONS, SOCIETIES)


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw lies and doubt by generation, and what agents achieve, a point a run."""
    from crcolony.results.plots.style import LINES, PAGE_IN, format_axes, new_figure

    figure = new_figure(PAGE_IN, 2.3)
    lie, doubt, matings = figure.subplots(1, 3)
    own = societies_of(rows, WORLD)
    for line, society in zip(LINES, SOCIETIES, strict=False):
        for axes, trait in ((lie, "lie"), (doubt, "doubt")):
            points, quartiles = quartiles_of(own, society, "generation", trait)
            draw_quartiles(axes, points, quartiles, society, line)
    for axes, title in (
        (lie, "lie (neutral in honest)"),
        (doubt, "doubt (neutral but in doubting)"),
    ):
        format_axes(axes, title, top=1.0)
        axes.set_xlabel("generation")
    lie.legend()
    for line, society in zip(LINES[1:], (LYING, DOUBTING), strict=False):
        one, honest = pairs_of(own, "energy_weighted_matings_end", society, HONEST)
        matings.plot(honest, one, "o", color=line["color"], label=society)
    top = values_of(own, "energy_weighted_matings_end", HONEST).max()
    matings.plot((0.0, top), (0.0, top), color="black", linewidth=0.5)
    format_axes(matings, "energy-weighted matings, end")
    matings.set(xlabel="honest", ylabel="lying, or doubting")
    return figure


EXPERIMENT = Experiment(
    name="lying",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "lies-spread": partial(trait_moves, "lie", 1, WORLD, LYING, HONEST),
        "lies-blind": partial(society_ahead, "selection", -1, WORLD, LYING, HONEST),
        "lies-cost": partial(
            society_ahead, "energy_weighted_matings_end", -1, WORLD, LYING, HONEST
        ),
        "doubt-spreads": partial(trait_moves, "doubt", 1, WORLD, DOUBTING, LYING),
        "doubt-helps": partial(
            society_ahead, "energy_weighted_matings_end", 1, WORLD, DOUBTING, LYING
        ),
    },
    draw=draw,
)
