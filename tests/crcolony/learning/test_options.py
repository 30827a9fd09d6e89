"""Options run until they end, and a learner hears of them what the semi-MDP updates need."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.features import NormalizedRBF
from crcolony.learning.options import Option, OptionLearner, macro_action
from crcolony.learning.policies import NO_ACTION
from crcolony.learning.semi_mdp import OptionTable, Target
from crcolony.learning.watkins import WatkinsQLambda

fractions = st.floats(0.0, 1.0)


def primitives(count: int) -> list[Option[Any]]:
    """Return the options that are the actions themselves."""
    return [macro_action(action, 1) for action in range(count)]


@given(st.integers(0, 2**32), fractions, fractions, st.sampled_from(Target))
def test_a_table_of_one_step_options_is_a_table_of_actions(
    seed: int, alpha: float, gamma: float, target: Target
) -> None:
    """The same draws give the same actions and values, bit for bit, with the options and without."""
    rng = np.random.default_rng(seed)
    plain = OptionTable(4, 3, target, alpha, gamma, temperature=0.7)
    table = OptionTable(4, 3, target, alpha, gamma, temperature=0.7)
    options = OptionLearner(table, primitives(3))
    for _ in range(3):
        state, u = int(rng.integers(4)), float(rng.random())
        assert options.start(state, u) == plain.start(state, u)
        for t in range(20):
            draw = float(rng.normal()), int(rng.integers(4)), t == 19, float(rng.random())
            assert options.step(*draw) == plain.step(*draw)
        assert table.q.tolist() == plain.q.tolist()


@given(st.integers(0, 2**32), fractions, fractions, fractions)
def test_watkins_with_one_step_options_is_watkins(
    seed: int, alpha: float, gamma: float, lambda_: float
) -> None:
    """With traces too, and an RBF network, parameters are the same bit for bit."""
    rng = np.random.default_rng(seed)
    network = NormalizedRBF.grid(np.zeros(1), np.ones(1), np.array([4]))
    plain = WatkinsQLambda(network, 3, alpha, gamma, lambda_, temperature=0.7)
    learner = WatkinsQLambda(network, 3, alpha, gamma, lambda_, temperature=0.7)
    options = OptionLearner(learner, primitives(3))
    state, u = rng.random(1), float(rng.random())
    assert options.start(state, u) == plain.start(state, u)
    for t in range(20):
        draw = float(rng.normal()), rng.random(1), t == 19, float(rng.random())
        assert options.step(*draw) == plain.step(*draw)
    assert learner.theta.tolist() == plain.theta.tolist()
    assert learner.e.tolist() == plain.e.tolist()


def test_a_macro_action_is_learnt_by_its_discounted_reward_and_length() -> None:
    """Three steps with rewards 8, 4 and 2, gamma 0.5 and a next value of 16: 8 + 2 + 0.5 + 0.125 * 16."""
    table = OptionTable(2, 2, Target.BEST, alpha=1.0, gamma=0.5)
    learner = OptionLearner(table, [macro_action(7, 3), macro_action(9, 1)])
    table.q[1] = 16.0, 0.0
    assert learner.start(0, 0.0) == 7
    assert [learner.step(reward, 0, False, 0.0) for reward in (8.0, 4.0)] == [7, 7]
    assert table.q[0].tolist() == [0.0, 0.0]
    assert learner.step(2.0, 1, False, 0.0) == 7
    assert table.q[0].tolist() == [8.0 + 2.0 + 0.5 + 0.125 * 16.0, 0.0]
    assert learner.step(4.0, 0, True, 0.0) == NO_ACTION  # the end of an episode ends an option
    assert table.q[1].tolist() == [4.0, 0.0]


def test_traces_fade_by_all_steps_of_an_option() -> None:
    """After an option of three steps they are (gamma^3 lambda) of what they were."""
    network = NormalizedRBF(np.zeros((1, 1)), np.ones(1))
    learner = WatkinsQLambda(network, 1, 0.0, 0.5, 0.8)
    options = OptionLearner(learner, [macro_action(0, 3)])
    options.start(np.zeros(1), 0.0)
    for _ in range(3):
        options.step(0.0, np.zeros(1), False, 0.0)
    assert learner.e.tolist() == [[pytest.approx(1.0 + 0.125 * 0.8)]]


def walk(
    options: list[Option[int]], draws: list[float], move: Callable[[int, int], int]
) -> list[int]:
    """Return the options that are executed, in every step, by a greedy table that never learns."""
    table = OptionTable(10, len(options), Target.BEST, alpha=0.0, gamma=1.0)
    learner = OptionLearner(table, options)
    state, action, executed = 0, learner.start(0, draws[0]), []
    for u in draws[1:]:
        executed.append(learner.option)
        state = move(state, action)
        action = learner.step(0.0, state, False, u)
    return executed


def test_an_option_follows_its_policy_until_it_ends() -> None:
    """Walking ends in state 3, where only turning can start, which leads back to 0."""
    forward = Option[int](lambda _: 1, lambda s: float(s == 3), lambda s: s != 3)
    turn = Option[int](lambda s: -s, lambda _: 1.0, lambda s: s == 3)
    executed = walk([turn, forward], [0.0] * 8, lambda state, action: state + action)
    assert executed == [1, 1, 1, 0, 1, 1, 1]


def test_an_option_ends_with_its_probability() -> None:
    """With beta 0.25 it ends where the draw is below, and the draw, stretched, selects the next."""
    always = Option[int](lambda _: 0, lambda _: 0.25)
    draws = [0.9, 0.3, 0.2, 0.25, 0.1]
    executed = walk([always, always], draws, lambda state, _: state)
    assert executed == [1, 1, 1, 1]  # 0.2 / 0.25 is 0.8: the second of two equal ones
    assert walk([always, always], [0.9, 0.1, 0.3], lambda state, _: state) == [1, 0]


def test_options_that_cannot_be_are_refused() -> None:
    """None at all, one that takes no step, and a state where none can start."""
    table = OptionTable(2, 1, Target.BEST, alpha=0.1, gamma=1.0)
    with pytest.raises(ValueError, match="needs an option"):
        OptionLearner(table, [])
    with pytest.raises(ValueError, match="a timeout of 0"):
        macro_action(0, 0)
    nowhere = Option[int](lambda _: 0, lambda _: 1.0, lambda _: False)
    with pytest.raises(ValueError, match="no option can start in state 1"):
        OptionLearner(table, [nowhere]).start(1, 0.0)
