"""Darwinian embodied evolution of the learning ability (Paper III, thesis 5.3): selection by mating, or central.

Runs of one seed begin with the same founders in the same arena, whatever the selection, and are compared in pairs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.experiments.colonies.colony_run import run_colony
from crcolony.experiments.colonies.colony_transfer import ROBOTS, best_agent, learning_curves
from crcolony.experiments.colonies.foraging_lives import BODIES
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Plan,
    Row,
    values_of,
)
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.framework.similar_curves import THIRDS
from crcolony.experiments.learning_ability_claims import (
    CENTRAL,
    IMPLICIT,
    MEASURES,
    POTENTIALS,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FINAL_LIVES, TRANSFER_ARENAS = 3, 10
"""Lives of the last agents in arenas of their own, by which the best is chosen, and arenas in which it learns in each
body."""
_QUICK = ("generations=6", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_LEARNT = {"matings": "matings of an agent", "captures": "captured batteries of an agent"}
_END = "mean of the last 10 generations"

COLUMNS = {
    "matings_first": Column("matings of an agent, generation 0", "matings"),
    "matings_early": Column("matings of an agent, mean of generations 5 to 14", "matings"),
    "matings_end": Column(f"matings of an agent, {_END}", "matings"),
    "energy_weighted_matings_first": Column("the robot's energy summed over matings, generation 0"),
    "energy_weighted_matings_end": Column(f"the robot's energy summed over matings, {_END}"),
    "captures_first": Column("captured batteries of an agent, generation 0", "batteries"),
    "captures_end": Column(f"captured batteries of an agent, {_END}", "batteries"),
    "energy_end": Column(f"mean energy while alive, 0 to 1, {_END}"),
    "starved_end": Column(f"share of agents that starved, {_END}"),
    "mating_share_end": Column(f"share of steps in the mating module, {_END}"),
    "mating_lambda_end": Column(f"λ of mating, mean over agents, {_END}"),
    "mating_tau_end": Column(f"τ of mating, median over agents, {_END}"),
    "foraging_tau_end": Column(f"τ of foraging, median over agents, {_END}"),
    "mating_effective_tau_end": Column(f"τ of mating at the end of a life, median, {_END}"),
    "foraging_effective_tau_end": Column(f"τ of foraging at the end of a life, median, {_END}"),
    "energy_effect": Column("rise of P(mating module) from energy 0.2 to 0.9, all else equal"),
    "energy_effect_facing": Column("the same, with a face in sight"),
    "energy_effect_searching": Column("the same, with none in sight"),
    "energy_correlation": Column("raw correlation of energy and choice of the mating module"),
    "history_hash": Column("hash of all births, matings, deaths and turnovers"),
    "mating_tau_neutral": Column(f"τ of mating if it were a neutral gene, {_END}"),
    "foraging_tau_neutral": Column(f"τ of foraging if it were a neutral gene, {_END}"),
    **{
        name: Column(f"potential of mating, weight {k}, mean over the last agents")
        for k, name in enumerate(POTENTIALS)
    },
    "slice": Column("slice of a life in which the best agent learns anew, from 1"),
    **{
        f"curve_{what}_{body}": Column(f"{meaning} in it, {body} body", what)
        for what, meaning in _LEARNT.items()
        for body in BODIES
    },
    **{
        f"transfer_{what}_{part}_{body}": Column(f"{meaning}, {of}, best agent, {body} body", what)
        for what, meaning in _LEARNT.items()
        for part, of in (
            *((third, f"{third} third of a life") for third in THIRDS),
            ("life", "life"),
        )
        for body in BODIES
    },
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each selection for each seed; the best agent of selection by mating then goes to all bodies."""
    quick = _QUICK if plan.is_quick else ()
    jobs: list[Job] = []
    for seed in plan.seeds:
        for selection in (IMPLICIT, CENTRAL):
            settings = (f"seed={seed}", f"selection={selection}", *quick)
            bodies = {
                name: load(None, [*settings, f"robots={ROBOTS}", *body])
                for name, body in BODIES.items()
                if selection == IMPLICIT
            }
            jobs.append(Job(selection, seed, partial(run, load(None, settings), bodies)))
    return jobs


def run(config: Config, bodies: Mapping[str, Config]) -> list[Row]:
    """Run a colony; return its outcome, neutral genes beside τ, and the potential that it ends with.

    With `bodies`, also how its best agent learns in them: a row of each slice of a life, and sums.
    """
    lived = run_colony(config)
    schema, genotypes = lived.colony.schema, lived.genotypes
    neutral = lived.neutral_means(["mating.tau", "foraging.tau"])
    row: Row = asdict(lived.outcome(config.selection))
    del row["condition"], row["seed"]
    row["mating_tau_neutral"] = neutral["mating.tau"]
    row["foraging_tau_neutral"] = neutral["foraging.tau"]
    for k, name in enumerate(POTENTIALS):
        row[name] = float(genotypes[:, schema.index(f"mating.potential.{k}")].mean())
    if not bodies:
        return [row]
    curves, sums = _transfer(config, genotypes, bodies)
    return [row | sums, *curves]


def _transfer(
    config: Config, genotypes: FloatArray, bodies: Mapping[str, Config]
) -> tuple[list[Row], Row]:
    """Return how the best of the last agents (agents, genes) learns in each body, slice by slice and in sums."""
    rng = np.random.default_rng([config.seed, 1])
    choosing, arenas = (
        rng.integers(2**62, size=count).tolist() for count in (FINAL_LIVES, TRANSFER_ARENAS)
    )
    by_robot = genotypes.reshape(config.robots, config.life.agents, -1)
    best = best_agent(config, by_robot, choosing)
    rows: list[Row] = [{"slice": k + 1} for k in range(config.life.slices)]
    sums: Row = {}
    for body, other in bodies.items():
        learnt = learning_curves(other, best, arenas)
        for what, curve in asdict(learnt).items():
            for slice_row, value in zip(rows, curve.tolist(), strict=True):
                slice_row[f"curve_{what}_{body}"] = value
            sums[f"transfer_{what}_life_{body}"] = float(curve.sum())
            for third, part in zip(THIRDS, np.array_split(curve, len(THIRDS)), strict=True):
                sums[f"transfer_{what}_{third}_{body}"] = float(part.sum())
    return rows, sums


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw every run as a point: matings early and at the end, τ beside neutral genes, and λ by matings.

    Below are the learning curves of the best agents in all bodies: medians, and the middle half of runs.
    """
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 4.8)
    (start, tau, trace), (mating, foraging, unused) = figure.subplots(2, 3)
    _draw_transfer(rows, {"matings": mating, "captures": foraging})
    unused.set_axis_off()
    places = {"matings_early": "generations\n5 to 14", "matings_end": "end"}
    for k, selection in enumerate((IMPLICIT, CENTRAL)):
        for x, column in enumerate(places):
            values = values_of(rows, column, selection)
            jitter = np.linspace(-0.12, 0.12, max(values.size, 1))[: values.size]
            start.plot(
                x + 0.35 * (k - 0.5) + jitter,
                values,
                marker="os"[k],
                linestyle="",
                color=LINES[k]["color"],
                label=selection if x == 0 else None,
            )
    start.set_xticks(range(len(places)), places.values())
    start.set_ylabel("matings of an agent")
    start.set_ylim(bottom=0.0)
    start.legend()
    modules = ("mating", "foraging")
    for x, module in enumerate(modules):
        for k, kind in enumerate(("end", "neutral")):
            values = values_of(rows, f"{module}_tau_{kind}", IMPLICIT)
            at = np.full(values.size, x + 0.3 * (k - 0.5))
            label = ("evolved", "neutral gene")[k] if x == 0 else None
            tau.plot(at, values, "os"[k], color=LINES[2 + k]["color"], label=label)
    tau.set_xticks(range(len(modules)), modules)
    tau.set(ylabel="τ at the end", ylim=(0.0, 1.0))
    tau.legend()
    matings = values_of(rows, "matings_end", IMPLICIT)
    trace.plot(
        matings, values_of(rows, "mating_lambda_end", IMPLICIT), "o", color=LINES[0]["color"]
    )
    trace.set(xlabel="matings of an agent, end", ylabel="λ of mating", ylim=(0.0, 1.0))
    return figure


def _draw_transfer(rows: Sequence[Row], all_axes: Mapping[str, "Axes"]) -> None:
    from crcolony.results.plots.style import LINES

    for what, axes in all_axes.items():
        for body, line in zip(BODIES, LINES, strict=False):
            curve = quartiles_of(rows, IMPLICIT, "slice", f"curve_{what}_{body}")
            draw_quartiles(axes, *curve, f"{body} body", line)
        axes.set(xlabel="slice of a life", ylabel=f"{what} of an agent", ylim=(0.0, None))
    all_axes["matings"].legend()


EXPERIMENT = Experiment("learning-ability", COLUMNS, plan_jobs, MEASURES, draw)
