"""Mating strategies (Elfwing and Doya 2014): foragers, trackers, and mixtures of the two.

A colony evolves in arenas with few or many batteries. Then its last population is divided by hand into foragers and
trackers, which differ in nothing but what they do where they see both a battery and a mate, and lives newborn, without
evolving, with every share of foragers.
"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.evolution.genotype import Schema
from crcolony.evolution.history import Born, Event, Mated
from crcolony.experiments.colonies.colony_run import founders_of, run_colony
from crcolony.experiments.colonies.mating_strategy import (
    FORAGER,
    TRACKER,
    as_forager,
    as_tracker,
    strategies_of,
    threshold_of,
)
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, values_of
from crcolony.experiments.mating_strategies_claims import (
    DENSITIES,
    MEASURES,
    SHARES,
    condition_of,
    curve_of,
)
from crcolony.in_process.colony import InProcessColony
from crcolony.randomness import generator, new_streams
from crcolony.robot.genes import agent_schema

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GENERATIONS = 200
LIVES = 8
"""How often a mixture lives, in arenas of other seeds"""
_QUICK = ("generations=3", "life.agents=4", "life.slices=2", "life.slice_steps=50")
_QUICK_LIVES = 1
_MIXTURES = 7
"""The name of the streams by which mixtures are drawn"""
_ARENAS_APART = 1_000_000
"""Seeds of the arenas of two lives differ by this, so that no two runs share one"""
_CHUNK_TICKS = 100_000
_NAME = "mixture"

COLUMNS = {
    "packs_per_robot": Column("batteries in the arena for each robot", "batteries"),
    "foragers": Column(
        "share of the last population that forages whenever it sees a battery and a mate"
    ),
    "trackers": Column("share that tracks the mate from an energy on, or always"),
    "threshold": Column("energy from which trackers track, median; 0: always"),
    "matings_end": Column("matings of an agent, mean of the last 10 generations", "matings"),
    "captures_end": Column(
        "captured batteries of an agent, mean of the last 10 generations", "batteries"
    ),
    "starved_end": Column("share of agents that starved, mean of the last 10 generations"),
    "share": Column("share of foragers in a mixture made by hand"),
    "forager_fitness": Column("energy-weighted matings of a forager in it, its expected offspring"),
    "tracker_fitness": Column("the same of a tracker"),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each density for each seed."""
    return [
        Job(
            condition_of(density),
            seed,
            partial(
                run,
                load(
                    None,
                    [
                        f"seed={seed}",
                        f"generations={GENERATIONS}",
                        f"arena.packs_per_robot={density}",
                        *(_QUICK if plan.is_quick else ()),
                    ],
                ),
                _QUICK_LIVES if plan.is_quick else LIVES,
            ),
        )
        for seed in plan.seeds
        for density in DENSITIES
    ]


def run(config: Config, lives: int) -> list[Row]:
    """Let a colony evolve; return what its last population is, and the fitness of both in every mixture of it."""
    lived = run_colony(config)
    genotypes, schema = lived.genotypes, lived.colony.schema
    outcome = lived.outcome("")
    strategies = strategies_of(genotypes, schema)
    found: Row = {
        "packs_per_robot": config.arena.packs_per_robot,
        "foragers": float((strategies == FORAGER).mean()),
        "trackers": float((strategies == TRACKER).mean()),
        "matings_end": outcome.matings_end,
        "captures_end": outcome.captures_end,
        "starved_end": outcome.starved_end,
    }
    if (strategies == TRACKER).any():
        tracking = genotypes[strategies == TRACKER]
        found["threshold"] = float(np.median([threshold_of(genes, schema) for genes in tracking]))
    rows = [found]
    for share in SHARES:
        forager, tracker = fitness_in_mixture(config, genotypes, schema, share, lives)
        mixture: Row = {"packs_per_robot": config.arena.packs_per_robot, "share": share}
        fitness = {"forager_fitness": forager, "tracker_fitness": tracker}
        rows.append(mixture | {name: value for name, value in fitness.items() if value == value})
    return rows


def fitness_in_mixture(
    config: Config, genotypes: FloatArray, schema: Schema, share: float, lives: int
) -> tuple[float, float]:
    """Return the energy-weighted matings of a forager and of a tracker where a share are foragers; NaN without any.

    `genotypes` are (agents of all robots, genes). In every life others of them are made the one or the other, as many
    in each robot.
    """
    rng = generator(new_streams(config.seed, (_MIXTURES, round(1000 * share)), 1)[0])
    robots, agents = config.robots, config.life.agents
    foragers = np.apply_along_axis(as_forager, 1, genotypes, schema)
    trackers = np.apply_along_axis(as_tracker, 1, genotypes, schema)
    by_forager, by_tracker = [], []
    for life in range(lives):
        order = np.argsort(rng.random((robots, agents)), axis=1)
        forages = (order < round(share * agents)).reshape(-1)
        mixture = np.where(forages[:, None], foragers, trackers)
        seed = config.seed + _ARENAS_APART * (life + 1)
        lived = msgspec.structs.replace(config, generations=1, seed=seed)
        fitness = _live(lived, mixture.reshape(robots, agents, -1))
        by_forager.append(fitness[forages])
        by_tracker.append(fitness[~forages])
    return _mean(np.concatenate(by_forager)), _mean(np.concatenate(by_tracker))


def _live(config: Config, genotypes: FloatArray) -> FloatArray:
    """Let genotypes (robots, agents, genes) live a generation, newborn; return energy-weighted matings (agents,)."""
    earned: dict[str, float] = {}

    def record(event: Event) -> None:
        if isinstance(event, Born) and event.generation == 0:
            earned[event.agent] = 0.0
        elif isinstance(event, Mated):
            earned[event.agent] += event.energy
            earned[event.partner] += event.partner_energy

    schema = agent_schema(config.learning, config.heredity)
    colony = InProcessColony(config, record, founders_of(genotypes, schema, _NAME))
    colony.start()
    while colony.generation == 0:
        colony.run(_CHUNK_TICKS)
    return np.array(list(earned.values()))


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if values.size else np.nan


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw who evolves, a point a run, and the fitness of both by the share of foragers, a panel a density."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.4)
    evolved, *panels = figure.subplots(1, 1 + len(DENSITIES))
    for k, density in enumerate(DENSITIES):
        values = values_of(rows, "foragers", condition_of(density))
        at = k + np.linspace(-0.15, 0.15, values.size)
        evolved.plot(at, values, "o", color=LINES[0]["color"], markersize=3)
    evolved.set_xticks(range(len(DENSITIES)), [f"{density:g}" for density in DENSITIES])
    evolved.set(xlabel="batteries a robot", ylabel="share of foragers", ylim=(-0.05, 1.05))
    for panel, density in zip(panels, DENSITIES, strict=True):
        for line, kind in zip(LINES, (FORAGER, TRACKER), strict=False):
            shares, fitness = curve_of(rows, density, f"{kind}_fitness")
            panel.plot(shares, fitness.mean(axis=0), **line, label=f"{kind}s")
            low, high = np.quantile(fitness, (0.25, 0.75), axis=0)
            panel.fill_between(shares, low, high, color=line["color"], alpha=0.2)
        panel.set(title=f"{density:g} batteries a robot", xlabel="share of foragers")
        panel.set_ylim(bottom=0.0)
    panels[0].set_ylabel("energy-weighted matings")
    panels[0].legend()
    return figure


EXPERIMENT = Experiment("mating-strategies", COLUMNS, plan_jobs, MEASURES, draw)
