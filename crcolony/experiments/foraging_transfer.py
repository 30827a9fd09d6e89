"""Co-evolution of shaping rewards and meta-parameters in foraging, and transfer to another body (Paper IV, thesis 5.4).

Agents of one robot evolve by Algorithm 4.1, with the packs that they capture in a life as fitness. The best one is then
learnt again from the start, in lives in its own body and in two others. Paper IV went to a real robot instead.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.genotype import Schema
from crcolony.experiments.colonies.foraging_evolution import (
    AGENTS,
    Generation,
    arena_seed,
    choose_best,
    evolve_foragers,
)
from crcolony.experiments.colonies.foraging_lives import (
    BODIES,
    LIFE_STEPS,
    WINDOW_STEPS,
    WINDOWS,
    forage,
    foraging_config,
    foraging_schema,
)
from crcolony.experiments.foraging_transfer_claims import (
    BOTH,
    LAST,
    MEASURES,
    META_ALONE,
)
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, Value
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.framework.similar_curves import THIRDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GENERATIONS, TEST_RUNS = 60, 5
"""Arenas in which the best is measured, with as many lives in each as there are agents, are `TEST_RUNS`."""
_QUICK = 3
"""Generations, and one arena"""

COLUMNS = {
    "generation": Column("generation of these values of a population", "generations"),
    "packs_mean": Column("packs of a life, mean over agents", "packs"),
    "lambda_mean": Column("gene lambda of foraging, mean over agents"),
    "temperature": Column("tau of foraging, mean over the steps of a life, median over agents"),
    "window": Column(f"part of a life, of {WINDOW_STEPS} control steps, from 1"),
    **{
        f"packs_{body}": Column(f"packs captured in it, mean over lives, {body} body", "packs")
        for body in BODIES
    },
    **{
        f"{third}_{body}": Column(f"packs in the {third} third of a life, {body} body", "packs")
        for third in THIRDS
        for body in BODIES
    },
    **{f"life_{body}": Column(f"packs of a life, {body} body", "packs") for body in BODIES},
    "lambda_end": Column(f"gene lambda of foraging, mean over agents and {LAST} last generations"),
    "temperature_first": Column("temperature, generation 0"),
    "temperature_end": Column(f"temperature, mean over the {LAST} last generations"),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run with shaping and one without for each seed."""
    sizes = (_QUICK, 1) if plan.is_quick else (GENERATIONS, TEST_RUNS)
    return [
        Job(condition, seed, partial(run, shaping, *sizes, seed))
        for seed in plan.seeds
        for condition, shaping in ((BOTH, True), (META_ALONE, False))
    ]


def run(shaping: bool, generations: int, test_runs: int, seed: int) -> list[Row]:
    """Let agents evolve; return rows of generations, of learning curves in all bodies, and of what came of it."""
    config, rng = foraging_config(AGENTS, shaping), np.random.default_rng(seed)
    schema = foraging_schema(config)
    lived = list(evolve_foragers(config, generations, rng))
    rows = [_generation_row(number, schema, one) for number, one in enumerate(lived)]
    best = choose_best(config, lived[-1].genotypes, rng)
    seeds = [arena_seed(rng) for _ in range(test_runs)]
    curves = {body: _curve(foraging_config(AGENTS, shaping, body), best, seeds) for body in BODIES}
    curve: list[Row] = [
        {"window": k + 1, **{f"packs_{body}": float(own[k]) for body, own in curves.items()}}
        for k in range(WINDOWS)
    ]
    found: Row = {
        "lambda_end": float(np.mean([row["lambda_mean"] for row in rows[-LAST:]])),
        "temperature_first": rows[0]["temperature"],
        "temperature_end": float(np.mean([row["temperature"] for row in rows[-LAST:]])),
    }
    for body, own in curves.items():
        found[f"life_{body}"] = float(own.sum())
        for third, part in zip(THIRDS, np.array_split(own, len(THIRDS)), strict=True):
            found[f"{third}_{body}"] = float(part.sum())
    return [*(dict[str, Value](row) for row in rows), *curve, found]


def _curve(config: Config, genes: FloatArray, seeds: Sequence[int]) -> FloatArray:
    """Return the packs (WINDOWS,) in each part of a life, mean over lives of one genotype."""
    everyone = np.tile(genes, (AGENTS, 1))
    packs = [forage(config, everyone, seed) for seed in seeds]
    return np.asarray(np.concatenate(packs).mean(axis=0))


def _generation_row(number: int, schema: Schema, lived: Generation) -> dict[str, float]:
    lambdas, taus, decays = (
        lived.genotypes[:, schema.index(f"foraging.{meta}")]
        for meta in ("lambda", "tau", "tau_decay")
    )
    temperatures = taus[:, None] / (1.0 + decays[:, None] * np.arange(LIFE_STEPS))
    return {
        "generation": number,
        "packs_mean": float(lived.packs.mean()),
        "lambda_mean": float(lambdas.mean()),
        "temperature": float(np.median(temperatures.mean(axis=1))),
    }


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw learning curves in all bodies, and packs and genes by generation: medians, and the middle half of seeds."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.4)
    curves, evolution, genes = figure.subplots(1, 3)
    for axes, shown in (
        (
            curves,
            (
                ("own body", BOTH, "window", "packs_own"),
                ("worn", BOTH, "window", "packs_worn"),
                ("delayed", BOTH, "window", "packs_delayed"),
                ("own, meta-parameters alone", META_ALONE, "window", "packs_own"),
            ),
        ),
        (
            evolution,
            (
                ("both", BOTH, "generation", "packs_mean"),
                ("meta-parameters alone", META_ALONE, "generation", "packs_mean"),
            ),
        ),
        (
            genes,
            (
                ("λ", BOTH, "generation", "lambda_mean"),
                ("τ", BOTH, "generation", "temperature"),
            ),
        ),
    ):
        for (label, condition, along, column), line in zip(shown, LINES, strict=False):
            draw_quartiles(axes, *quartiles_of(rows, condition, along, column), label, line)
        axes.legend()
    curves.set(xlabel=f"part of a life ({WINDOW_STEPS} steps)", ylabel="packs", ylim=(0.0, None))
    evolution.set(xlabel="generation", ylabel="packs of a life", ylim=(0.0, None))
    genes.set(xlabel="generation", ylabel="gene", ylim=(0.0, 1.0))
    return figure


EXPERIMENT = Experiment("foraging-transfer", COLUMNS, plan_jobs, MEASURES, draw)
