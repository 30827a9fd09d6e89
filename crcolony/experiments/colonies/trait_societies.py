"""Societies: colonies of the same founders, whose agents weigh their partners in different ways, side by side.

A society is compared with another of the same seed: with the same founders, and at first the same traits.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Literal

import msgspec
import numpy as np

from crcolony.config import Config, load
from crcolony.experiments.colonies.colony_run import founders_of, run_colony
from crcolony.experiments.colonies.mating_traits import NAMES, Acceptance
from crcolony.experiments.colonies.trait_run import TraitRun, run_with_traits
from crcolony.experiments.framework.experiment import (
    CONDITION,
    Column,
    Job,
    Measured,
    Plan,
    Row,
    pairs_of,
    verdict_of,
)
from crcolony.experiments.framework.measured_pairs import measured_pairs, measured_ratio
from crcolony.experiments.framework.registration import Claim
from crcolony.experiments.framework.statistics import LEVEL, mean_interval, one_sided_p
from crcolony.results.generation_table import LAST_GENERATIONS

SMALL = "life.agents=10"
"""Half as many virtual agents in a robot as by default, so that all runs take minutes."""
FOUNDERS_GENERATIONS = 40
_QUICK = ("generations=3", "life.agents=4", "life.slices=2", "life.slice_steps=100")
_QUICK_GENERATIONS = 3
OUTCOMES = ("energy_weighted_matings", "matings", "captures", "energy", "starved")
_FOUNDERS = "founders"
_END = "mean of the last 10 generations"

COLUMNS = {
    "society": Column("how agents weigh their partners"),
    "generation": Column("counted from the founders", "generations"),
    **{name: Column(f"mean of the trait {name} over the newborn, 0 to 1") for name in NAMES},
    **{f"{name}_end": Column(f"the same, {_END}") for name in NAMES},
    "energy_weighted_matings_end": Column(f"the robot's energy summed over matings, {_END}"),
    "matings_end": Column(f"matings of an agent, {_END}", "matings"),
    "captures_end": Column(f"captured batteries of an agent, {_END}", "batteries"),
    "energy_end": Column(f"mean energy while alive, 0 to 1, {_END}"),
    "starved_end": Column(f"share of agents that starved, {_END}"),
    "accepted": Column("share of the times that an agent met another in which it conceived"),
    "selection": Column("energy of the partners that agents conceive with, less that of all met"),
}


def plan_societies(
    plan: Plan,
    worlds: Mapping[str, Sequence[str]],
    generations: int,
    societies: Mapping[str, Acceptance],
) -> list[Job]:
    """Return for each seed and world, by its settings, a run of the founders and then of all societies."""
    size = _QUICK if plan.is_quick else (SMALL, f"generations={FOUNDERS_GENERATIONS}")
    lasting = _QUICK_GENERATIONS if plan.is_quick else generations
    return [
        Job(
            world,
            seed,
            partial(
                run_societies, load(None, [f"seed={seed}", *settings, *size]), lasting, societies
            ),
        )
        for seed in plan.seeds
        for world, settings in worlds.items()
    ]


def run_societies(
    config: Config, generations: int, societies: Mapping[str, Acceptance]
) -> list[Row]:
    """Let a colony evolve, and from its last population one society after another, for so many generations.

    Return of each a row a generation, and one of what came of it.
    """
    lived = run_colony(config)
    founders = founders_of(lived.colony.batch.genotypes.copy(), lived.colony.schema, _FOUNDERS)
    settings = msgspec.structs.replace(config, generations=generations)
    return [
        row
        for name, accept in societies.items()
        for row in _rows_of(name, run_with_traits(settings, founders, accept))
    ]


def _rows_of(society: str, lived: TraitRun) -> list[Row]:
    rows: list[Row] = [
        {"society": society, "generation": generation, **dict(zip(NAMES, means, strict=True))}
        for generation, means in enumerate(lived.traits.tolist())
    ]
    last = slice(-LAST_GENERATIONS, None)
    traits = lived.traits[last].mean(axis=0).tolist()
    outcome: Row = {f"{name}_end": value for name, value in zip(NAMES, traits, strict=True)}
    for name in OUTCOMES:
        outcome[f"{name}_end"] = float(np.mean([row[name] for row in lived.rows[last]]))
    for name, value in (("accepted", lived.accepted), ("selection", lived.selection)):
        if value == value:  # a colony may not mate at all
            outcome[name] = value
    return [*rows, {"society": society, **outcome}]


def societies_of(rows: Sequence[Row], world: str) -> list[Row]:
    """Return the rows of a world, with their society as the condition."""
    return [{**row, CONDITION: row["society"]} for row in rows if row[CONDITION] == world]


def trait_moves(
    trait: str,
    sign: Literal[1, -1],
    world: str,
    one: str,
    other: str,
    claim: Claim,
    rows: Sequence[Row],
) -> Measured:
    """Measure how far above (sign 1) or below a trait ends in a society that pays attention to it.

    In the other one it is neutral.
    """
    own, neutral = pairs_of(societies_of(rows, world), f"{trait}_end", one, other)
    difference = mean_interval(own - neutral)
    p = one_sided_p(own - neutral, 0.0, "greater" if sign > 0 else "less")
    is_met = sign * (difference.estimate - claim.threshold) > 0.0 and p < LEVEL
    return measured_pairs(
        difference,
        own,
        neutral,
        statistic=f"{own.mean():.2f} against {neutral.mean():.2f} where it is neutral; one-sided paired t-test,"
        f" {own.size} pairs",
        p=p,
        verdict=verdict_of(is_met, p < LEVEL),
    )


def society_ahead(
    column: str,
    sign: Literal[1, -1],
    world: str,
    one: str,
    other: str,
    claim: Claim,
    rows: Sequence[Row],
) -> Measured:
    """Measure the ratio of a column of two societies, to be above (sign 1) or below the threshold."""
    own, others = pairs_of(societies_of(rows, world), column, one, other)
    return measured_ratio(
        claim,
        own,
        others,
        statistic=f"{own.mean():.3g} against {others.mean():.3g}; one-sided paired t-test, {own.size} pairs",
        alternative="greater" if sign > 0 else "less",
    )
