"""A robot: a body's mind, shared in time by a subpopulation of virtual agents (Papers II and III, thesis 4.5, 5.3).

`Robot.step` is the control period. What is rare is here in plain Python: the hand-over to the next agent, a mating,
and the turnover of a generation. No I/O and no clock: a robot counts control steps and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony.evolution.lineage import AgentId, Birth
from crcolony.evolution.population import Newborn, Offspring, Subpopulation
from crcolony.evolution.time_sharing import TimeSharing
from crcolony.randomness import chance, generator
from crcolony.robot.aot_step import Step, load_step
from crcolony.robot.energy import conception_probability
from crcolony.robot.settings import Life
from crcolony.robot.state import SCRATCH, Robots, StepParameters


@dataclass(frozen=True)
class Exchange:
    """What one robot hands to the other in a mating: who it is and its genotype, never how well it does."""

    agent: AgentId
    genes: FloatArray


class Robot:
    """One row of a batch of robots: the only one in a robot's own process, one of many in an embedded colony."""

    def __init__(
        self,
        robots: Robots,
        row: int,
        parameters: StepParameters,
        life: Life,
        subpopulation: Subpopulation,
        time_sharing: TimeSharing,
    ) -> None:
        self.row = row
        self.generation = 0
        self.subpopulation = subpopulation
        self._robots = robots
        self._parameters = parameters
        self._life = life
        self._time_sharing = time_sharing
        self._step: Step | None = None
        self._action = np.zeros(contract.ACTION_WIDTH)

    @property
    def agent(self) -> int:
        """The place, in the subpopulation, of the agent in control."""
        return int(self._robots.agent[self.row])

    @property
    def steps(self) -> int:
        """How many control steps the robot has lived."""
        return int(self._robots.steps[self.row])

    @property
    def energy(self) -> float:
        """The energy of the agent in control."""
        return float(self._robots.energies[self.row, self.agent])

    @property
    def events(self) -> int:
        """What happened in the last step, as the event bits of `state.py`."""
        return int(self._robots.events[self.row])

    def set_parameters(self, parameters: StepParameters) -> None:
        """Live with another body from now on: the same modules and actions, other senses."""
        self._parameters, self._step = parameters, None

    def start(self) -> list[Birth]:
        """Give the robot its first generation and its first agent; return the births."""
        children = self.subpopulation.first_children(generator(self.stream))
        births = self.subpopulation.bear(children, 0, self.steps)
        self._raise_newborns()
        self.hand_over()
        return births

    def step(self, observation: FloatArray) -> FloatArray:
        """Live one control period: from an observation (OBSERVATION_WIDTH,) to an action (ACTION_WIDTH,).

        The returned array is overwritten by the next step. Afterwards `events` tells what else is to be done:
        `exchange` and `mate` after an encounter, then `hand_over` when the slice is over.
        """
        if self._step is None:
            self._step = load_step(self._robots, self._parameters)
        self._step(self.row, observation, self._action)
        return self._action

    def exchange(self) -> Exchange:
        """Return what this robot offers its partner in a mating."""
        agent = self.agent
        return Exchange(self.subpopulation.ids[agent], self.subpopulation.genotypes[agent])

    def mate(self, partner: Exchange, agent: int | None = None) -> Offspring | None:
        """Decide, by its energy, whether the partner's genotype leads to an offspring of an agent; return it if so.

        The agent is the one in control, unless the place of another is given: the one that met the partner.
        """
        agent = self.agent if agent is None else agent
        energy = float(self._robots.energies[self.row, agent])
        probability = conception_probability(
            energy, self._life.conception_threshold, self._life.conception_exponent
        )
        if chance(self.stream) >= probability:
            return None
        return self.subpopulation.conceive(
            agent, partner.genes, partner.agent, self.steps, generator(self.stream)
        )

    def hand_over(self) -> bool:
        """Let the next agent take control; return False if every agent has had its slices: time to turn over."""
        robots, row = self._robots, self.row
        following = self._time_sharing.next_agent(
            self.subpopulation.turns, self._worth(), generator(self.stream)
        )
        if following is None:
            return False
        self.subpopulation.turns[following] += 1
        robots.agent[row] = following
        robots.slice_steps_left[row] = self._life.slice_steps
        robots.module[row] = -1
        return True

    def turn_over(self, children: Sequence[Newborn] | None = None) -> list[Birth]:
        """Start the next generation with offspring from the own pool, or with given children; return the births."""
        self.generation += 1
        if children is None:
            children = self.subpopulation.draw_children(generator(self.stream))
        births = self.subpopulation.bear(children, self.generation, self.steps)
        self._raise_newborns()
        self.hand_over()
        return births

    def _raise_newborns(self) -> None:
        """Every newborn starts with the initial energy and with nothing learnt."""
        robots, row = self._robots, self.row
        robots.energies[row] = self._life.initial_energy
        for field in (
            robots.used,
            robots.captures,
            robots.matings,
            robots.steps_alive,
            robots.energy_sum,
        ):
            field[row] = 0
        robots.weights[row] = self._parameters.initial_weight

    def _worth(self) -> FloatArray:
        """How well every agent has done for itself: matings per step lived (for informed time sharing only)."""
        robots, row = self._robots, self.row
        worth: FloatArray = robots.matings[row] / np.maximum(robots.steps_alive[row], 1)
        return worth

    @property
    def stream(self) -> Any:
        """The robot's randomness, shape (2,): what draws from it changes it."""
        return self._robots.streams[self.row]

    def save(self) -> dict[str, Any]:
        """Return all there is of the robot, as copies: arrays by field, its subpopulation, and its counters."""
        fields = [name for name in Robots._fields if name not in SCRATCH]
        return {
            "arrays": {name: np.array(getattr(self._robots, name)[self.row]) for name in fields},
            "subpopulation": self.subpopulation.save(),
            "generation": self.generation,
        }

    def restore(self, saved: dict[str, Any]) -> None:
        """Become a saved robot of the same settings; raises ValueError if a field does not fit."""
        for name, value in saved["arrays"].items():
            field = getattr(self._robots, name)
            if np.shape(value) != field.shape[1:]:
                raise ValueError(f"the saved robot does not fit these settings: {name}")
            field[self.row] = value
        self.subpopulation.restore(saved["subpopulation"])
        self.generation = saved["generation"]
