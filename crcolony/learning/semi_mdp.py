"""Semi-MDP versions of Sarsa(0) and Q-learning with tables (eq. 3.7 and 3.8), for options that take several steps.

With options of one step they are the updates 2.13 and 2.14, bit for bit. As in `td.py` the table Q (states, options)
is updated in place, each update returns its TD error, and the value of a terminal state is 0.
"""

from enum import Enum

import numpy as np

from crcolony.compiled import BoolArray, FloatArray, compiled
from crcolony.learning.policies import NO_ACTION, softmax
from crcolony.learning.td import td_error


@compiled
def semi_mdp_update(
    q: FloatArray,
    state: int,
    option: int,
    reward: float,
    steps: int,
    value_next: float,
    alpha: float,
    gamma: float,
) -> float:
    """Update Q of an option that has ended, by the value of what comes next.

    `reward` is sum_i gamma^(i-1) r_(t+i) over its `steps`. That value is Q(s', o') in Sarsa(0) (eq. 3.7), the largest
    in Q-learning (eq. 3.8), and 0 after the end.
    """
    delta = td_error(reward, gamma**steps, value_next, q[state, option])
    q[state, option] += alpha * delta
    return delta


class Target(Enum):
    """By what value the next state counts."""

    SELECTED = "Sarsa(0)"
    """that of the option which is selected there (eq. 3.7)"""
    BEST = "Q-learning"
    """that of the best option which can start there (eq. 3.8)"""


class OptionTable:
    """A table of option values `q` (states, options), with softmax selection; for `OptionLearner`.

    `temperature` 0 is greedy and may be set at any time.
    """

    def __init__(
        self,
        states: int,
        options: int,
        target: Target,
        alpha: float,
        gamma: float,
        temperature: float = 0.0,
    ) -> None:
        """Raises ValueError for no state or option, or a meta-parameter out of its range."""
        if states < 1 or options < 1:
            raise ValueError(f"a table needs a state and an option, got {states} and {options}")
        if not (0.0 <= gamma <= 1.0 and alpha >= 0.0 and temperature >= 0.0):
            raise ValueError(
                f"gamma is in [0, 1], alpha and temperature are not negative, got {gamma}, {alpha} and {temperature}"
            )
        self.q: FloatArray = np.zeros((states, options))
        self.target = target
        self.alpha = alpha
        self.gamma = gamma
        self.temperature = temperature
        self._scratch: FloatArray = np.zeros(options)
        self._state = 0
        self._option = NO_ACTION

    def start(self, state: int, u: float, available: BoolArray | None = None) -> int:
        """Start an episode with the uniform draw `u`; return the first of the `available` (options,)."""
        self._state, self._option = state, self._select(self._values(state, available), u)
        return self._option

    def step(
        self,
        reward: float,
        state: int,
        terminal: bool,
        u: float,
        steps: int = 1,
        available: BoolArray | None = None,
    ) -> int:
        """Learn from the last option's `reward` and next `state` after some steps; return the next option.

        After a terminal state it is NO_ACTION.
        """
        values = self._values(state, available)
        option = NO_ACTION if terminal else self._select(values, u)
        value_next = 0.0
        if not terminal:
            value_next = float(values[option] if self.target is Target.SELECTED else values.max())
        semi_mdp_update(
            self.q, self._state, self._option, reward, steps, value_next, self.alpha, self.gamma
        )
        self._state, self._option = state, option
        return option

    def _values(self, state: int, available: BoolArray | None) -> FloatArray:
        values = self.q[state]
        return values if available is None else np.where(available, values, -np.inf)

    def _select(self, values: FloatArray, u: float) -> int:
        return softmax(values, self.temperature, self._scratch, u)
