"""Basic behaviours that are learnt in advance, each in isolation, and never change again (Paper II, thesis 5.2).

They are learnt as agents of the colony learn, with settings of ours: to forage, one robot is alone with battery packs;
to mate, two robots are alone without any. The learner whose greedy policy then succeeds most often is kept.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray
from crcolony.config import Config, load
from crcolony.evolution.founders import Founders
from crcolony.evolution.history import Event
from crcolony.evolution.population import NewAgent
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.genes import META_PARAMETERS, agent_schema
from crcolony.robot.modules import FORAGING, MATING, MODULES
from crcolony.robot.weight_rows import inherit_weights, weights_by_tile

LEARNERS = 5
"""Of each behaviour, of which the best one is kept"""
LEARNING_STEPS, TEST_STEPS = 20_000, 2_000
"""Control steps of a learner, and of the life in which it is compared with the others"""
_LEARNING = {"alpha": 0.3, "gamma": 0.93, "lambda": 0.7, "tau": 0.05, "tau_decay": 0.001}
"""Meta-parameters with which behaviours are learnt; potentials are 0"""
_FROZEN = dict.fromkeys(META_PARAMETERS, 0.0)
"""Those of an agent that learns nothing more, and does what it has learnt to be best"""
_ISOLATION = {
    FORAGING.name: ("robots=1", "arena.area_per_robot_m2=4.0", "arena.packs_per_robot=4.0"),
    MATING.name: ("robots=2", "arena.packs_per_robot=0.0"),
}
_DRIVE = 3.0
"""Weight of the selector's bias where one behaviour is to be in control always"""


@dataclass(frozen=True, eq=False)
class Behaviours:
    """What has been learnt by an agent, module by module."""

    weights: NDArray[np.float32]
    """Action values (modules, tiles, actions)"""
    is_visited: NDArray[np.bool_]
    """Which of the tiles (modules, tiles) have any"""


def learn_behaviours(seed: int, steps: int = LEARNING_STEPS) -> Behaviours:
    """Return all behaviours, each learnt in so many control steps."""
    learnt = [_learn(module.name, seed, steps) for module in MODULES]
    return Behaviours(
        np.stack([found.weights[m] for m, found in enumerate(learnt)]),
        np.stack([found.is_visited[m] for m, found in enumerate(learnt)]),
    )


def _learn(behaviour: str, seed: int, steps: int) -> Behaviours:
    """Return what the best of some learners has learnt."""
    config = _isolation(behaviour, LEARNERS, steps, seed)
    colony = start_colony(config, _genotypes(config, behaviour, _LEARNING))
    colony.run(LEARNERS * steps - 1)
    tables, visited = weights_by_tile(colony.batch, 0, 0.0), colony.batch.weight_rows[0] >= 0
    learners = [Behaviours(*own) for own in zip(tables, visited, strict=True)]
    return max(learners, key=lambda one: successes_of(one, behaviour, seed, TEST_STEPS))


def successes_of(behaviours: Behaviours, behaviour: str, seed: int, steps: int) -> int:
    """Return how often a behaviour that is learnt succeeds in isolation: packs captured, or encounters of a pair."""
    config = _isolation(behaviour, 1, steps, seed)
    colony = start_colony(config, _genotypes(config, behaviour, _FROZEN), behaviours)
    colony.run(steps - 1)
    counts = {FORAGING.name: colony.batch.captures, MATING.name: colony.batch.matings}
    return int(counts[behaviour][0, 0])


def start_colony(
    config: Config,
    genotypes: FloatArray,
    behaviours: Behaviours | None = None,
    on_event: Callable[[Event], None] = lambda _: None,
) -> InProcessColony:
    """Return a colony of agents (robots, agents, genes) that has started; all have learnt `behaviours` already."""
    agents = tuple(tuple(NewAgent(genes, None, None) for genes in own) for own in genotypes)
    schema = agent_schema(config.learning, config.heredity)
    colony = InProcessColony(config, on_event, Founders(schema.digest, "", agents))
    colony.start()
    if behaviours is not None:
        count = config.life.agents
        weights = np.repeat(behaviours.weights[None], count, axis=0)
        is_visited = np.repeat(behaviours.is_visited[None], count, axis=0)
        for row in range(config.robots):
            inherit_weights(colony.batch, row, weights, is_visited)
    return colony


def frozen_genotypes(config: Config, selectors: FloatArray) -> FloatArray:
    """Return genotypes (robots, agents, genes) of agents with these selectors (robots, agents, selector genes) that do
    not learn."""
    return _with_selectors(config, selectors, _FROZEN)


def _with_selectors(
    config: Config, selectors: FloatArray, meta_parameters: Mapping[str, float]
) -> FloatArray:
    schema = agent_schema(config.learning, config.heredity)
    genotypes = np.zeros((*selectors.shape[:-1], len(schema)))
    genotypes[..., : selectors.shape[-1]] = selectors
    for module in MODULES:
        for name, value in meta_parameters.items():
            genotypes[..., schema.index(f"{module.name}.{name}")] = value
    return genotypes


def _genotypes(config: Config, behaviour: str, meta_parameters: Mapping[str, float]) -> FloatArray:
    """Return genotypes of agents that always do one behaviour."""
    bias = _DRIVE if behaviour == MATING.name else -_DRIVE
    selectors = np.full((config.robots, config.life.agents, 1), bias)
    return _with_selectors(config, selectors, meta_parameters)


def _isolation(behaviour: str, agents: int, steps: int, seed: int) -> Config:
    own = (f"life.agents={agents}", "life.slices=1", f"life.slice_steps={steps}", f"seed={seed}")
    return load(None, [*_ISOLATION[behaviour], *own, "life.energy_per_step=0.0"])
