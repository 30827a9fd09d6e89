"""In the taxi's world learners reach the optimum that dynamic programming finds, and the thesis' example."""

import time

import numpy as np
import pytest

from crcolony.compiled import FloatArray
from crcolony.experiments.worlds.taxi import (
    STAND_CELLS,
    RewardConvention,
    encode_uncompiled,
    start_states,
)
from crcolony.experiments.worlds.taxi_learning import (
    Episodes,
    drive_greedily,
    flat_learner,
    learn_by_maxq,
    learn_by_q_learning,
    no_episodes,
)
from crcolony.experiments.worlds.taxi_optimum import drive_by_table, optimal_values
from crcolony.experiments.worlds.taxi_tasks import INITIAL_VALUE, dietterich_parameters, taxi_tasks
from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.randomness import new_streams

STEPS = 250_000
SOUTH_OF_R, R, B = 5, 0, 3
S1 = encode_uncompiled(SOUTH_OF_R, R, B)
"""The state of figure 3.1: the taxi one step south of R, where a passenger wants to B."""


def learn(abstract: bool, in_addition: bool) -> tuple[MaxqQ, Episodes]:
    """Return a learner, and all its episodes."""
    parameters = dietterich_parameters(abstract)
    learner = MaxqQ(taxi_tasks(abstract), parameters=parameters, initial_value=INITIAL_VALUE)
    episodes, stream = no_episodes(STEPS), new_streams(1, (1,), 1)[0]
    learn_by_maxq(learner.learner, start_states(), in_addition, STEPS, stream, episodes)
    return learner, episodes


def greedy_returns(learner: MaxqQ, in_addition: bool) -> FloatArray:
    """Return what the greedy hierarchy earns from every start."""
    returns = np.zeros(start_states().size)
    graph, tables = learner.learner.graph, learner.learner.tables
    drive_greedily(graph, tables, start_states(), in_addition, returns)
    return returns


@pytest.mark.parametrize("convention", RewardConvention)
@pytest.mark.parametrize("abstract", [False, True])
def test_a_hierarchy_learns_the_optimum(abstract: bool, convention: RewardConvention) -> None:
    """Its greedy actions earn V* from all starts, and with abstraction V of the root is V*."""
    in_addition = convention.is_in_addition
    learner, _ = learn(abstract, in_addition)
    best = optimal_values(convention)[start_states()]
    assert greedy_returns(learner, in_addition).tolist() == best.tolist()
    if abstract:
        values = [learner.value(int(state)) for state in start_states()]
        assert values == pytest.approx(best.tolist(), abs=1e-6)


def test_the_example_is_worth_ten() -> None:
    """V(Root, s1) = V(North) + C(Navigate(R), North) + C(Get, Navigate(R)) + C(Root, Get) (eq. 3.16)."""
    learner, _ = learn(abstract=True, in_addition=True)
    terms = learner.decomposition(S1)
    names = ["V(North)", "C(Navigate(R), North)", "C(Get, Navigate(R))", "C(Root, Get)"]
    assert [name for name, _ in terms] == names
    assert [value for _, value in terms] == pytest.approx([-1.0, 0.0, -1.0, 12.0], abs=1e-9)
    assert learner.value(S1) == pytest.approx(10.0, abs=1e-9)
    assert learner.value(S1, "Navigate(B)") == pytest.approx(-6.0, abs=1e-9)
    assert STAND_CELLS[R] == SOUTH_OF_R - 5


def test_flat_q_learning_learns_the_optimum_later() -> None:
    """With a table of 3,000 values it earns V* from all starts."""
    convention, starts = RewardConvention.IN_PLACE, start_states()
    learner = flat_learner(0.25, 1.0, 50.0, 0.998, 0.123)
    stream, episodes = new_streams(1, (1,), 1)[0], no_episodes(10)
    learn_by_q_learning(learner, starts, False, 2 * STEPS, stream, episodes)
    best = optimal_values(convention)[starts]
    assert drive_by_table(learner.q, starts, convention).tolist() == best.tolist()
    assert learner.q.size == 3000
    assert episodes.counts[:2].tolist() == [10, 2 * STEPS]


def test_episodes_are_counted_with_what_they_earned() -> None:
    """Their ends rise, none is shorter than the steps that its return says, and the last are near the optimum."""
    _, (counts, total, ends, returns) = learn(abstract=True, in_addition=False)
    count = int(counts[0])
    assert counts[1] == STEPS
    assert STEPS - ends[count - 1] < 20
    assert total[0] >= ends[count - 1] - STEPS
    lengths = np.diff(ends[:count], prepend=0)
    assert np.all(returns[:count] <= 21.0 - lengths)
    assert returns[count - 1000 : count].mean() == pytest.approx(7.93, abs=0.3)


def test_half_a_million_steps_take_a_second_at_most() -> None:
    """Learner and world together, on one core, in the processor's time."""
    learner, stream = (
        MaxqQ(taxi_tasks(abstract=True), default=NodeParameters(0.25, 1.0)),
        new_streams(1, (1,), 1)[0],
    )
    learn_by_maxq(learner.learner, start_states(), False, 10, stream, no_episodes(1))
    best = np.inf
    for _ in range(3):
        start = time.process_time()
        learn_by_maxq(learner.learner, start_states(), False, STEPS, stream, no_episodes(1))
        best = min(best, time.process_time() - start)
    assert STEPS / best > 500_000
