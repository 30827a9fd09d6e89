"""A learning module is one row of a table: genes, selector and learning follow from it."""

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.robot.batch import empty_robots, step_parameters, weight_bytes
from crcolony.robot.genes import agent_schema, module_genes
from crcolony.robot.modules import FORAGING, MATING, MODULES, LearningModule
from crcolony.robot.settings import Heredity, Learning, Life
from crcolony.robot.state import Robots
from crcolony.robot.step import step_robot
from crcolony.robot.weight_rows import weights_by_tile
from tests.support.small_robots import random_observation


def test_the_modules_are_those_of_paper_iii() -> None:
    """Foraging watches packs and succeeds by a charge, mating watches faces and succeeds by an
    encounter."""
    assert MODULES == (FORAGING, MATING)
    assert (FORAGING.target, FORAGING.success) == (contract.PACK, contract.CHARGE)
    assert (MATING.target, MATING.success) == (contract.FACE, contract.ENCOUNTER)
    assert [module.beacon for module in MODULES] == [False, True]


def test_a_third_module_is_one_more_row() -> None:
    """A module that follows tail lamps has its own genes and weights, is selected, and learns."""
    following = LearningModule(
        "following", contract.TAIL, contract.ENCOUNTER, False, False, (0.0, 0.0, 1.0)
    )
    modules = (FORAGING, MATING, following)
    learning, life = Learning(), Life(agents=2, slice_steps=500)
    schema = agent_schema(learning, Heredity(), modules)
    assert len(schema) == 2 * 5 + 3 * module_genes(learning)
    parameters = step_parameters(learning, life, CyberRodent(), modules)
    robots: Robots = empty_robots(1, parameters, 2, len(schema), 1)
    robots.genotypes[0] = schema.random(np.random.default_rng(2))
    robots.genotypes[0, :, schema.index("selector.following.bias")] = 5.0
    robots.energies[:] = 1.0
    robots.slice_steps_left[:] = 500
    rng = np.random.default_rng(3)
    action = np.zeros(contract.ACTION_WIDTH)
    for _ in range(60):
        step_robot(robots, parameters, 0, random_observation(rng), action)
    assert robots.module[0] == 2
    assert action[contract.LED : contract.LED + 3].tolist() == [0.0, 0.0, 1.0]
    weights = weights_by_tile(robots, 0, 0.0)
    assert np.abs(weights[0, 2]).max() > 0.0
    assert not weights[0, :2].any()
    assert robots.weights.nbytes == weight_bytes(1, learning, life, modules)
