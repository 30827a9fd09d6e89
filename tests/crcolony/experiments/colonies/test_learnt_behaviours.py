"""Behaviours are learnt in isolation, are good for something, and stay as they are."""

import numpy as np
import pytest

from crcolony.experiments.colonies.learnt_behaviours import (
    LEARNING_STEPS,
    Behaviours,
    frozen_genotypes,
    learn_behaviours,
    start_colony,
    successes_of,
)
from crcolony.experiments.colonies.survival_lives import OWN, survival_config
from crcolony.robot.weight_rows import weights_by_tile


@pytest.fixture(scope="module")
def learnt() -> Behaviours:
    """What the experiment would learn with this seed."""
    return learn_behaviours(3, LEARNING_STEPS)


@pytest.mark.parametrize("behaviour", ["foraging", "mating"])
def test_what_is_learnt_succeeds_more_often_than_chance(learnt: Behaviours, behaviour: str) -> None:
    """Over other arenas: in some a pair never meets, since greedy robots that see nothing may turn for ever."""
    nothing = Behaviours(np.zeros_like(learnt.weights), learnt.is_visited)
    learnt_count, by_chance = (
        sum(successes_of(known, behaviour, seed, 1_000) for seed in range(50, 58))
        for known in (learnt, nothing)
    )
    assert learnt_count > 3 * by_chance > 0


def test_agents_with_learnt_behaviours_do_not_learn(learnt: Behaviours) -> None:
    """They capture and mate, and what was learnt before is what they know afterwards."""
    config = survival_config(OWN)
    selectors = np.zeros((config.robots, config.life.agents, 4))
    selectors[1:, :, 0] = 1.0
    colony = start_colony(config, frozen_genotypes(config, selectors), learnt)
    colony.run(1_500)
    batch = colony.batch
    assert batch.module_steps[0, :, 0].sum() > 0
    assert batch.module_steps[1:, :, 1].sum() > 0
    assert batch.matings.sum() > 0
    for row in range(config.robots):
        for known in weights_by_tile(batch, row, 0.0):
            assert known[learnt.is_visited].tolist() == learnt.weights[learnt.is_visited].tolist()
            assert not known[~learnt.is_visited].any()
