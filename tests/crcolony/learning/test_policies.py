"""Policies select actions as in section 2.6, for every draw and every temperature."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.compiled import FloatArray
from crcolony.learning.policies import (
    epsilon_greedy,
    epsilon_greedy_probabilities,
    exponential_decay,
    greedy,
    greedy_probabilities,
    hyperbolic_decay,
    linear_decay,
    softmax,
    softmax_probabilities,
)

DRAWS = (np.arange(20_000) + 0.5) / 20_000  # evenly over [0, 1): frequencies without noise

draws = st.floats(0.0, 1.0, exclude_max=True)
# few distinct values, so that ties are common
value_lists = st.lists(st.sampled_from([-2.0, 0.0, 0.5, 3.0]), min_size=1, max_size=9)
value_arrays = value_lists.map(np.array)


def frequencies(policy: Callable[[float], int], actions: int) -> FloatArray:
    """Return how often each action is selected over evenly spread draws."""
    chosen = [policy(float(u)) for u in DRAWS]
    return np.bincount(chosen, minlength=actions) / DRAWS.size


@given(value_arrays, draws)
def test_greedy_selects_a_best_action(values: FloatArray, u: float) -> None:
    """The value of the greedy action is the maximum."""
    assert values[greedy(values, u)] == values.max()


def test_greedy_breaks_ties_fairly() -> None:
    """Three actions that tie are selected a third of the time each."""
    values = np.array([1.0, 4.0, 4.0, 0.0, 4.0])
    found = frequencies(lambda u: greedy(values, u), 5)
    np.testing.assert_allclose(found, greedy_probabilities(values), atol=1e-4)


@pytest.mark.parametrize("epsilon", [0.0, 0.1, 0.7, 1.0])
def test_epsilon_greedy_uses_one_draw_for_both_choices(epsilon: float) -> None:
    """Epsilon is divided among all actions, and the rest among the best actions that tie."""
    values = np.array([1.0, 4.0, 4.0, 0.0])
    found = frequencies(lambda u: epsilon_greedy(values, epsilon, u), 4)
    np.testing.assert_allclose(found, epsilon_greedy_probabilities(values, epsilon), atol=3e-4)


@pytest.mark.parametrize("temperature", [0.05, 0.3, 1.0, 10.0, np.inf])
def test_softmax_frequencies_are_equation_2_18(temperature: float) -> None:
    """Actions are selected with the corrected Boltzmann probabilities."""
    values = np.array([0.2, -0.5, 1.0, 0.9])
    expected = np.exp(values / temperature) / np.sum(np.exp(values / temperature))
    found = frequencies(lambda u: softmax(values, temperature, np.empty(4), u), 4)
    np.testing.assert_allclose(found, expected, atol=1e-4)
    np.testing.assert_allclose(softmax_probabilities(values, temperature), expected, rtol=1e-12)


@given(value_arrays, st.sampled_from([0.0, 5e-324, 1e-300, 1e-12, 1e-4]), draws)
def test_softmax_without_temperature_is_greedy(
    values: FloatArray, temperature: float, u: float
) -> None:
    """As the temperature goes to 0, denormals and 0 included, softmax is greedy, draw by draw."""
    assert softmax(values, temperature, np.empty(values.size), u) == greedy(values, u)
    np.testing.assert_array_equal(
        softmax_probabilities(values, temperature), greedy_probabilities(values)
    )


@given(value_arrays, st.floats(0.01, 100.0), st.floats(-1e6, 1e6), draws)
def test_softmax_depends_on_differences_only(
    values: FloatArray, temperature: float, shift: float, u: float
) -> None:
    """A constant added to all values changes probabilities by no more than rounding."""
    np.testing.assert_allclose(
        softmax_probabilities(values + shift, temperature),
        softmax_probabilities(values, temperature),
        atol=1e-6,
    )


@given(
    st.lists(st.floats(), min_size=1, max_size=5).map(np.array),
    st.floats(0.0),
    draws | st.just(np.nextafter(1.0, 0.0)),
)
def test_every_value_gives_a_valid_action(values: FloatArray, temperature: float, u: float) -> None:
    """Infinite and NaN values, as of a learner that has diverged, still give an action that
    exists."""
    for action in [
        greedy(values, u),
        epsilon_greedy(values, 0.3, u),
        softmax(values, temperature, np.empty(values.size), u),
    ]:
        assert 0 <= action < values.size


def test_decays_are_those_of_the_thesis() -> None:
    """Linear stops at 0, exponential multiplies, hyperbolic divides."""
    assert [linear_decay(1.0, 0.25, t) for t in (0, 2, 4, 9)] == [1.0, 0.5, 0.0, 0.0]
    assert [exponential_decay(8.0, 0.5, t) for t in (0, 1, 3)] == [8.0, 4.0, 1.0]
    assert [hyperbolic_decay(6.0, 0.5, t) for t in (0, 2, 4)] == [6.0, 3.0, 2.0]


def test_a_negative_temperature_is_refused() -> None:
    """It would prefer the worst action."""
    with pytest.raises(ValueError):
        softmax_probabilities(np.zeros(2), -1.0)
