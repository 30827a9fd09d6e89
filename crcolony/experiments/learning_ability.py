"""Darwinian embodied evolution of the learning ability (Paper III, thesis 5.3): selection by mating, or central.

Runs of one seed begin with the same founders in the same arena, whatever the selection, and are compared in pairs.
"""

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.experiments.colonies.colony_run import run_colony
from crcolony.experiments.colonies.default_world_criteria import MARGIN
from crcolony.experiments.framework.experiment import (
    Column,
    Experiment,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    values_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import (
    LEVEL,
    effect_size,
    equivalence,
    mean_interval,
    mean_pairwise_correlation,
    one_sided_p,
    rank_correlation,
    ratio_interval,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMPLICIT, CENTRAL = "implicit", "central"
_QUICK = ("generations=6", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_POTENTIAL = "mating_potential_"
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
        f"{_POTENTIAL}{k}": Column(f"potential of mating, weight {k}, mean over the last agents")
        for k in range(Config().learning.potential_distances * Config().learning.potential_bearings)
    },
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each selection for each seed."""
    quick = _QUICK if plan.is_quick else ()
    return [
        Job(
            selection,
            seed,
            partial(run, load(None, [f"seed={seed}", f"selection={selection}", *quick])),
        )
        for seed in plan.seeds
        for selection in (IMPLICIT, CENTRAL)
    ]


def run(config: Config) -> Row:
    """Run a colony; return its outcome, neutral genes beside τ, and the potential that it ends with."""
    lived = run_colony(config)
    schema, genotypes = lived.colony.schema, lived.genotypes
    neutral = lived.neutral_means(["mating.tau", "foraging.tau"])
    row = asdict(lived.outcome(config.selection))
    del row["condition"], row["seed"]
    row["mating_tau_neutral"] = neutral["mating.tau"]
    row["foraging_tau_neutral"] = neutral["foraging.tau"]
    for name in (name for name in COLUMNS if name.startswith(_POTENTIAL)):
        gene = schema.index(f"mating.potential.{name.removeprefix(_POTENTIAL)}")
        row[name] = float(genotypes[:, gene].mean())
    return row


def _parity(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, central = pairs_of(rows, "energy_weighted_matings_end", IMPLICIT, CENTRAL)
    found = equivalence(own, central, MARGIN * max(float(central.mean()), 1e-12))
    ratio = ratio_interval(own, central)
    return measured_pairs(
        ratio,
        own,
        central,
        statistic=f"not worse by {MARGIN:.0%}: paired t-test, {own.size} pairs; equal within {MARGIN:.0%}:"
        f" p = {found.p:.2g}",
        p=found.p_inferior,
        verdict=verdict_of(found.p_inferior < LEVEL, ratio.estimate >= claim.threshold),
    )


def _better_start(claim: Claim, rows: Sequence[Row]) -> Measured:
    own, central = pairs_of(rows, "matings_early", IMPLICIT, CENTRAL)
    ratio = ratio_interval(own, central)
    p = one_sided_p(own - central, 0.0, "greater")
    return measured_pairs(
        ratio,
        own,
        central,
        statistic=f"one-sided paired t-test, {own.size} pairs",
        p=p,
        verdict=verdict_of(ratio.estimate > claim.threshold and p < LEVEL),
    )


def _tau(module: str, claim: Claim, rows: Sequence[Row]) -> Measured:
    evolved = values_of(rows, f"{module}_tau_end", IMPLICIT)
    neutral = values_of(rows, f"{module}_tau_neutral", IMPLICIT)
    mean = mean_interval(evolved)
    p = one_sided_p(evolved - neutral, 0.0, "less")
    return Measured(
        estimate=mean.estimate,
        low=mean.low,
        high=mean.high,
        statistic=f"neutral genes end at {neutral.mean():.2f}; one-sided paired t-test against them",
        p=p,
        effect="A12",
        effect_size=effect_size(evolved, neutral),
        runs=evolved.size,
        verdict=verdict_of(mean.estimate <= claim.threshold and p < LEVEL, p < LEVEL),
    )


def _lambda(claim: Claim, rows: Sequence[Row]) -> Measured:
    matings = values_of(rows, "matings_end", IMPLICIT)
    found = rank_correlation(matings, values_of(rows, "mating_lambda_end", IMPLICIT))
    return Measured(
        estimate=found.rho,
        low=found.low,
        high=found.high,
        statistic="Spearman",
        p=found.p,
        effect="ρ",
        effect_size=found.rho,
        runs=matings.size,
        verdict=verdict_of(found.rho < claim.threshold and found.p < LEVEL),
    )


def _potentials(claim: Claim, rows: Sequence[Row]) -> Measured:
    names = [name for name in COLUMNS if name.startswith(_POTENTIAL)]
    potentials: FloatArray = np.stack([values_of(rows, name, IMPLICIT) for name in names], axis=1)
    found = mean_pairwise_correlation(potentials)
    return Measured(
        estimate=found.estimate,
        low=found.low,
        high=found.high,
        statistic="bootstrap over runs",
        effect="r",
        effect_size=found.estimate,
        runs=len(potentials),
        verdict=verdict_of(found.high < claim.threshold, found.estimate < claim.threshold),
    )


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw every run as a point: matings early and at the end, τ beside neutral genes, and λ by matings."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.4)
    start, tau, trace = figure.subplots(1, 3)
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


EXPERIMENT = Experiment(
    name="learning-ability",
    columns=COLUMNS,
    jobs=plan_jobs,
    measures={
        "parity": _parity,
        "better-start": _better_start,
        "tau-mating": partial(_tau, "mating"),
        "tau-foraging": partial(_tau, "foraging"),
        "lambda-matings": _lambda,
        "potentials-differ": _potentials,
    },
    draw=draw,
)
