"""Foragers bring what they have learnt into another world, and learn on there or do not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray
from crcolony.experiments.colonies import experienced_foragers
from crcolony.experiments.colonies.experienced_foragers import forage_again, gain_experience
from crcolony.experiments.colonies.foraging_lives import (
    count_packs,
    forage,
    foraging_config,
    foraging_schema,
)
from crcolony.in_process.colony import InProcessColony
from crcolony.robot.weight_rows import weights_by_tile

CONFIG = foraging_config(8, False)


def learners(seed: int) -> FloatArray:
    """Return genotypes that learn slowly, without shaping, and are greedy."""
    schema, rng = foraging_schema(CONFIG), np.random.default_rng(seed)
    genotypes = np.stack([schema.random(rng) for _ in range(CONFIG.life.agents)])
    for name, value in (("alpha", 0.2), ("gamma", 0.95), ("lambda", 0.5), ("tau", 0.02)):
        genotypes[:, schema.index(f"foraging.{name}")] = value
    return genotypes


def test_policies_keep_what_was_learnt_and_those_that_learn_on_change_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Frozen weights are the same to the last bit after a life in a delayed body; both begin with all of them."""
    experience = gain_experience(CONFIG, learners(1), 1)
    before: list[NDArray[np.float32]] = []
    after: list[NDArray[np.float32]] = []

    def count_and_keep(colony: InProcessColony) -> IntArray:
        before.append(weights_by_tile(colony.batch, 0, 0.0))
        packs = count_packs(colony)
        after.append(weights_by_tile(colony.batch, 0, 0.0))
        return packs

    monkeypatch.setattr(experienced_foragers, "count_packs", count_and_keep)
    other = foraging_config(CONFIG.life.agents, False, "delayed")
    for frozen in (True, False):
        forage_again(other, experience, 2, frozen=frozen)
    assert np.any(before[0] != 0.0)
    assert np.array_equal(before[0], before[1])
    assert np.array_equal(before[0], after[0])
    assert not np.array_equal(before[1], after[1])


def test_who_has_learnt_captures_more_than_a_newborn() -> None:
    """At home, frozen as well; what they bring is not changed by using it."""
    genotypes = learners(1)
    experience = gain_experience(CONFIG, genotypes, 1)
    newborn = forage(CONFIG, genotypes, 2).sum()
    lives = [forage_again(CONFIG, experience, 2, frozen=frozen) for frozen in (True, False, True)]
    assert lives[0].sum() > newborn
    assert lives[1].sum() > newborn
    assert lives[0].tolist() == lives[2].tolist()


def test_wheels_that_turn_too_fast_are_another_body() -> None:
    """For all of them."""
    genotypes = learners(1)
    experience = gain_experience(CONFIG, genotypes, 1)
    for wheels in ((1.0, 1.0), (1.15, 0.85)):
        newborn = forage(CONFIG, genotypes, 2, wheels)
        frozen = forage_again(CONFIG, experience, 2, wheels, frozen=True)
        is_same = wheels == (1.0, 1.0)
        assert (newborn.tolist() == forage(CONFIG, genotypes, 2).tolist()) == is_same
        other = forage_again(CONFIG, experience, 2, frozen=True)
        assert (frozen.tolist() == other.tolist()) == is_same
