"""Genes decode to what the compiled step reads, and a learning module is one row of a table."""

import msgspec
import numpy as np
import pytest

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.robot.batch import empty_robots, step_parameters, weight_bytes
from crcolony.robot.energy import conception_probability, next_energy
from crcolony.robot.genes import META_PARAMETERS, agent_schema, decode, module_genes
from crcolony.robot.modules import FORAGING, MATING, LearningModule
from crcolony.robot.settings import Heredity, Learning, Life
from crcolony.robot.state import Robots
from crcolony.robot.step import step_robot
from tests.support.small_robots import observation


def test_a_genotype_decodes_to_selector_meta_parameters_and_potentials() -> None:
    """Every gene is found again, by its name, at its place."""
    learning = Learning()
    schema = agent_schema(learning, Heredity())
    genes = np.arange(float(len(schema)))
    agent = decode(genes, learning)
    assert len(schema) == 4 + 2 * module_genes(learning) == 46
    assert agent.selector.tolist() == [[0.0, 1.0, 2.0, 3.0]]
    for module, name in enumerate(("foraging", "mating")):
        meta = agent.meta_parameters[module]
        for value, field in zip(META_PARAMETERS, meta.__dataclass_fields__, strict=True):
            assert getattr(meta, field) == schema.index(f"{name}.{value}")
        assert agent.potentials[module].shape == (4, 4)
        assert agent.potentials[module][0, 0] == schema.index(f"{name}.potential.0")
        assert agent.potentials[module][3, 3] == schema.index(f"{name}.potential.15")


def test_meta_parameters_have_the_bounds_of_the_config() -> None:
    """A lambda of at most 0.5 stays below it in every newborn and every mutant."""
    heredity = msgspec.structs.replace(Heredity(), highest_lambda=0.5, highest_tau_decay=0.01)
    schema = agent_schema(Learning(), heredity)
    place = schema.index("mating.lambda")
    assert (schema.lows[place], schema.highs[place]) == (0.0, 0.5)
    assert schema.highs[schema.index("foraging.tau_decay")] == 0.01
    assert schema.highs[schema.index("foraging.gamma")] == 0.999
    rng = np.random.default_rng(1)
    assert max(schema.random(rng)[place] for _ in range(200)) <= 0.5


def test_a_third_module_is_one_more_row() -> None:
    """One that follows tail lamps has its own genes and weights, is selected, and learns."""
    follow = LearningModule(
        "following", contract.TAIL, contract.ENCOUNTER, False, False, (0.0, 0.0, 1.0)
    )
    modules = (FORAGING, MATING, follow)
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
        step_robot(robots, parameters, 0, observation(rng), action)
    assert robots.module[0] == 2
    assert action[contract.LED : contract.LED + 3].tolist() == [0.0, 0.0, 1.0]
    assert np.abs(robots.weights[0, 0, 2]).max() > 0.0
    assert not robots.weights[0, 0, :2].any()
    assert robots.weights.nbytes == weight_bytes(1, learning, life, modules)


def test_actions_are_all_pairs_of_a_speed_and_a_turn_as_wheel_speeds() -> None:
    """The middle of the wheels moves with the speed, and they differ by the turn."""
    learning, rodent = Learning(), CyberRodent()
    wheels = step_parameters(learning, Life(), rodent).wheels
    pairs = [(v, w) for v in learning.speeds_m_s for w in learning.turns_rad_s]
    assert wheels.mean(axis=1) == pytest.approx([v for v, _ in pairs])
    assert (wheels[:, 1] - wheels[:, 0]) / rodent.track_m == pytest.approx([w for _, w in pairs])


def test_robots_have_streams_of_their_own() -> None:
    """No two of the same colony or of two seeds draw the same numbers, and one seed gives the same."""
    parameters = step_parameters(Learning(), Life(), CyberRodent())
    one, same, other = (empty_robots(50, parameters, 1, 1, seed).streams for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert np.unique(np.concatenate([one, other])[:, 0]).size == 100


@pytest.mark.parametrize(
    ("energy", "charge", "after"),
    [(0.5, 0.0, 0.49), (0.5, 0.2, 0.69), (0.9, 0.4, 0.99), (0.005, 0.0, 0.0), (0.0, 0.0, 0.0)],
)
def test_energy_stays_between_empty_and_full(energy: float, charge: float, after: float) -> None:
    """A charge fills up to 1, a step costs, and nobody owes energy."""
    assert next_energy(energy, charge, 0.01) == pytest.approx(after)


def test_conception_is_as_likely_as_energy_says() -> None:
    """Its power is a setting, the dead never conceive, and nobody does below the threshold."""
    assert conception_probability(0.6, 0.0, 1.0) == 0.6
    assert conception_probability(0.5, 0.0, 2.0) == 0.25
    assert conception_probability(0.0, 0.0, 0.0) == 0.0
    assert conception_probability(0.3, 0.31, 0.0) == 0.0
    assert conception_probability(0.31, 0.31, 0.0) == 1.0
