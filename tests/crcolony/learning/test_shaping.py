"""Shaping by a potential changes how fast a learner learns, not what is best (section 3.2)."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from crcolony.compiled import FloatArray
from crcolony.learning.features import NormalizedRBF, TileCoding, uniform_offsets
from crcolony.learning.policies import softmax_probabilities
from crcolony.learning.sarsa_learner import SarsaLambda
from crcolony.learning.shaping import PotentialShaping, potential_shaping

LOW = np.array([0.0, -1.0])
HIGH = np.array([2.0, 1.0])
NETWORK = NormalizedRBF.grid(LOW, HIGH, np.array([4, 4]))
ACTIONS = 3

seeds = st.integers(0, 2**32)
fractions = st.floats(0.0, 1.0)


@given(seeds, fractions, st.integers(1, 50), st.booleans())
def test_shaping_telescopes(seed: int, gamma: float, steps: int, terminal: bool) -> None:
    """Discounted over an episode, the shaping rewards sum to gamma^T Phi(s_T) - Phi(s_0)."""
    rng = np.random.default_rng(seed)
    shaping = PotentialShaping(NETWORK, rng.normal(size=NETWORK.size), gamma)
    path = rng.uniform(LOW, HIGH, (steps + 1, 2))
    total = 0.0
    for t in range(steps):
        total += gamma**t * shaping(path[t], path[t + 1], terminal and t == steps - 1)
    last = 0.0 if terminal else gamma**steps * shaping.potential(path[-1])
    assert total == pytest.approx(last - shaping.potential(path[0]), abs=1e-9)


@given(seeds, fractions, fractions, fractions, st.floats(0.1, 5.0), st.integers(1, 6))
def test_shaping_equals_starting_from_the_potential(
    seed: int, alpha: float, gamma: float, lambda_: float, temperature: float, tilings: int
) -> None:
    """Wiewiora 2003: a learner shaped by Phi and one that starts with Q = Phi stay Phi apart."""
    rng = np.random.default_rng(seed)
    coding = TileCoding(LOW, HIGH, np.array([3, 4]), uniform_offsets(tilings, 2))
    potential = PotentialShaping(coding, rng.normal(size=coding.size), gamma)
    shaped = SarsaLambda(coding, ACTIONS, alpha, gamma, lambda_, temperature)
    started = SarsaLambda(coding, ACTIONS, alpha, gamma, lambda_, temperature)
    started.learner.weights[:] = potential.weights[:, None]
    probes = rng.uniform(LOW, HIGH, (5, 2))
    for _ in range(3):
        state, u = rng.uniform(LOW, HIGH), float(rng.random())
        assert shaped.start(state, u) == started.start(state, u)
        for t in range(20):
            terminal = t == 19
            state_next, reward = rng.uniform(LOW, HIGH), float(rng.normal())
            extra = potential(state, state_next, terminal)
            u = float(rng.random())
            chosen = shaped.step(reward + extra, state_next, terminal, u)
            assert chosen == started.step(reward, state_next, terminal, u)
            state = state_next
            for probe in probes:
                q, q_started = shaped.action_values(probe), started.action_values(probe)
                phi = potential.potential(probe)
                np.testing.assert_allclose(q_started - q, phi, atol=1e-7)
                np.testing.assert_allclose(
                    softmax_probabilities(q_started, temperature),
                    softmax_probabilities(q, temperature),
                    atol=1e-6,
                )


@given(st.floats(-1e3, 1e3), fractions)
def test_standing_still_is_rewarded_by_a_negative_potential(phi: float, gamma: float) -> None:
    """The hazard: a step that stays in place is rewarded with (gamma - 1) Phi, positive if Phi is
    negative."""
    assert potential_shaping(gamma, phi, phi) == pytest.approx((gamma - 1.0) * phi, abs=1e-9)


def test_impossible_shaping_is_refused() -> None:
    """Weights that do not fit the features, and a gamma above 1, raise ValueError."""
    weights: FloatArray = np.zeros(NETWORK.size)
    with pytest.raises(ValueError):
        PotentialShaping(NETWORK, weights[1:], 0.9)
    with pytest.raises(ValueError):
        PotentialShaping(NETWORK, weights, 1.1)
