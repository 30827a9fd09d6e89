"""Potential-based shaping rewards, equation 3.1.

Added to the reward, the change in a potential leads learning without changing which policy is best
(Ng, Harada and Russell 1999), and equals starting from Q = Phi (Wiewiora 2003). The potential of a
terminal state is 0.

A hazard within a lifetime: standing still at a potential Phi is paid (gamma - 1) Phi in every step.
If Phi is negative, that is a wage for idling; once |Phi| (1 - gamma) exceeds what a step costs, a
learner idles for thousands of steps before the promise of the same best policy comes true. So keep
|Phi| (1 - gamma) below the reward of a step, or potentials not negative.
"""

from dataclasses import dataclass

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.learning.features import FeatureMap


@compiled
def potential_shaping(gamma: float, potential_next: float, potential: float) -> float:
    """F(s_t, s_(t+1)) = gamma Phi(s_(t+1)) - Phi(s_t)."""
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
        """Phi(s) of `state` (d,)."""
        indices, values = self.features(state)
        return float(np.dot(values, self.weights[indices]))

    def __call__(self, state: FloatArray, state_next: FloatArray, terminal: bool) -> float:
        """What going from `state` to `state_next` (d,) is paid on top of the reward."""
        potential_next = 0.0 if terminal else self.potential(state_next)
        return potential_shaping(self.gamma, potential_next, self.potential(state))
