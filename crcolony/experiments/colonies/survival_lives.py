"""A generation of the robots of Paper II (thesis 5.2): behaviours are learnt before, a linear network does the rest.

It selects the behaviour in control, as everywhere in the colony, and computes how long a robot that has captured a
battery pack stands still to recharge from it. Robots that meet tell each other their genotypes and their estimated
fitness, which is the number of packs that they capture in a lifetime. Numbers are ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.compiled import BoolArray, FloatArray, IntArray
from crcolony.config import Config, load
from crcolony.evolution.genotype import Gene, Normal, Schema
from crcolony.evolution.history import Event, Mated
from crcolony.experiments.colonies.learnt_behaviours import (
    Behaviours,
    frozen_genotypes,
    start_colony,
)
from crcolony.robot.genes import selector_inputs
from crcolony.robot.settings import Life
from crcolony.world.packs import place_pack

NOBODY = -1
"""In place of the best partner of an agent that has met none"""
OWN, OTHER = "own", "other"
WORLDS: dict[str, tuple[str, ...]] = {
    OWN: (),
    OTHER: (
        "body.noise.distance_m=0.03",
        "body.noise.bearing_rad=0.05",
        "body.action_latency_steps=1",
        "learning.speeds_m_s=[0.0, 0.1425, 0.285]",
        "learning.turns_rad_s=[-0.95, 0.0, 0.95]",
    ),
}
"""The world in which agents evolve first, and one in which eyes are noisy, wheels slip by a twentieth, and a body acts
a control period late: what a transfer to hardware changes."""
_FULL_STEPS = 50
"""Control steps (0.2 s each) that a full recharge takes"""
_SURVIVAL = (
    "arena.pack_charge=1.0",
    f"arena.pack_charge_per_step={1.0 / _FULL_STEPS}",
    "life.agents=10",
    "life.slices=3",
    "life.slice_steps=150",
    "life.energy_per_step=0.004",
)
_INPUTS = selector_inputs()
_HIGHEST, _SD, _MUTATION_SD = 3.0, 0.5, 0.3
"""Of all genes: those of the colony's selector"""


@dataclass(frozen=True, eq=False)
class Lives:
    """What came of a generation: arrays of (robots, agents)."""

    captures: IntArray
    """Packs captured, which is an agent's fitness"""
    matings: IntArray
    partners: IntArray
    """The partner that was estimated to be the fittest, counted over all robots (robot * agents + agent); or NOBODY"""
    recharge_steps: IntArray
    """Control steps of recharging"""
    has_starved: BoolArray


def survival_config(world: str, settings: Sequence[str] = ()) -> Config:
    """Return the settings of one of WORLDS, with `key=value` settings that take precedence."""
    return load(None, [*_SURVIVAL, *WORLDS[world], *settings])


def survival_schema() -> Schema:
    """Return the genes of a linear network with two outputs: the drive to mate, and the recharge time."""
    return Schema(
        tuple(
            Gene(
                f"{output}.{source}",
                low=-_HIGHEST,
                high=_HIGHEST,
                initial=Normal(0.0, _SD),
                mutation_sd=_MUTATION_SD,
            )
            for output in ("mating", "recharge")
            for source in _INPUTS
        )
    )


def live(config: Config, behaviours: Behaviours, genotypes: FloatArray, seed: int) -> Lives:
    """Let agents with these genotypes (robots, agents, genes) live once in an arena of this seed.

    The very last control step, in which the colony would turn over, is left out.
    """
    lives = _SurvivalLives(msgspec.structs.replace(config, seed=seed), behaviours, genotypes)
    for _ in range(config.life.agents * config.life.slices * config.life.slice_steps - 1):
        lives.step()
    return lives.result()


class _SurvivalLives:
    """The colony's own robots and arena; after every control step robots that hold a pack are made to recharge."""

    def __init__(self, config: Config, behaviours: Behaviours, genotypes: FloatArray) -> None:
        inputs = len(_INPUTS)
        self._colony = start_colony(
            config, frozen_genotypes(config, genotypes[..., :inputs]), behaviours, self._handle
        )
        self._recharge_genes = genotypes[..., inputs:]
        self._ttl_s = config.learning.action_ttl_s
        shape = config.robots, config.life.agents
        self._captures = np.zeros(shape, dtype=np.int64)
        self._recharged = np.zeros(shape, dtype=np.int64)
        self._memory = PartnerMemory(*shape)
        self._steps_left = np.zeros(config.robots, dtype=np.int64)
        self._agents = self._colony.batch.agent.copy()

    def step(self) -> None:
        """Do a control step."""
        colony = self._colony
        colony.run(1)
        holding = colony.arena.world.holding
        self._steps_left[holding < 0] = 0
        for robot in np.flatnonzero(holding >= 0):
            self._recharge(int(robot))
        self._agents[:] = colony.batch.agent

    def result(self) -> Lives:
        """Return what has come of it so far."""
        batch = self._colony.batch
        return Lives(
            self._captures,
            batch.matings.copy(),
            self._memory.partners,
            self._recharged,
            batch.energies <= 0.0,
        )

    def _recharge(self, robot: int) -> None:
        """Let a robot with a pack stand still until its recharge time is over, or its slice: then it drops the pack."""
        batch, agent = self._colony.batch, int(self._colony.batch.agent[robot])
        if agent != self._agents[robot]:
            self._drop(robot)
            return
        if self._steps_left[robot] == 0:
            self._captures[robot, agent] += 1
            self._steps_left[robot] = recharge_steps(
                self._recharge_genes[robot, agent],
                float(batch.energies[robot, agent]),
                batch.visible[robot],
            )
        self._steps_left[robot] -= 1
        self._recharged[robot, agent] += 1
        if self._steps_left[robot] == 0:
            self._drop(robot)
            return
        action = self._colony.actions[robot]
        action[:] = 0.0
        action[contract.JAW], action[contract.TTL] = 1.0, self._ttl_s

    def _drop(self, robot: int) -> None:
        """Take a robot's pack away; there is a full one elsewhere at once, or it would capture this one again."""
        world = self._colony.arena.world
        pack = int(world.holding[robot])
        world.holding[robot] = -1
        place_pack(world, pack)
        self._colony.arena.update_cells()
        self._steps_left[robot] = 0

    def _handle(self, event: Event) -> None:
        """Let two agents that have mated tell each other how fit they are."""
        if not isinstance(event, Mated):
            return
        robots = event.robot, event.partner_robot
        one, other = ((robot, int(self._colony.batch.agent[robot])) for robot in robots)
        self._memory.meet(one, other, self._estimate(*one), self._estimate(*other))

    def _estimate(self, robot: int, agent: int) -> float:
        lived = int(self._colony.batch.steps_alive[robot, agent])
        return estimated_fitness(int(self._captures[robot, agent]), lived, self._colony.config.life)


class PartnerMemory:
    """Whom each agent remembers: of the partners it has met, the one that was the fittest by what it told."""

    def __init__(self, robots: int, agents: int) -> None:
        self.partners = np.full((robots, agents), NOBODY, dtype=np.int64)
        """The `partners` of `Lives`"""
        self._fitness = np.full((robots, agents), -np.inf)

    def meet(
        self, one: tuple[int, int], other: tuple[int, int], fitness: float, other_fitness: float
    ) -> None:
        """Let two agents (robot, agent) meet, which tell each other their fitness; among equals the first one stays."""
        self._remember(one, other, other_fitness)
        self._remember(other, one, fitness)

    def _remember(self, own: tuple[int, int], partner: tuple[int, int], fitness: float) -> None:
        if fitness > self._fitness[own]:
            self._fitness[own] = fitness
            self.partners[own] = partner[0] * self.partners.shape[1] + partner[1]


def estimated_fitness(captures: int, lived_steps: int, life: Life) -> float:
    """Return the packs that an agent would capture in a lifetime, by those so far.

    What happened in less than a slice counts as if it had taken a whole one: early luck says little.
    """
    return captures * life.slices * life.slice_steps / max(lived_steps, life.slice_steps)


def recharge_steps(genes: FloatArray, energy: float, visible: FloatArray) -> int:
    """Return how long a robot recharges (control steps): a step at least, at most until its battery could be full.

    The output of 0 to 1 is a share of that time; `genes` are weights of the bias, the energy and each visible target.
    """
    output = float(genes[0] + genes[1] * energy + genes[2:] @ visible)
    return max(1, round(min(max(output, 0.0), 1.0) * _FULL_STEPS))
