"""Embodied evolution of survival (Paper II, thesis 5.2): robots that tell their fitness when they meet.

What evolves is a linear network that selects behaviours, which are learnt before, and computes recharge times. After 40
generations the population goes on in a differing world, where Paper II went to real robots. Runs of one seed have the
same behaviours, founders and arenas with either selection, autonomous or central, and are compared in pairs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.config import Config
from crcolony.evolution.selection import roulette
from crcolony.evolution.variation import Variation
from crcolony.experiments.colonies.learnt_behaviours import LEARNING_STEPS, learn_behaviours
from crcolony.experiments.colonies.survival_lives import (
    NOBODY,
    OTHER,
    OWN,
    Lives,
    live,
    survival_config,
    survival_schema,
)
from crcolony.experiments.framework.experiment import Column, Experiment, Job, Plan, Row, Value
from crcolony.experiments.framework.quartile_curve import draw_quartiles, quartiles_of
from crcolony.experiments.survival_claims import AUTONOMOUS, CENTRAL, MEASURES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

END, ADAPTED = 10, 3
"""Generations at the end in the own world, and in the other, of which means are taken"""
VARIATION = Variation("uniform", 0.1)
"""That of the default colony, whatever the selection"""
_SCHEMA = survival_schema()
_FOUNDERS, _ARENAS, _BREEDING = range(3)
"""Names of the random streams of a run"""


@dataclass(frozen=True)
class Scale:
    """How large a run is."""

    generations: int = 40
    """In the own world"""
    generations_after: int = 10
    """In the other"""
    learning_steps: int = LEARNING_STEPS
    """In which a behaviour is learnt"""
    settings: tuple[str, ...] = ()
    """Those of the colony that differ"""


FULL = Scale()
QUICK = Scale(2, 1, 300, ("life.agents=3", "life.slices=2", "life.slice_steps=60"))

Breed = Callable[[FloatArray, Lives, np.random.Generator], FloatArray]
"""Returns the next generation (robots, agents, genes) from this one and its lives"""

COLUMNS = {
    "generation": Column("generation of these values of a population", "generations"),
    "captures": Column("packs captured in a lifetime, mean over agents", "packs"),
    "matings": Column("matings in a lifetime, mean over agents", "matings"),
    "mated": Column("share of agents that have mated"),
    "recharge_steps": Column("recharge time after a capture, mean; 0.2 s each", "control steps"),
    "starved": Column("share of agents that starved"),
    "captures_first": Column("captures, generation 0", "packs"),
    "matings_first": Column("matings, generation 0", "matings"),
    "captures_end": Column(
        f"captures, mean of the last {END} generations in the own world", "packs"
    ),
    "matings_end": Column(
        f"matings, mean of the last {END} generations in the own world", "matings"
    ),
    "captures_transferred": Column("captures, first generation in the other world", "packs"),
    "captures_adapted": Column(
        f"captures, mean of the last {ADAPTED} generations in the other world", "packs"
    ),
}


def plan_jobs(plan: Plan) -> list[Job]:
    """Return a run of each selection for each seed."""
    scale = QUICK if plan.is_quick else FULL
    return [
        Job(selection, seed, partial(run, selection, scale, seed))
        for seed in plan.seeds
        for selection in BREED
    ]


def run(selection: str, scale: Scale, seed: int) -> list[Row]:
    """Let a population evolve in the own world, then in the other; return rows of generations, and what came of it."""
    behaviours = learn_behaviours(seed, scale.learning_steps)
    founders, arenas, breeding = (
        np.random.default_rng([seed, name]) for name in (_FOUNDERS, _ARENAS, _BREEDING)
    )
    genotypes = found_population(survival_config(OWN, scale.settings), founders)
    rows: list[dict[str, float]] = []
    for world, count in ((OWN, scale.generations), (OTHER, scale.generations_after)):
        config = survival_config(world, scale.settings)
        for _ in range(count):
            lives = live(config, behaviours, genotypes, int(arenas.integers(2**62)))
            rows.append(_row(len(rows), lives))
            genotypes = BREED[selection](genotypes, lives, breeding)
    own, other = rows[: scale.generations], rows[scale.generations :]
    found: Row = {
        "captures_first": own[0]["captures"],
        "matings_first": own[0]["matings"],
        "captures_end": _mean(own[-END:], "captures"),
        "matings_end": _mean(own[-END:], "matings"),
        "captures_transferred": other[0]["captures"],
        "captures_adapted": _mean(other[-ADAPTED:], "captures"),
    }
    return [*(dict[str, Value](row) for row in rows), found]


def found_population(config: Config, rng: np.random.Generator) -> FloatArray:
    """Return random genotypes (robots, agents, genes)."""
    agents = [_SCHEMA.random(rng) for _ in range(config.robots * config.life.agents)]
    return np.reshape(agents, (config.robots, config.life.agents, len(_SCHEMA)))


def breed_centrally(genotypes: FloatArray, lives: Lives, rng: np.random.Generator) -> FloatArray:
    """Return offspring of parents that are drawn by roulette on the packs they captured, from all robots (eq. 4.1)."""
    everyone = genotypes.reshape(-1, genotypes.shape[-1])
    fitness = lives.captures.reshape(-1).astype(np.float64)
    parents = roulette(fitness, 2 * len(everyone), rng).reshape(-1, 2)
    offspring = [_cross(everyone[one], everyone[other], rng) for one, other in parents]
    return np.reshape(offspring, genotypes.shape)


def breed_autonomously(genotypes: FloatArray, lives: Lives, rng: np.random.Generator) -> FloatArray:
    """Return, for each robot, offspring of its own agents that have mated with the best partner that each remembers.

    Who is a mother is drawn by roulette on the packs she captured, which her robot knows. Agents of a robot in which
    none has mated live on, mutated.
    """
    everyone = genotypes.reshape(-1, genotypes.shape[-1])
    offspring = np.empty_like(genotypes)
    for robot, own in enumerate(genotypes):
        partners = lives.partners[robot]
        mated = np.flatnonzero(partners != NOBODY)
        if mated.size == 0:
            offspring[robot] = [VARIATION.mutant(genes, _SCHEMA, rng) for genes in own]
            continue
        fitness = lives.captures[robot, mated].astype(np.float64)
        for agent, mother in enumerate(mated[roulette(fitness, len(own), rng)]):
            offspring[robot, agent] = _cross(own[mother], everyone[partners[mother]], rng)
    return offspring


BREED: dict[str, Breed] = {AUTONOMOUS: breed_autonomously, CENTRAL: breed_centrally}


def _cross(one: FloatArray, other: FloatArray, rng: np.random.Generator) -> FloatArray:
    return VARIATION.offspring(one, other, _SCHEMA, rng)


def _row(generation: int, lives: Lives) -> dict[str, float]:
    return {
        "generation": generation,
        "captures": float(lives.captures.mean()),
        "matings": float(lives.matings.mean()),
        "mated": float((lives.partners != NOBODY).mean()),
        "recharge_steps": float(lives.recharge_steps.sum() / max(lives.captures.sum(), 1)),
        "starved": float(lives.has_starved.mean()),
    }


def _mean(rows: Sequence[dict[str, float]], column: str) -> float:
    return float(np.mean([row[column] for row in rows]))


def draw(rows: Sequence[Row]) -> "Figure":
    """Draw captures, matings and recharge times by generation: medians, and the middle half of seeds."""
    from crcolony.results.plots.style import LINES, PAGE_IN, new_figure

    figure = new_figure(PAGE_IN, 2.4)
    panels = {
        "captures": "packs of a lifetime",
        "matings": "matings of a lifetime",
        "recharge_steps": "recharge time (control steps)",
    }
    for axes, (column, label) in zip(figure.subplots(1, len(panels)), panels.items(), strict=True):
        for selection, line in zip(BREED, LINES, strict=False):
            curve = quartiles_of(rows, selection, "generation", column)
            draw_quartiles(axes, *curve, selection, line)
        axes.axvline(FULL.generations - 0.5, color="black", linewidth=0.5)
        axes.set(xlabel="generation", ylabel=label, ylim=(0.0, None))
    axes.legend()
    return figure


EXPERIMENT = Experiment("survival", COLUMNS, plan_jobs, MEASURES, draw)
