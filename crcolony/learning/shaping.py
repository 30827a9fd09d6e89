"""Potential-based shaping rewards, equation 3.1.

Added to the reward, the change in a potential guides learning without changing which policy is best
(Ng, Harada and Russell 1999), and equals starting from Q = Phi (Wiewiora 2003). The potential of a
terminal state is 0.

A hazard in a short lifetime: standing still at a potential Phi is rewarded with (gamma - 1) Phi in
every step. If Phi is negative, that rewards idling; once |Phi| (1 - gamma) exceeds what a step
costs, a learner idles for thousands of steps before it finds the best policy, which is the same. So
keep |Phi| (1 - gamma) below the reward of a step, or potentials not negative.
"""

from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.learning.features import FeatureMap


@compiled
def potential_shaping(gamma: float, potential_next: float, potential: float) -> float:
    """Return F(s_t, s_(t+1)) = gamma Phi(s_(t+1)) - Phi(s_t) (eq. 3.1)."""
    return gamma * potential_next - potential


@dataclass(frozen=True, eq=False)
class PotentialShaping:
    """Shaping by a potential Phi(s) that is linear in features, such as a normalised RBF network.

    `weights` are (features.size,). Raises ValueError if they are not, or gamma is not in [0, 1].
    """

    features: FeatureMap
    weights: FloatArray
    gamma: float

    def __post_init__(self) -> None:
        if self.weights.shape != (self.features.size,):
            raise ValueError(f"{self.features.size} features, but weights {self.weights.shape}")
        if not 0.0 <= self.gamma <= 1.0:
            raise ValueError(f"gamma is in [0, 1], got {self.gamma}")

    def potential(self, state: FloatArray) -> float:
        """Return Phi(s) of `state` (d,)."""
        indices, values = self.features(state)
        return float(np.dot(values, self.weights[indices]))

    def __call__(self, state: FloatArray, state_next: FloatArray, terminal: bool) -> float:
        """Return what is added to the reward of going from `state` to `state_next` (d,)."""
        potential_next = 0.0 if terminal else self.potential(state_next)
        return potential_shaping(self.gamma, potential_next, self.potential(state))
