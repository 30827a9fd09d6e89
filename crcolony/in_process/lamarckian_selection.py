"""Central schemes that hand on what agents have learnt: instances of a learning algorithm compete (OMPAC, GPBT-PL).

Every virtual agent of every robot is an instance; a generation is the time after which they are compared, by their
matings, as central selection does. What an instance has learnt goes on with the one that is selected, in whichever
robot; its energy begins anew, so that one that has starved comes back.
"""

from typing import Any, Protocol

import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.lineage import Birth
from crcolony.evolution.population import NewAgent
from crcolony.randomness import generator, new_streams
from crcolony.robot.robot import Robot
from crcolony.robot.state import Robots
from crcolony.robot.weight_rows import inherit_weights, weights_by_tile


class Competition(Protocol):
    """How instances are compared."""

    memory: FloatArray
    """What is remembered of every instance, (N, numbers)"""

    def compete(
        self, genotypes: FloatArray, fitness: FloatArray, rng: np.random.Generator
    ) -> tuple[IntArray, FloatArray]:
        """Return whose learning each instance goes on with, (N,), and its genes, (N, genes), from the present genes
        (N, genes) and the fitness (N,)."""
        ...


class LamarckianSelection:
    """Turns all robots over by a competition of all agents."""

    def __init__(self, competition: Competition, seed: int) -> None:
        self._competition = competition
        self._stream = new_streams(seed, (3,), 1)[0]

    def turn_over(self, robots: list[Robot], batch: Robots) -> list[list[Birth]]:
        """Give every robot its next agents, with what they have learnt; return the births of each robot."""
        rows = [robot.row for robot in robots]
        ids = [name for robot in robots for name in robot.subpopulation.ids]
        genotypes = batch.genotypes[rows].reshape(len(ids), -1)
        fitness = batch.matings[rows].reshape(-1).astype(np.float64)
        parents, genes = self._competition.compete(genotypes, fitness, generator(self._stream))
        tables = np.concatenate([weights_by_tile(batch, row, 0.0) for row in rows])
        visited = np.concatenate([batch.weight_rows[row] >= 0 for row in rows])
        births = []
        for robot, own in zip(robots, np.split(np.arange(len(ids)), len(robots)), strict=True):
            agents = [NewAgent(genes[k], ids[parents[k]], None) for k in own]
            births.append(robot.turn_over(agents))
            inherit_weights(batch, robot.row, tables[parents[own]], visited[parents[own]])
        return births

    def save(self) -> dict[str, Any]:
        """Return a copy of its random stream and of what it remembers."""
        return {"stream": self._stream.copy(), "memory": self._competition.memory.copy()}

    def restore(self, saved: Any) -> None:
        """Restore what was saved; raises KeyError, TypeError or ValueError if it does not fit."""
        self._competition.memory[...] = saved["memory"]
        self._stream[...] = saved["stream"]
