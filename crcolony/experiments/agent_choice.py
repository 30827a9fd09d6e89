"""Which agent to evaluate next (thesis 6.1, after Whiteson and Stone 2006): at random, ε-greedy, or softmax.

All have as many slices of a robot's time in a generation. At random every agent has its share; the informed ways give
more of it to those that mate more often. Therefore the last population of each way lives a generation more, newborn
and in random order.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import msgspec

from crcolony.config import Config, load
from crcolony.experiments.colonies.colony_run import founders_of, run_colony
from crcolony.experiments.colonies.trait_societies import SMALL
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    values_of,
)
from crcolony.experiments.framework.measured_pairs import measured_ratio
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.framework.registration import Claim
from crcolony.in_process.colony import InProcessColony

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RANDOM, GREEDY, SOFTMAX = "random", "epsilon_greedy", "softmax"
WAYS = (RANDOM, GREEDY, SOFTMAX)
GENERATIONS = 50
EARLY = 20
"""The first generations, in which it is to be seen whether evolution is accelerated"""
_QUICK = ("generations=3", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_CHUNK_TICKS = 10_000
_NAME = "evolved"
_PER_AGENT = "mean over the agents of a generation"
_NEWBORN = "of the last population, newborn, in random order"

COLUMNS = {
    "generation": Column("counted from 0", "generations"),
    "matings": Column(f"matings of an agent, {_PER_AGENT}", "matings"),
    "energy_weighted_matings": Column(f"robot's energy summed over matings, {_PER_AGENT}"),
    "captures": Column(f"captured batteries of an agent, {_PER_AGENT}", "batteries"),
    "starved": Column("share of the agents of a generation that starved"),
    "matings_early": Column(f"matings of an agent, mean of the first {EARLY} generations"),
    "energy_weighted_matings_newborn": Column(f"robot's energy summed over matings, {_NEWBORN}"),
    "captures_newborn": Column(f"captured batteries of an agent, {_NEWBORN}", "batteries"),
}
_BY_GENERATION = ("matings", "energy_weighted_matings", "captures", "starved")


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each way for each seed."""
    quick = _QUICK if plan.is_quick else (SMALL, f"generations={GENERATIONS}")
    return [
        Job(
            way,
            seed,
            partial(run, load(None, [f"seed={seed}", f"life.time_sharing={way}", *quick])),
        )
        for seed in plan.seeds
        for way in WAYS
    ]


def run(config: Config) -> list[Row]:
    """Run a colony; return a row a generation, and one of what came of it."""
    lived = run_colony(config)
    rows: list[Row] = [
        {"generation": generation, **{name: row[name] for name in _BY_GENERATION}}
        for generation, row in enumerate(lived.rows)
    ]
    early = [row["matings"] for row in lived.rows[:EARLY]]
    founders = founders_of(lived.colony.batch.genotypes.copy(), lived.colony.schema, _NAME)
    life = msgspec.structs.replace(config.life, time_sharing=RANDOM)
    colony = InProcessColony(
        msgspec.structs.replace(config, life=life, generations=1), lambda _: None, founders
    )
    colony.start()
    while colony.generation == 0:
        colony.run(_CHUNK_TICKS)
    newborn = colony.summary
    outcome: Row = {
        "matings_early": sum(early) / len(early),
        "energy_weighted_matings_newborn": newborn["energy_weighted_matings"],
        "captures_newborn": newborn["captures"],
    }
    return [*rows, outcome]


def _ahead(column: str, way: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    """Measure the ratio of a column, of an informed way over the random one."""
    own, others = pairs_of(rows, column, way, RANDOM)
    return measured_ratio(
        claim,
        own,
        others,
        statistic=f"{own.mean():.3g} against {others.mean():.3g}; one-sided paired t-test, {own.size} pairs",
    )


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw matings and captures by generation, and what the last population is able to do, a point a run."""
    from crcolony.results.plots.style import LINES, PAGE_IN, format_axes, new_figure

    figure = new_figure(PAGE_IN, 2.3)
    matings, captures, newborn = figure.subplots(1, 3)
    for k, way in enumerate(WAYS):
        for axes, column in ((matings, "matings"), (captures, "captures")):
            points, quartiles = quartiles_of(rows, way, "generation", column)
            draw_quartiles(axes, points, quartiles, way, LINES[k])
        values = values_of(rows, "energy_weighted_matings_newborn", way)
        newborn.plot([k] * values.size, values, "o", color=LINES[k]["color"], alpha=0.5)
        newborn.plot(k, values.mean(), "_", color="black", markersize=10)
    for axes, title in ((matings, "matings of an agent"), (captures, "captures of an agent")):
        format_axes(axes, title)
        axes.set_xlabel("generation")
    format_axes(newborn, "energy-weighted matings, newborn")
    newborn.set_xticks(range(len(WAYS)), WAYS)
    matings.legend()
    return figure


EXPERIMENT = Experiment(
    name="agent-choice",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "greedy-accelerates": partial(_ahead, "matings_early", GREEDY),
        "softmax-accelerates": partial(_ahead, "matings_early", SOFTMAX),
        "greedy-evolves-further": partial(_ahead, "energy_weighted_matings_newborn", GREEDY),
        "softmax-evolves-further": partial(_ahead, "energy_weighted_matings_newborn", SOFTMAX),
    },
    draw=draw,
)
