"""Agents share the robot's time: fairly by default, by what they are worth to themselves where that is asked for."""

import numpy as np
import pytest

from crcolony.evolution.time_sharing import (
    EpsilonGreedyOrder,
    RandomOrder,
    SoftmaxOrder,
    TimeSharing,
)

AGENTS = 6


def generation(order: TimeSharing, worth: np.ndarray, seed: int) -> list[int]:
    """Return who had the robot's slices, in order, until the generation was over."""
    rng = np.random.default_rng(seed)
    turns = np.zeros(AGENTS, dtype=np.int64)
    slices: list[int] = []
    while (following := order.next_agent(turns, worth, rng)) is not None:
        turns[following] += 1
        slices.append(following)
    return slices


@pytest.mark.parametrize("seed", range(5))
def test_in_random_order_every_round_is_a_permutation(seed: int) -> None:
    """Nobody has a second slice before all had one, and everybody ends with as many as there are rounds."""
    slices = np.array(generation(RandomOrder(3), np.zeros(AGENTS), seed)).reshape(3, AGENTS)
    for order in slices:
        assert sorted(order) == list(range(AGENTS))


def test_random_orders_are_fair() -> None:
    """Each agent is first equally often (chi square of 5 degrees, 99.99 %)."""
    firsts = [generation(RandomOrder(1), np.zeros(AGENTS), seed)[0] for seed in range(3000)]
    counts = np.bincount(firsts, minlength=AGENTS)
    assert ((counts - 500) ** 2 / 500).sum() < 25.7


@pytest.mark.parametrize("order", [EpsilonGreedyOrder(4, 0.25), SoftmaxOrder(4, 0.25)])
def test_informed_orders_try_everybody_first_and_then_prefer_the_best(order: TimeSharing) -> None:
    """The generation is as long as with rounds, and the best agent has most of what is free."""
    worth = np.array([0.1, 0.2, 1.0, 0.0, 0.3, 0.1])
    for seed in range(5):
        slices = generation(order, worth, seed)
        assert len(slices) == 4 * AGENTS
        assert sorted(slices[:AGENTS]) == list(range(AGENTS))
        assert np.bincount(slices[AGENTS:], minlength=AGENTS).argmax() == 2


def test_epsilon_is_the_share_of_chance() -> None:
    """With 0 only the best go on, ties shared; with 1 everybody does."""
    worth = np.array([0.0, 1.0, 1.0, 0.5, 0.2, 0.1])
    greedy = generation(EpsilonGreedyOrder(200, 0.0), worth, 1)[AGENTS:]
    assert set(greedy) == {1, 2}
    assert abs(np.mean(np.array(greedy) == 1) - 0.5) < 0.06
    random = np.bincount(generation(EpsilonGreedyOrder(500, 1.0), worth, 2), minlength=AGENTS)
    assert ((random - 500) ** 2 / 500).sum() < 25.7


def test_softmax_follows_the_boltzmann_distribution_of_relative_worth() -> None:
    """The odds of two agents are exp of their difference, relative to the best, over the temperature."""
    worth = np.array([2.0, 1.0, 0.0, 2.0, 1.0, 0.0])
    slices = generation(SoftmaxOrder(3000, 0.5), worth, 3)[AGENTS:]
    counts = np.bincount(slices, minlength=AGENTS)
    assert counts[0] / counts[1] == pytest.approx(np.exp(1.0), rel=0.1)
    assert counts[1] / counts[2] == pytest.approx(np.exp(1.0), rel=0.1)


def test_softmax_at_temperature_zero_is_greedy_and_without_worth_is_fair() -> None:
    """Nobody divides by zero."""
    worth = np.array([0.0, 3.0, 1.0, 3.0, 0.0, 0.0])
    assert set(generation(SoftmaxOrder(50, 0.0), worth, 4)[AGENTS:]) == {1, 3}
    assert set(generation(SoftmaxOrder(50, 0.5), np.zeros(AGENTS), 5)[AGENTS:]) == set(
        range(AGENTS)
    )
