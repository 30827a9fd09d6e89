"""A subpopulation conceives, has a fair pool of offspring, turns over, and gives unique ids."""

import numpy as np
import pytest

from crcolony.evolution.genotype import Gene, Schema, genotype_digest
from crcolony.evolution.lineage import agent_id
from crcolony.evolution.population import Subpopulation
from crcolony.evolution.variation import Variation

AGENTS, GENES = 5, 8
SCHEMA = Schema(tuple(Gene(f"g{k}", -100.0, 100.0) for k in range(GENES)))


def new_subpopulation(mutation: float = 0.0, pool_limit: int = 1000) -> Subpopulation:
    """Return a subpopulation in its first generation."""
    genotypes = np.zeros((AGENTS, GENES))
    subpopulation = Subpopulation(
        "r", SCHEMA, Variation("two_point", mutation), genotypes, pool_limit
    )
    rng = np.random.default_rng(0)
    subpopulation.replace_agents(subpopulation.draw_first_generation(rng), 0, 0)
    return subpopulation


def test_the_first_generation_has_no_parents_and_lies_within_the_schema() -> None:
    """Its genes are written to the array that was given."""
    genotypes = np.zeros((3, AGENTS, GENES))
    one = Subpopulation("r", SCHEMA, Variation("uniform", 0.1), genotypes[1], 10)
    births = one.replace_agents(one.draw_first_generation(np.random.default_rng(1)), 0, 0)
    assert [birth.agent for birth in births] == [agent_id("r", k) for k in range(AGENTS)]
    for birth, genes in zip(births, genotypes[1], strict=True):
        SCHEMA.validate(genes)
        assert (birth.mother, birth.father, birth.generation) == (None, None, 0)
        assert birth.genotype == genotype_digest(SCHEMA, genes)
    assert not genotypes[[0, 2]].any()
    assert len({birth.genotype for birth in births}) == AGENTS


def test_an_offspring_is_in_the_pool_with_its_parents() -> None:
    """Every gene is that of the own agent or that of the partner."""
    own = new_subpopulation()
    partner = np.full(GENES, 50.0)
    offspring = own.conceive(2, partner, "s/7", 123, np.random.default_rng(2))
    assert own.pool == [offspring]
    assert (offspring.mother, offspring.father, offspring.step) == ("r/2", "s/7", 123)
    inherited = offspring.genes == own.genotypes[2]
    assert np.array_equal(~inherited, offspring.genes == 50.0)
    assert 0 < (~inherited).sum() <= GENES


def test_the_next_generation_is_drawn_from_the_pool_with_replacement() -> None:
    """With few or many offspring there are as many new agents as before, and then the pool is
    empty."""
    rng = np.random.default_rng(3)
    for offspring in (1, 3, 40):
        own = new_subpopulation()
        pool = [
            own.conceive(0, np.full(GENES, float(k)), f"s/{k}", 5, rng) for k in range(offspring)
        ]
        agents = own.draw_next_generation(rng)
        assert len(agents) == AGENTS
        assert {agent.father for agent in agents} <= {one.father for one in pool}
        births = own.replace_agents(agents, 1, 900)
        assert own.pool == []
        assert own.conceived == 0
        assert not own.turns.any()
        for birth, genes in zip(births, own.genotypes, strict=True):
            assert (birth.mother, birth.generation, birth.step) == ("r/0", 1, 900)
            assert any(np.array_equal(genes, one.genes) for one in pool)


def test_each_offspring_is_drawn_with_the_same_probability() -> None:
    """Draws from the pool are uniform (chi square of 3 degrees, 99.99 %)."""
    rng = np.random.default_rng(4)
    own = new_subpopulation()
    for k in range(4):
        own.conceive(0, np.zeros(GENES), f"s/{k}", 0, rng)
    fathers = [agent.father for _ in range(800) for agent in own.draw_next_generation(rng)]
    counts = np.array([fathers.count(f"s/{k}") for k in range(4)])
    assert ((counts - 1000) ** 2 / 1000).sum() < 21.1


def test_without_offspring_every_agent_is_replaced_by_a_mutated_copy() -> None:
    """That is the rule for an empty pool: one child of each agent, without a father."""
    own = new_subpopulation(mutation=0.5)
    before = own.genotypes.copy()
    births = own.replace_agents(own.draw_next_generation(np.random.default_rng(5)), 1, 10)
    assert [birth.mother for birth in births] == [f"r/{k}" for k in range(AGENTS)]
    assert all(birth.father is None for birth in births)
    changed = own.genotypes != before
    assert 0.2 < changed.mean() < 0.8


def test_ids_are_unique() -> None:
    """Over generations and after a restore no two agents have the same id."""
    own = new_subpopulation()
    rng = np.random.default_rng(6)
    ids = set(own.ids)
    for generation in range(1, 4):
        saved = own.save()
        own = new_subpopulation()
        own.restore(saved)
        births = own.replace_agents(own.draw_next_generation(rng), generation, 0)
        assert not ids & {birth.agent for birth in births}
        ids |= {birth.agent for birth in births}
    assert len(ids) == 4 * AGENTS


def test_a_full_pool_keeps_each_offspring_with_the_same_probability() -> None:
    """Of 12 conceptions each one is in a pool of 3 in a quarter of the cases (a reservoir)."""
    kept = np.zeros(12)
    rng = np.random.default_rng(7)
    own = new_subpopulation(pool_limit=3)
    for _ in range(2000):
        own.pool, own.conceived = [], 0
        for k in range(12):
            own.conceive(0, np.zeros(GENES), str(k), 0, rng)
        assert len(own.pool) == 3
        assert own.conceived == 12
        kept[[int(one.father) for one in own.pool]] += 1
    assert ((kept - 500) ** 2 / (500 * 0.75)).sum() < 37.4  # 11 degrees, 99.99 %


def test_a_restored_subpopulation_has_the_same_future() -> None:
    """Pool, ids, turns and genotypes are restored; what was saved does not change afterwards."""
    own = new_subpopulation()
    rng = np.random.default_rng(8)
    own.conceive(1, np.ones(GENES), "s/1", 3, rng)
    own.turns[2] = 2
    saved = own.save()
    kept = own.genotypes.copy()
    other = new_subpopulation()
    other.replace_agents(other.draw_next_generation(rng), 1, 1)
    own.replace_agents(own.draw_next_generation(np.random.default_rng(9)), 1, 4)
    other.restore(saved)
    assert np.array_equal(other.genotypes, kept)
    assert other.turns.tolist() == [0, 0, 2, 0, 0]
    assert (other.conceived, other.born, other.ids[0]) == (1, AGENTS, "r/0")
    other.replace_agents(other.draw_next_generation(np.random.default_rng(9)), 1, 4)
    assert np.array_equal(other.genotypes, own.genotypes)
    assert other.ids == own.ids


def test_a_saved_subpopulation_of_other_size_is_refused() -> None:
    """It has other agents or genes."""
    saved = new_subpopulation().save()
    smaller = Subpopulation(
        "r", SCHEMA, Variation("uniform", 0.1), np.zeros((AGENTS - 1, GENES)), 10
    )
    with pytest.raises(ValueError, match="other agents"):
        smaller.restore(saved)
