"""Tables of option values follow equations 3.7 and 3.8."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.learning.semi_mdp import OptionTable, Target, semi_mdp_update
from crcolony.learning.td import q_learning, sarsa0

fractions = st.floats(0.0, 1.0)


@pytest.mark.parametrize(
    ("steps", "value_next", "expected"),
    [
        # alpha 0.5, gamma 0.5; Q = 4, and rewards of 8 in each step
        (1, 16.0, 4.0 + 0.5 * (8.0 + 0.5 * 16.0 - 4.0)),
        (2, 16.0, 4.0 + 0.5 * (8.0 + 4.0 + 0.25 * 16.0 - 4.0)),
        (3, 16.0, 4.0 + 0.5 * (8.0 + 4.0 + 2.0 + 0.125 * 16.0 - 4.0)),
        (3, 0.0, 4.0 + 0.5 * (8.0 + 4.0 + 2.0 - 4.0)),
    ],
)
def test_an_option_of_k_steps_is_discounted_by_gamma_to_the_k(
    steps: int, value_next: float, expected: float
) -> None:
    """The updates are those that were worked by hand."""
    q = np.full((1, 1), 4.0)
    reward = sum(0.5**i * 8.0 for i in range(steps))
    delta = semi_mdp_update(q, 0, 0, reward, steps, value_next, 0.5, 0.5)
    assert q[0, 0] == expected
    assert delta == 2.0 * (expected - 4.0)


@given(st.integers(0, 2**32), fractions, fractions, st.sampled_from(Target))
def test_options_of_one_step_are_learnt_as_actions_are(
    seed: int, alpha: float, gamma: float, target: Target
) -> None:
    """Sarsa(0) and Q-learning of section 2 make the same updates, bit for bit."""
    rng = np.random.default_rng(seed)
    table, q = OptionTable(4, 3, target, alpha, gamma, temperature=1.0), np.zeros((4, 3))
    state = int(rng.integers(4))
    option = table.start(state, float(rng.random()))
    for t in range(40):
        state_next, reward, terminal = int(rng.integers(4)), float(rng.normal()), t == 39
        option_next = table.step(reward, state_next, terminal, float(rng.random()))
        place = q, state, option, reward, state_next
        if target is Target.SELECTED:
            sarsa0(*place, option_next, terminal, alpha, gamma)
        else:
            q_learning(*place, terminal, alpha, gamma)
        state, option = state_next, option_next
        assert table.q.tolist() == q.tolist()


def test_what_cannot_start_is_neither_selected_nor_counted() -> None:
    """The best of the options that can start in the next state is its value, and the next option."""
    table = OptionTable(2, 3, Target.BEST, alpha=1.0, gamma=0.5)
    table.q[1] = 1.0, 8.0, 4.0
    assert table.start(0, 0.0, np.array([False, False, True])) == 2
    assert table.step(1.0, 1, False, 0.0, 2, np.array([True, False, True])) == 2
    assert table.q[0].tolist() == [0.0, 0.0, 1.0 + 0.25 * 4.0]


def test_an_impossible_table_is_refused() -> None:
    """No states or options, and meta-parameters out of range."""
    for states, options, alpha, gamma, temperature in [
        (0, 1, 0.1, 0.9, 0.0),
        (1, 0, 0.1, 0.9, 0.0),
        (1, 1, -0.1, 0.9, 0.0),
        (1, 1, 0.1, 1.1, 0.0),
        (1, 1, 0.1, 0.9, -1.0),
    ]:
        with pytest.raises(ValueError):
            OptionTable(states, options, Target.BEST, alpha, gamma, temperature)
