"""Agents share the robot's time: equally by default, by their own performance if that is set."""

import numpy as np
import pytest

from crcolony.evolution.time_sharing import (
    EpsilonGreedyOrder,
    RandomOrder,
    SoftmaxOrder,
    TimeSharing,
)

AGENTS = 6


def generation(order: TimeSharing, performance: np.ndarray, seed: int) -> list[int]:
    """Return the agents of all slices of a generation, in order."""
    rng = np.random.default_rng(seed)
    turns = np.zeros(AGENTS, dtype=np.int64)
    slices: list[int] = []
    while (following := order.next_agent(turns, performance, rng)) is not None:
        turns[following] += 1
        slices.append(following)
    return slices


@pytest.mark.parametrize("seed", range(5))
def test_in_random_order_every_round_is_a_permutation(seed: int) -> None:
    """No agent has a second slice before all have had one, and all have as many as there are
    rounds."""
    slices = np.array(generation(RandomOrder(3), np.zeros(AGENTS), seed)).reshape(3, AGENTS)
    for order in slices:
        assert sorted(order) == list(range(AGENTS))


def test_random_orders_are_uniform() -> None:
    """Each agent is first equally often (chi square of 5 degrees, 99.99 %)."""
    firsts = [generation(RandomOrder(1), np.zeros(AGENTS), seed)[0] for seed in range(3000)]
    counts = np.bincount(firsts, minlength=AGENTS)
    assert ((counts - 500) ** 2 / 500).sum() < 25.7


@pytest.mark.parametrize("order", [EpsilonGreedyOrder(4, 0.25), SoftmaxOrder(4, 0.25)])
def test_informed_orders_start_with_one_slice_each_and_then_prefer_the_best(
    order: TimeSharing,
) -> None:
    """The generation is as long as in rounds, and the best agent has most of the other slices."""
    performance = np.array([0.1, 0.2, 1.0, 0.0, 0.3, 0.1])
    for seed in range(5):
        slices = generation(order, performance, seed)
        assert len(slices) == 4 * AGENTS
        assert sorted(slices[:AGENTS]) == list(range(AGENTS))
        assert np.bincount(slices[AGENTS:], minlength=AGENTS).argmax() == 2


def test_epsilon_is_the_share_of_random_slices() -> None:
    """With 0 only the best agents have them, ties included; with 1 all agents do."""
    performance = np.array([0.0, 1.0, 1.0, 0.5, 0.2, 0.1])
    greedy = generation(EpsilonGreedyOrder(200, 0.0), performance, 1)[AGENTS:]
    assert set(greedy) == {1, 2}
    assert abs(np.mean(np.array(greedy) == 1) - 0.5) < 0.06
    random = np.bincount(generation(EpsilonGreedyOrder(500, 1.0), performance, 2), minlength=AGENTS)
    assert ((random - 500) ** 2 / 500).sum() < 25.7


def test_softmax_follows_the_boltzmann_distribution_of_relative_performance() -> None:
    """The odds of two agents are exp of their difference, relative to the best, over the
    temperature."""
    performance = np.array([2.0, 1.0, 0.0, 2.0, 1.0, 0.0])
    slices = generation(SoftmaxOrder(3000, 0.5), performance, 3)[AGENTS:]
    counts = np.bincount(slices, minlength=AGENTS)
    assert counts[0] / counts[1] == pytest.approx(np.exp(1.0), rel=0.1)
    assert counts[1] / counts[2] == pytest.approx(np.exp(1.0), rel=0.1)


def test_softmax_at_temperature_zero_is_greedy_and_without_performance_uniform() -> None:
    """Nothing is divided by zero."""
    performance = np.array([0.0, 3.0, 1.0, 3.0, 0.0, 0.0])
    assert set(generation(SoftmaxOrder(50, 0.0), performance, 4)[AGENTS:]) == {1, 3}
    assert set(generation(SoftmaxOrder(50, 0.5), np.zeros(AGENTS), 5)[AGENTS:]) == set(
        range(AGENTS)
    )
