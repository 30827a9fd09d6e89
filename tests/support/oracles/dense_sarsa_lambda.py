"""Algorithm 2.2 as printed: every trace and every weight is updated in every step."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.learning.features import TileCoding
from crcolony.learning.policies import softmax
from crcolony.learning.traces import replace_and_clear


class DenseSarsaLambda:
    """The oracle of `SarsaLambda`: equal to it with the same meta-parameters and the same draws."""

    def __init__(
        self,
        coding: TileCoding,
        actions: int,
        alpha: float,
        gamma: float,
        lambda_: float,
        temperature: float = 0.0,
    ) -> None:
        self.coding = coding
        self.rate = alpha / coding.active
        self.gamma = gamma
        self.lambda_ = lambda_
        self.temperature = temperature
        self.weights: FloatArray = np.zeros((coding.size, actions))
        self.e: FloatArray = np.zeros((coding.size, actions))
        self.scratch: FloatArray = np.zeros(actions)
        self.tiles, _ = coding(coding.low)
        self.action = 0

    def start(self, state: FloatArray, u: float) -> int:
        """Start an episode in `state` (d,); return the first action."""
        self.e[:] = 0.0
        self.tiles, _ = self.coding(state)
        self.action = softmax(
            self.weights[self.tiles].sum(axis=0), self.temperature, self.scratch, u
        )
        replace_and_clear(self.e, self.tiles, self.action, self.gamma * self.lambda_)
        return self.action

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int:
        """Learn from `reward` and next `state` (d,); return the next action, -1 after a terminal
        state."""
        delta = reward - self.weights[self.tiles, self.action].sum()
        if terminal:
            self.weights += self.rate * delta * self.e
            return -1
        self.tiles, _ = self.coding(state)
        values = self.weights[self.tiles].sum(axis=0)
        self.action = softmax(values, self.temperature, self.scratch, u)
        delta += self.gamma * values[self.action]
        self.weights += self.rate * delta * self.e
        replace_and_clear(self.e, self.tiles, self.action, self.gamma * self.lambda_)
        return self.action
