"""Robots without a world, for tests: their observations are made up."""

import msgspec
import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.time_sharing import RandomOrder
from crcolony.evolution.variation import Variation
from crcolony.robot.batch import empty_robots, step_parameters
from crcolony.robot.factory import make_implicit_selection
from crcolony.robot.genes import agent_schema
from crcolony.robot.robot import Robot
from crcolony.robot.settings import Heredity, Learning, Life
from crcolony.robot.state import Robots, StepParameters


class Settings(msgspec.Struct, frozen=True):
    """All that decides a robot, as far as tests change it."""

    learning: Learning = Learning(tilings=3, distance_tiles=4, bearing_tiles=5)
    life: Life = Life(agents=3, slices=2, slice_steps=60, refractory_steps=4)
    heredity: Heredity = Heredity()
    rodent: CyberRodent = CyberRodent()


DEFAULT = Settings()


def new_robots(
    count: int, settings: Settings = DEFAULT, seed: int = 1
) -> tuple[Robots, StepParameters, list[Robot]]:
    """Return a batch of robots that have not started."""
    schema = agent_schema(settings.learning, settings.heredity)
    parameters = step_parameters(settings.learning, settings.life, settings.rodent)
    batch = empty_robots(count, parameters, settings.life.agents, len(schema), seed)
    robots = [
        Robot(
            batch,
            row,
            parameters,
            settings.life,
            Subpopulation(str(row), schema, Variation("two_point", 0.1), batch.genotypes[row], 50),
            RandomOrder(settings.life.slices),
            make_implicit_selection(settings.life),
        )
        for row in range(count)
    ]
    return batch, parameters, robots


def random_observation(rng: np.random.Generator) -> FloatArray:
    """Return a random observation with packs and faces, and now and then a charge or an
    encounter."""
    row = np.zeros(contract.OBSERVATION_WIDTH)
    for blob in (contract.PACK, contract.FACE, contract.TAIL):
        if rng.random() < 0.6:
            row[blob] = 1.0
            row[blob + contract.DISTANCE] = rng.uniform(0.0, 1.6)
            row[blob + contract.BEARING] = rng.uniform(-1.4, 1.4)
            lamp = rng.integers(4)
            if lamp < 3:  # otherwise it is off
                row[blob + contract.COLOUR + lamp] = 1.0
    row[contract.ENCOUNTER_ROBOT] = -1.0
    if rng.random() < 0.08:
        row[contract.CHARGE] = 0.2
    if rng.random() < 0.05:
        row[contract.ENCOUNTER] = 1.0
        row[contract.ENCOUNTER_ROBOT] = 3.0
    return row


def empty_observation() -> FloatArray:
    """Return what a robot observes where nothing is."""
    row = np.zeros(contract.OBSERVATION_WIDTH)
    row[contract.ENCOUNTER_ROBOT] = -1.0
    return row
