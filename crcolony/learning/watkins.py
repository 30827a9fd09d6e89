"""Watkins's Q(lambda) with linear function approximation, Algorithm 2.1.

The thesis uses it with normalised RBF networks; any feature map will do. Off-policy: it learns the
values of the greedy policy, so an exploratory action clears all traces. As in the algorithm, Q_s is
kept from the step before, not computed again after the update.

It learns options, too (Paper I): after one of k steps all discounts are gamma^k (eq. 3.8).
"""

import numpy as np

from crcolony.compiled import BoolArray, FloatArray, IntArray
from crcolony.learning.features import FeatureMap
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.learning.td import linear_values, td_error
from crcolony.learning.traces import accumulate


class WatkinsQLambda:
    """Q(lambda) with accumulating traces and softmax action selection.

    `temperature` 0 is greedy and may be set at any time. `theta` (n, actions) are the parameters.
    """

    def __init__(
        self,
        features: FeatureMap,
        actions: int,
        alpha: float,
        gamma: float,
        lambda_: float,
        temperature: float = 0.0,
    ) -> None:
        """Raises ValueError for no action, or a meta-parameter out of its range."""
        if actions < 1:
            raise ValueError(f"a learner needs an action, got {actions}")
        if not (0.0 <= gamma <= 1.0 and 0.0 <= lambda_ <= 1.0):
            raise ValueError(f"gamma and lambda are in [0, 1], got {gamma} and {lambda_}")
        if alpha < 0.0 or temperature < 0.0:
            raise ValueError(f"not negative: alpha {alpha} and temperature {temperature}")
        self.features = features
        self.alpha = alpha
        self.gamma = gamma
        self.lambda_ = lambda_
        self.temperature = temperature
        self.theta: FloatArray = np.zeros((features.size, actions))
        self.e: FloatArray = np.zeros((features.size, actions))
        self._values: FloatArray = np.zeros(actions)
        self._scratch: FloatArray = np.zeros(actions)
        self._action = 0

    def start(self, state: FloatArray, u: float, available: BoolArray | None = None) -> int:
        """Start an episode in `state` (d,) with the uniform draw `u`; return the first action.

        It is one of the `available` (actions,), of all if these are None.
        """
        self.e[:] = 0.0
        features = self.features(state)
        values = self._values_of(features, available)
        return self._select_action(features, values, self.gamma, u)

    def step(
        self,
        reward: float,
        state: FloatArray,
        terminal: bool,
        u: float,
        steps: int = 1,
        available: BoolArray | None = None,
    ) -> int:
        """Learn from the last action's `reward` and next `state` (d,); return the next action.

        After a terminal state it is NO_ACTION. An option has taken `steps`, and its reward is discounted.
        """
        features = self.features(state)
        values = self._values_of(features, available)
        gamma = self.gamma**steps
        best = 0.0 if terminal else float(values.max())
        delta = td_error(reward, gamma, best, float(self._values[self._action]))
        self.theta += self.alpha * delta * self.e
        if terminal:
            self.e[:] = 0.0
            return NO_ACTION
        return self._select_action(features, values, gamma, u)

    def values(self, state: FloatArray) -> FloatArray:
        """Return Q_s (actions,) of `state` (d,)."""
        return linear_values(self.theta, *self.features(state))

    def _values_of(
        self, features: tuple[IntArray, FloatArray], available: BoolArray | None
    ) -> FloatArray:
        values = linear_values(self.theta, *features)
        return values if available is None else np.where(available, values, -np.inf)

    def _select_action(
        self, features: tuple[IntArray, FloatArray], values: FloatArray, gamma: float, u: float
    ) -> int:
        action = softmax(values, self.temperature, self._scratch, u)
        is_greedy = values[action] == values.max()  # ties count
        decay = gamma * self.lambda_ if is_greedy else 0.0
        accumulate(self.e, *features, action, decay)
        self._values = values
        self._action = action
        return action
