"""Subpopulations without robots, whose agents mate as a test says."""

import numpy as np

from crcolony.evolution.genotype import Gene, Schema
from crcolony.evolution.population import NewAgent, Offspring, Subpopulation
from crcolony.evolution.reproduction import MatingAgent, ReproductionStrategy
from crcolony.evolution.variation import Variation
from crcolony.randomness import new_streams

STREAM = new_streams(1, (9,), 1)[0]
SCHEMA = Schema(tuple(Gene(f"g{k}", -8.0, 8.0, mutation_sd=1.0) for k in range(3)))


def subpopulation(
    robot: str, *genotypes: list[float], mutation: float = 0.0, schema: Schema = SCHEMA
) -> Subpopulation:
    """Return a subpopulation whose agents, `robot/0` and on, have these genes."""
    own = Subpopulation(
        robot, schema, Variation("uniform", mutation), np.zeros((len(genotypes), len(schema))), 50
    )
    own.replace_agents([NewAgent(np.array(genes), None, None) for genes in genotypes], 0, 0)
    return own


def agent(own: Subpopulation, index: int = 0, energy: float = 1.0, matings: int = 1) -> MatingAgent:
    """Return an agent that takes part in a mating."""
    return MatingAgent(own, index, energy, matings, 7)


def meet(
    strategies: tuple[ReproductionStrategy, ReproductionStrategy],
    agents: tuple[MatingAgent, MatingAgent],
) -> tuple[Offspring | None, Offspring | None]:
    """Let two agents mate as robots do: both send, then the first receives, then the other."""
    stream = STREAM.copy()
    first, second = (
        strategy.offer(own, stream) for strategy, own in zip(strategies, agents, strict=True)
    )
    return (
        strategies[0].receive(agents[0], second, stream),
        strategies[1].receive(agents[1], first, stream),
    )
