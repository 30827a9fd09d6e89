"""A learner to call once a step from Python has the meta-parameters that it was given."""

import numpy as np
import pytest

from crcolony.learning.features import TileCoding, uniform_offsets
from crcolony.learning.sarsa_learner import SarsaLambda

LOW, HIGH = np.array([0.0, -1.0]), np.array([2.0, 1.0])
ACTIONS = 3


def corridor(states: int) -> TileCoding:
    """Return one tile for each of the states 0, 1, ... `states` - 1: a table."""
    return TileCoding(np.zeros(1), np.array([float(states)]), np.array([states]), np.zeros((1, 1)))


@pytest.mark.parametrize("tilings", [1, 4, 7])
def test_every_action_starts_with_the_initial_value(tilings: int) -> None:
    """The initial value is divided among the tilings, however many there are."""
    coding = TileCoding(LOW, HIGH, np.array([3, 4]), uniform_offsets(tilings, 2))
    learner = SarsaLambda(coding, ACTIONS, 0.1, 0.9, 0.9, initial_value=-3.0)
    assert learner.action_values(LOW) == pytest.approx([-3.0] * ACTIONS)


def test_a_temperature_makes_it_explore() -> None:
    """At a high temperature all actions are equally likely; at 0 only the best is selected."""
    learner = SarsaLambda(corridor(1), 4, 0.0, 0.0, 0.0, temperature=1e9)
    learner.learner.weights[:] = [1.0, 2.0, 3.0, 0.0]
    state = np.zeros(1)
    assert [learner.start(state, (k + 0.5) / 4) for k in range(4)] == [0, 1, 2, 3]
    learner.temperature = 0.0
    assert learner.temperature == 0.0
    assert [learner.start(state, (k + 0.5) / 4) for k in range(4)] == [2, 2, 2, 2]


def test_an_impossible_learner_is_refused() -> None:
    """Meta-parameters out of range, no actions and states of another shape raise ValueError."""
    coding = corridor(2)
    for actions, alpha, gamma, lambda_, temperature in [
        (0, 0.1, 0.9, 0.9, 0.0),
        (2, -0.1, 0.9, 0.9, 0.0),
        (2, 0.1, 1.1, 0.9, 0.0),
        (2, 0.1, 0.9, -0.1, 0.0),
        (2, 0.1, 0.9, 0.9, -1.0),
        (2, float("nan"), 0.9, 0.9, 0.0),
    ]:
        with pytest.raises(ValueError):
            SarsaLambda(coding, actions, alpha, gamma, lambda_, temperature)
    learner = SarsaLambda(coding, 2, 0.1, 0.9, 0.9)
    with pytest.raises(ValueError):
        learner.temperature = -1.0
    with pytest.raises(ValueError):
        learner.start(np.zeros(2), 0.0)


def test_a_copy_of_the_weights_does_not_change_with_the_learner() -> None:
    """`weights` is a copy, with all pending updates applied."""
    learner = SarsaLambda(corridor(2), 1, 0.5, 1.0, 1.0)
    learner.start(np.array([0.5]), 0.0)
    learner.step(1.0, np.array([1.5]), False, 0.0)
    weights = learner.weights()
    assert weights[:2, 0].tolist() == [0.5, 0.0]
    learner.step(4.0, np.array([0.5]), True, 0.0)
    assert weights[:2, 0].tolist() == [0.5, 0.0]
