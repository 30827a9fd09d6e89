"""MAXQ-Q without recursion is Algorithm 3.1, step by step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from crcolony.learning.maxq.decomposition import completion
from crcolony.learning.maxq.maxq_learner import MaxqQ, NodeParameters
from crcolony.learning.maxq.task_graph import Composite, Primitive, QNode, TaskGraph
from crcolony.learning.policies import NO_ACTION
from crcolony.randomness import new_streams
from tests.support.oracles.recursive_maxq_q import RecursiveMaxqQ
from tests.support.random_task_graphs import STATES, RandomWorld, random_graph

fractions = st.floats(0.0, 1.0)
NOWHERE = np.zeros(3, dtype=np.bool_)


@settings(max_examples=150)
@given(st.integers(0, 2**32), fractions, fractions, st.sampled_from([0.0, 0.3, 5.0]), fractions)
def test_it_equals_the_algorithm_as_printed(
    seed: int, gamma: float, alpha: float, temperature: float, cooling: float
) -> None:
    """On any graph and world the same draws give the same actions, values and temperatures."""
    rng = np.random.default_rng(seed)
    graph = random_graph(rng)
    world = RandomWorld(rng, 3)
    parameters = NodeParameters(alpha, temperature, cooling)
    learner = MaxqQ(graph, gamma, default=parameters)
    oracle = RecursiveMaxqQ(graph, gamma, alpha, temperature, cooling)
    stream, oracle_stream = new_streams(seed, (1,), 1)[0], new_streams(seed, (1,), 1)[0]
    for _ in range(6):
        start = int(rng.integers(STATES))
        actions = []
        state, world.steps_left = start, 30
        action = learner.start(state, stream)
        while action != NO_ACTION:
            actions.append(action)
            state, reward, terminal = world.step(state, action)
            action = learner.step(reward, state, terminal, stream)
        oracle.actions, world.steps_left = [], 30
        oracle.episode(world.step, start, oracle_stream)
        assert actions == oracle.actions
    assert stream.tolist() == oracle_stream.tolist()
    for name in graph.order:
        for state in range(STATES):
            assert learner.value(state, name) == oracle.value(name, state)
        assert learner.temperature(name) == oracle.temperature[name]
        assert_completions_equal(learner, oracle, name)


def assert_completions_equal(learner: MaxqQ, oracle: RecursiveMaxqQ, name: str) -> None:
    """Compare C and C~ of all Q nodes of a subtask."""
    subtask, (flat, tables, *_) = learner.graph[name], learner.learner
    if isinstance(subtask, Primitive):
        return
    for number in range(len(subtask.q_nodes)):
        edge = int(flat.first_edges[learner.graph.order.index(name)]) + number
        for state in range(STATES):
            outer = completion(flat, tables.completions, edge, state)
            assert outer == oracle.completion(oracle.c, subtask, number, state)
            inner = completion(flat, tables.inner_completions, edge, state)
            assert inner == oracle.completion(oracle.inner, subtask, number, state)


def chain(pseudo_reward: float) -> TaskGraph:
    """Return a root that waits in 0, or leaves it by a subtask that ends in 1, or in 2 as it is rewarded for."""
    walk = Composite(
        "Walk",
        (QNode(("step",)), QNode(("jump",))),
        np.array([False, True, True]),
        np.array([0.0, 0.0, pseudo_reward]),
    )
    root = Composite("Root", (QNode(("Walk",)), QNode(("wait",))), NOWHERE)
    actions = tuple(Primitive(name, n) for n, name in enumerate(("step", "jump", "wait")))
    return TaskGraph(3, (root, walk, *actions))


def live(learner: MaxqQ, episodes: int) -> None:
    """Learn where step leads to state 1 for -1, jump to 2 for -1.5, both the end, and wait nowhere for -1."""
    stream = new_streams(1, (2,), 1)[0]
    for _ in range(episodes):
        state, action = 0, learner.start(0, stream)
        while action != NO_ACTION:
            state = min(state + (1, 2, 0)[action], 2)
            action = learner.step((-1.0, -1.5, -1.0)[action], state, state > 0, stream)


def test_pseudo_rewards_decide_what_a_subtask_does_and_not_what_it_is_worth() -> None:
    """A subtask that is to end in state 1 steps for -1; one that must not, jumps for -1.5 and is worth just that."""
    for pseudo_reward, action, worth in [(-9.0, 0, -1.0), (9.0, 1, -1.5)]:
        learner = MaxqQ(chain(pseudo_reward), default=NodeParameters(0.5, 5.0))
        live(learner, 400)
        assert learner.greedy_action(0) == action
        assert learner.value(0, "Walk") == pytest.approx(worth, abs=1e-6)


def test_a_subtask_cools_where_it_ends_at_a_goal() -> None:
    """Its temperature falls with every goal, with a negative pseudo-reward and elsewhere it stays."""
    for pseudo_reward, cooled in [(-1.0, False), (0.0, True)]:
        parameters = {"Walk": NodeParameters(0.5, 3.0, 0.5), "Root": NodeParameters(0.5, 0.0)}
        graph = chain(pseudo_reward)
        learner = MaxqQ(graph, parameters=parameters)
        stream = new_streams(1, (2,), 1)[0]
        learner.start(0, stream)
        learner.step(-1.0, 2, True, stream)
        assert learner.temperature("Walk") == (1.5 if cooled else 3.0)


def test_a_root_that_can_invoke_nothing_has_ended() -> None:
    """Where all subtasks of the root have ended there is no action, at the start and on the way."""
    walk = Composite("Walk", (QNode(("step",)),), np.array([False, False, True]))
    learner = MaxqQ(
        TaskGraph(3, (Composite("Root", (QNode(("Walk",)),), NOWHERE), walk, Primitive("step", 0)))
    )
    stream = new_streams(1, (2,), 1)[0]
    assert learner.start(2, stream) == NO_ACTION
    assert learner.greedy_action(2) == NO_ACTION
    assert learner.decomposition(2) == []
    assert learner.start(0, stream) == 0
    assert learner.step(-1.0, 1, False, stream) == 0
    assert learner.step(-1.0, 2, False, stream) == NO_ACTION


def test_of_a_long_subtask_the_last_steps_are_learnt_from() -> None:
    """With a memory of two steps the third last has no part in an update."""
    walk = Composite("Walk", (QNode(("step",)),), np.array([False] * 3 + [True] * 2))
    end = Composite("Root", (QNode(("Walk",)), QNode(("stop",))), np.zeros(5, dtype=np.bool_))
    graph = TaskGraph(5, (end, walk, Primitive("step", 0), Primitive("stop", 1)))
    learner = MaxqQ(graph, default=NodeParameters(1.0), memory=2)
    learner.learner.tables.values[:] = 8.0  # of Stop in state 3, and of all else
    stream = new_streams(1, (2,), 1)[0]
    assert learner.start(0, stream) == 0
    for state in (1, 2, 3):
        learner.step(-1.0, state, False, stream)
    completions = learner.learner.tables.completions[-10:-5]  # C(Root, s, Walk)
    assert completions.tolist() == [0.0, 8.0, 8.0, 0.0, 0.0]
