"""Learners of the mountain car compete, and who is selected goes on with what it has learnt."""

import numpy as np

from crcolony.experiments.worlds.mountain_car_competition import CarCompetition
from crcolony.experiments.worlds.mountain_car_evolution import CarSettings
from crcolony.experiments.worlds.mountain_car_genes import ALPHA, GAMMA, LAMBDA
from crcolony.randomness import new_streams


def competition(seed: int, instances: int = 4, episodes: int = 4) -> CarCompetition:
    """Return a small run."""
    settings = CarSettings(instances, generations=5, episodes=episodes)
    return CarCompetition(settings, np.random.default_rng(seed), new_streams(seed, (1,), 1)[0])


def test_the_same_seed_gives_the_same_run() -> None:
    """With every gene and every step, and episodes are counted from one competition to the next."""
    one, other = competition(3), competition(3)
    for number in range(3):
        first, second = one.advance(), other.advance()
        assert first.genotypes.tolist() == second.genotypes.tolist()
        assert first.steps.tolist() == second.steps.tolist()
        assert first.first_episode == 4 * number


def test_who_cannot_learn_takes_over_what_others_have_learnt() -> None:
    """An instance that learns nothing needs thousands of steps, until it goes on as one that has learnt; so the fittest
    are followed by as many, but for noise on their meta-parameters."""
    run = competition(1)
    run.genotypes[:] = 0.0
    run.genotypes[:, [ALPHA, GAMMA, LAMBDA]] = 0.0, 1.0, 0.9
    run.genotypes[0, ALPHA] = 0.5
    before = run.advance()
    assert before.mean_steps[1:].min() > 1.5 * before.mean_steps[0]
    assert np.count_nonzero(run.genotypes[:, ALPHA] > 0.1) >= 2
    after = run.advance()
    assert after.mean_steps.max() < before.mean_steps[0]
