"""Projected values follow equations 3.9 to 3.12."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.learning.policies import NO_ACTION
from crcolony.randomness import new_streams
from tests.support.random_task_graphs import STATES, RandomWorld, random_graph


@given(st.integers(0, 2**32))
def test_the_terms_along_the_greedy_path_sum_to_the_value(seed: int) -> None:
    """V of the primitive and all C are V of the root, whatever the tables hold; the path ends at the greedy action."""
    rng = np.random.default_rng(seed)
    graph = random_graph(rng)
    learner = MaxqQ(graph)
    for table in learner.learner.tables[:3]:
        table[:] = rng.normal(size=table.size)
    for state in range(STATES):
        terms = learner.decomposition(state)
        assert sum(value for _, value in terms) == pytest.approx(learner.value(state), abs=1e-12)
        action = learner.greedy_action(state)
        assert (action == NO_ACTION) == (not terms)
        if terms:
            assert (
                terms[0][0]
                == f"V({graph.order[learner.learner.graph.actions.tolist().index(action)]})"
            )
            assert all(name.startswith("C(") for name, _ in terms[1:])


@settings(max_examples=50)
@given(st.integers(0, 2**32), st.floats(0.0, 1.0))
def test_the_value_of_the_root_is_the_return_of_the_hierarchical_policy(
    seed: int, gamma: float
) -> None:
    """Once learnt, V of the root is what the greedy policy earns, discounted, from every state, whatever the
    pseudo-rewards are.

    This is so where subtasks end, by themselves wherever one ends that invokes them: every step leads on.
    """
    rng = np.random.default_rng(seed)
    graph = random_graph(rng, is_plain=True)
    world = RandomWorld(rng, 3)
    world.next_states[:] = rng.integers(np.arange(STATES)[:, None] + 1, STATES + 1, (STATES, 3))
    learner, stream = (
        MaxqQ(graph, gamma, default=NodeParameters(1.0)),
        new_streams(seed, (3,), 1)[0],
    )

    def live(state: int) -> float:
        action, earned, discount = learner.start(state, stream), 0.0, 1.0
        while action != NO_ACTION:
            state, reward, _ = world.step(state, action)
            earned, discount = earned + discount * reward, discount * gamma
            action = learner.step(reward, min(state, STATES - 1), state == STATES, stream)
        return earned

    for _ in range(20):
        returns = [live(state) for state in range(STATES)]
    for state in range(STATES):
        assert learner.value(state) == pytest.approx(returns[state], abs=1e-6)
