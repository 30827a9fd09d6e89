"""One robot alone in crcolony's own arena, whose virtual agents learn to capture battery packs, one life after another.

The colony's own control step and world, with the foraging module in control always: the genes of the selector are 0. No
energy is spent, so that all lives are of the same length. Temperatures decay so slowly that a gene of a low one matters
for all of a life. Numbers are ours.
"""

import msgspec
import numpy as np

from crcolony.compiled import FloatArray, IntArray
from crcolony.config import Config, load
from crcolony.evolution.genotype import Schema
from crcolony.experiments.colonies.newborn_colony import newborn_colony
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.genes import agent_schema

LIFE_STEPS = 1_500
WINDOW_STEPS = 150
"""Control steps of a life (0.2 s each), and of a point of its learning curve."""
WINDOWS = LIFE_STEPS // WINDOW_STEPS

BODIES: dict[str, tuple[str, ...]] = {
    "own": (),
    "worn": (
        "body.noise.distance_m=0.03",
        "body.noise.bearing_rad=0.05",
        "learning.speeds_m_s=[0.0, 0.1425, 0.285]",
        "learning.turns_rad_s=[-0.95, 0.0, 0.95]",
    ),
    "delayed": ("body.action_latency_steps=1",),
}
"""The body in which learners evolve, with exact senses and no delay; one with noisy eyes and wheels that slip by a
twentieth; and one that acts a whole control period late, as none of their lives was."""

_FORAGING = (
    "robots=1",
    "arena.area_per_robot_m2=4.0",
    "arena.packs_per_robot=4.0",
    "life.slices=1",
    f"life.slice_steps={LIFE_STEPS}",
    "life.energy_per_step=0.0",
    "heredity.highest_tau_decay=0.01",
    "heredity.tau_decay_mutation_sd=0.0015",
    "heredity.selector_sd=0.0",
    "heredity.selector_mutation_sd=0.0",
)


def foraging_config(agents: int, shaping: bool, body: str = "own") -> Config:
    """Return the settings of a robot with so many agents, in one of BODIES."""
    own = (f"life.agents={agents}", f"learning.shaping={str(shaping).lower()}")
    return load(None, [*_FORAGING, *own, *BODIES[body]])


def foraging_schema(config: Config) -> Schema:
    """Return the genes of its agents; those of the mating module are never used."""
    return agent_schema(config.learning, config.heredity)


def forage(
    config: Config, genotypes: FloatArray, seed: int, wheels: tuple[float, float] = (1.0, 1.0)
) -> IntArray:
    """Let agents with these genotypes (agents, genes) live, in random order; return their packs (agents, WINDOWS).

    These are counted in each part of a life; the very last step of all lives is left out. Each wheel turns by a factor
    faster than the robot means it to. Raises ValueError for another number of agents than the config has.
    """
    return count_packs(new_foragers(config, genotypes, seed, wheels))


def new_foragers(
    config: Config, genotypes: FloatArray, seed: int, wheels: tuple[float, float] = (1.0, 1.0)
) -> InProcessColony:
    """Return a robot with newborn agents of these genotypes, as `forage` lets them live."""
    if genotypes.shape[0] != config.life.agents:
        raise ValueError(f"{genotypes.shape[0]} genotypes for {config.life.agents} agents")
    colony = newborn_colony(msgspec.structs.replace(config, seed=seed), genotypes[None])
    turning = colony.parameters.wheel_speeds * np.array(wheels)
    colony.parameters = colony.parameters._replace(wheel_speeds=turning)
    colony.start()
    return colony


def count_packs(colony: InProcessColony) -> IntArray:
    """Let each agent of a robot live in the last slice that it has; return their packs (agents, WINDOWS)."""
    captures, lives = colony.batch.captures[0], colony.config.life.agents
    packs = np.zeros((lives, WINDOWS), dtype=np.int64)
    for life in range(lives):
        agent = int(colony.batch.agent[0])
        for window in range(WINDOWS):
            before = int(captures[agent])
            is_last = (life, window) == (lives - 1, WINDOWS - 1)
            colony.run(WINDOW_STEPS - is_last)
            packs[agent, window] = int(captures[agent]) - before
    return packs
