"""A robot alone forages in the arena of a colony, agent after agent."""

import numpy as np
import pytest

from crcolony.experiments.colonies.foraging_lives import (
    WINDOWS,
    forage,
    foraging_config,
    foraging_schema,
)


def test_lives_are_the_same_for_the_same_seed_alone() -> None:
    """Packs of each part of each life; another seed or another body gives others."""
    config = foraging_config(4, True)
    schema, rng = foraging_schema(config), np.random.default_rng(1)
    genotypes = np.stack([schema.random(rng) for _ in range(4)])
    packs = forage(config, genotypes, 1)
    assert packs.shape == (4, WINDOWS)
    assert packs.sum() > 0
    assert packs.tolist() == forage(config, genotypes, 1).tolist()
    assert packs.tolist() != forage(config, genotypes, 2).tolist()
    for body in ("worn", "delayed"):
        other = foraging_config(4, True, body)
        assert packs.tolist() != forage(other, genotypes, 1).tolist()


def test_only_foraging_is_ever_in_control() -> None:
    """The selector has no weights, and gets none by mutation; without shaping a potential has none either."""
    schema = foraging_schema(foraging_config(2, False))
    genes = schema.random(np.random.default_rng(1))
    for index, gene in enumerate(schema.genes):
        if gene.name.startswith("selector.") or ".potential." in gene.name:
            assert genes[index] == gene.mutation_sd == 0.0


def test_each_agent_needs_a_genotype() -> None:
    """No more and no fewer."""
    config = foraging_config(2, True)
    with pytest.raises(ValueError, match="1 genotypes for 2 agents"):
        forage(config, np.zeros((1, len(foraging_schema(config)))), 1)
