"""Robots live on behaviours that are learnt, recharge as their genes say, and remember their best partner."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray
from crcolony.experiments.colonies.learnt_behaviours import Behaviours, learn_behaviours
from crcolony.experiments.colonies.survival_lives import (
    NOBODY,
    OTHER,
    OWN,
    PartnerMemory,
    estimated_fitness,
    live,
    recharge_steps,
    survival_config,
    survival_schema,
)
from crcolony.robot.settings import Life

SMALL = ("life.agents=3", "life.slices=2", "life.slice_steps=150")
CONFIG = survival_config(OWN, SMALL)


@pytest.fixture(scope="module")
def learnt() -> Behaviours:
    """Behaviours that a little experience has made."""
    return learn_behaviours(3, 3_000)


def genotypes(**genes: float) -> FloatArray:
    """Return a population of one genotype, of which these genes are not 0."""
    schema = survival_schema()
    found = np.zeros((CONFIG.robots, CONFIG.life.agents, len(schema)))
    for name, value in genes.items():
        found[..., schema.index(name.replace("__", "."))] = value
    return found


def test_lives_are_the_same_for_the_same_seed_and_world_alone(learnt: Behaviours) -> None:
    """Whatever they come to."""
    population = genotypes(recharge__bias=0.2)
    found = [
        live(survival_config(world, SMALL), learnt, population, seed).captures.tolist()
        for world, seed in ((OWN, 1), (OWN, 1), (OWN, 2), (OTHER, 1))
    ]
    assert found[0] == found[1]
    assert found[0] != found[2]
    assert found[0] != found[3]


def test_robots_recharge_as_long_as_their_genes_say(learnt: Behaviours) -> None:
    """At most: a slice may end before. One that hardly recharges starves where the other lives on."""
    short = live(CONFIG, learnt, genotypes(recharge__bias=-1.0), 1)
    longer = live(CONFIG, learnt, genotypes(recharge__bias=0.2), 1)
    assert short.captures.sum() > 0
    assert short.recharge_steps.tolist() == short.captures.tolist()
    mean = longer.recharge_steps.sum() / longer.captures.sum()
    assert 8.0 < mean <= 10.0
    assert longer.has_starved.sum() < short.has_starved.sum()


def test_only_those_that_mate_have_partners_and_these_are_in_other_robots(
    learnt: Behaviours,
) -> None:
    """With a drive to mate nobody forages, and without one nobody mates."""
    foraging = live(CONFIG, learnt, genotypes(mating__bias=-1.0), 1)
    assert foraging.matings.sum() == 0
    assert (foraging.partners == NOBODY).all()
    mating = live(CONFIG, learnt, genotypes(mating__bias=1.0), 1)
    assert mating.captures.sum() == 0
    assert mating.matings.sum() > 0
    assert ((mating.partners != NOBODY) == (mating.matings > 0)).all()
    for robot, partners in enumerate(mating.partners):
        robots = partners[partners != NOBODY] // CONFIG.life.agents
        assert robot not in robots


def test_the_fittest_partner_is_remembered() -> None:
    """A worse one does not take its place, nor does one that is as good."""
    memory = PartnerMemory(3, 2)
    assert (memory.partners == NOBODY).all()
    memory.meet((0, 1), (1, 0), 3.0, 0.0)
    assert memory.partners.tolist() == [[NOBODY, 2], [1, NOBODY], [NOBODY, NOBODY]]
    memory.meet((0, 1), (2, 1), 5.0, 2.0)
    memory.meet((1, 0), (2, 1), 0.0, 2.0)
    assert memory.partners.tolist() == [[NOBODY, 5], [1, NOBODY], [NOBODY, 1]]
    memory.meet((0, 1), (1, 1), 5.0, 2.0)
    assert memory.partners[0, 1] == 5


def test_fitness_is_estimated_for_a_whole_lifetime() -> None:
    """From the packs so far; less than a slice counts as one."""
    life = Life(slices=3, slice_steps=100)
    assert estimated_fitness(4, 200, life) == 6.0
    assert estimated_fitness(4, 300, life) == 4.0
    assert estimated_fitness(1, 2, life) == estimated_fitness(1, 100, life) == 3.0


def test_recharge_time_is_linear_between_a_step_and_a_full_recharge() -> None:
    """50 steps fill a battery."""
    genes, visible = np.array([0.5, -0.5, 0.1, -0.1]), np.array([1.0, 0.0])
    assert recharge_steps(genes, 1.0, visible) == 5
    assert recharge_steps(genes, 0.2, visible) == 25
    assert recharge_steps(10.0 * genes, 0.2, visible) == 50
    assert recharge_steps(-genes, 0.2, visible) == 1
