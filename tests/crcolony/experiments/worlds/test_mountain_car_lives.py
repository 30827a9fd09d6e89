"""A life on the mountain car is Algorithm 2.2 with the potential of its genes, and known results hold for it."""

import numpy as np
import pytest

from crcolony.compiled import FloatArray, IntArray
from crcolony.experiments.worlds.mountain_car import ACTIONS, MOST_STEPS, draw_start, drive
from crcolony.experiments.worlds.mountain_car_genes import (
    ALPHA,
    CENTRES,
    GAMMA,
    HIGH,
    LAMBDA,
    LOW,
    POTENTIAL,
    TAU,
    TAU_DECAY,
    car_schema,
)
from crcolony.experiments.worlds.mountain_car_lives import CODING, learn, live_all, new_driver
from crcolony.learning.features import NormalizedRBF
from crcolony.learning.policies import hyperbolic_decay
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.shaping import PotentialShaping
from crcolony.randomness import draw, new_streams


def some_genes(seed: int) -> FloatArray:
    """Return genes of a learner that is neither greedy nor undiscounted."""
    genes = car_schema(True).random(np.random.default_rng(seed))
    genes[[ALPHA, GAMMA, LAMBDA, TAU, TAU_DECAY]] = 0.5, 0.99, 0.7, 1.5, 0.4
    return genes


def plain_life(genes: FloatArray, seed: int, episodes: int) -> tuple[list[int], list[float]]:
    """Return the steps of the episodes of a life, and for each the discounted sum of shaping rewards less what it
    should be; car, learner and potential are called one by one."""
    stream, state = new_streams(seed, (1,), 1)[0], np.zeros(2)
    gamma = float(genes[GAMMA])
    shaping = PotentialShaping(
        NormalizedRBF.grid(LOW, HIGH, np.array(CENTRES)), genes[POTENTIAL:], gamma
    )
    learner = SarsaLambda(CODING, ACTIONS, float(genes[ALPHA]), gamma, float(genes[LAMBDA]))
    steps, errors = [], []
    for episode in range(episodes):
        learner.temperature = hyperbolic_decay(genes[TAU], genes[TAU_DECAY], float(episode))
        draw_start(state, stream)
        first, total, count, terminal = shaping.potential(state), 0.0, 0, False
        action = learner.start(state, draw(stream))
        while not terminal:
            before = state.copy()
            terminal = drive(state, action)
            extra = shaping(before, state, terminal)
            total += gamma**count * extra
            action = learner.step(-1.0 + extra, state, terminal, draw(stream))
            count += 1
        steps.append(count)
        errors.append(total + first)
    return steps, errors


def test_a_life_is_that_of_its_parts() -> None:
    """Compiled as one it takes the same steps as car, learner and potential that are called one by one; and in every
    episode the shaping rewards sum up to -Phi(s_0), as Ng, Harada and Russell have it."""
    genes, steps = some_genes(1), np.zeros((1, 3), dtype=np.int64)
    live_all(new_driver(), genes[None], new_streams(4, (1,), 1)[0], steps)
    expected, errors = plain_life(genes, 4, 3)
    assert steps.tolist() == [expected]
    assert errors == pytest.approx([0.0] * 3, abs=1e-6)


def lives(genes: FloatArray, count: int, episodes: int) -> IntArray:
    """Return the steps (lives, episodes) of lives of the same genes."""
    steps = np.zeros((count, episodes), dtype=np.int64)
    live_all(new_driver(), np.tile(genes, (count, 1)), new_streams(1, (1,), 1)[0], steps)
    return steps


def test_nothing_is_left_of_an_earlier_life() -> None:
    """A life in used arrays is that in new ones, whatever was lived before."""
    driver, genes, other = new_driver(), some_genes(2), some_genes(3)
    found = []
    for _ in range(2):
        steps = np.zeros((2, 2), dtype=np.int64)
        live_all(driver, np.stack([genes, other]), new_streams(1, (1,), 1)[0], steps)
        found.append(steps.tolist())
    assert found[0] == found[1]


def test_a_life_may_be_lived_in_parts() -> None:
    """What was learnt stays, temperatures go on to fade, and an episode that was given up may be the last of a part."""
    genes = some_genes(3)
    for decay, is_given_up in ((0.0, True), (0.4, False)):
        genes[[ALPHA, TAU_DECAY]] = 0.2, decay
        whole, parts = np.zeros((1, 5), dtype=np.int64), np.zeros(5, dtype=np.int64)
        live_all(new_driver(), genes[None], new_streams(4, (1,), 1)[0], whole)
        assert (whole[0, 2] == MOST_STEPS) == is_given_up
        driver, stream = new_driver(), new_streams(4, (1,), 1)[0]
        learn(driver, genes, 0, stream, parts[:3])
        learn(driver, genes, 3, stream, parts[3:])
        assert parts.tolist() == whole[0].tolist()


def test_arrays_of_other_sizes_are_refused() -> None:
    """Compiled code relies on theirs."""
    driver = new_driver()
    other = SarsaLambda(CODING, ACTIONS + 1, alpha=0.0, gamma=1.0, lambda_=0.0).learner
    steps, stream = np.zeros((1, 1), dtype=np.int64), new_streams(1, (1,), 1)[0]
    with pytest.raises(ValueError, match="not a driver of the mountain car"):
        live_all(driver._replace(learner=other), some_genes(1)[None], stream, steps)


def test_without_a_potential_it_learns_as_published() -> None:
    """The mean of the first 50 episodes is near 249 steps with alpha 0.5 and lambda 0.9."""
    genes = np.zeros(len(car_schema(False)))
    genes[[ALPHA, GAMMA, LAMBDA]] = 0.5, 1.0, 0.9
    assert 220 < lives(genes, 30, 50).mean() < 280


def test_a_diverging_learner_gives_up_its_episodes() -> None:
    """Numbers that overflow end nothing but episodes."""
    genes = np.zeros(len(car_schema(False)))
    genes[[ALPHA, GAMMA, LAMBDA, TAU]] = 50.0, 1.0, 1.0, 1.0
    assert lives(genes, 1, 4).max() <= 5_000
