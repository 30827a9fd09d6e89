"""Central selection (thesis 4.1, 5.3): one population over all robots, and roulette on the number of matings.

It is the baseline that implicit selection is compared with.
"""

from typing import Any

import numpy as np

from crcolony.evolution.genotype import Schema
from crcolony.evolution.lineage import Birth
from crcolony.evolution.population import NewAgent
from crcolony.evolution.selection import roulette
from crcolony.evolution.variation import Variation
from crcolony.randomness import generator, new_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots


class CentralSelection:
    """Breeds the next generation of all robots at once, from the matings of all agents."""

    def __init__(self, schema: Schema, variation: Variation, seed: int) -> None:
        self._stream = new_streams(seed, (2,), 1)[0]
        self._schema = schema
        self._variation = variation

    def turn_over(self, robots: list[Robot], batch: Robots) -> list[list[Birth]]:
        """Give every robot offspring of parents drawn by roulette from all agents; return the births of each robot."""
        rng = generator(self._stream)
        genotypes = np.concatenate([robot.subpopulation.genotypes for robot in robots]).copy()
        ids = [name for robot in robots for name in robot.subpopulation.ids]
        fitness = np.concatenate([batch.matings[robot.row] for robot in robots]).astype(float)
        births = []
        for robot in robots:
            offspring = []
            for _ in robot.subpopulation.ids:
                mother, father = roulette(fitness, 2, rng)
                genes = self._variation.offspring(
                    genotypes[mother], genotypes[father], self._schema, rng
                )
                offspring.append(NewAgent(genes, ids[mother], ids[father]))
            births.append(robot.turn_over(offspring))
        return births

    def save(self) -> Any:
        """Return a copy of its random stream, which is all that it remembers."""
        return self._stream.copy()

    def restore(self, saved: Any) -> None:
        """Restore the random stream; raises ValueError or TypeError if it is none."""
        self._stream[...] = saved
