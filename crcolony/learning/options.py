"""Options (Sutton, Precup and Singh 1999; section 3.4.2): actions that are extended in time, and macro actions.

An `OptionLearner` lets a learner select among options as it would among actions. It executes them step by step, and
tells the learner when one has ended: with the reward sum_i gamma^(i-1) r_(t+i) and the number of steps that it took,
which is what the semi-MDP updates 3.7 and 3.8 need.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from crcolony.compiled import BoolArray
from crcolony.learning.policies import NO_ACTION

State = TypeVar("State")
AnyState = TypeVar("AnyState", contravariant=True)


@dataclass(frozen=True)
class Option(Generic[State]):
    """An option <I, pi, beta> (Definition 3.1), with a timeout.

    Raises ValueError for a timeout of less than a step.
    """

    policy: Callable[[State], int]
    """pi: the primitive action in a state"""
    termination: Callable[[State], float]
    """beta: the probability to end in a state"""
    can_start: Callable[[State], bool] = lambda _: True
    """I: whether it can be selected in a state"""
    timeout: int | None = None
    """Steps after which it ends in any case"""

    def __post_init__(self) -> None:
        if self.timeout is not None and self.timeout < 1:
            raise ValueError(f"an option takes a step at least, got a timeout of {self.timeout}")


def macro_action(action: int, repeats: int) -> Option[Any]:
    """Return the option that repeats a primitive action (Paper I). With one repeat it is that action.

    Raises ValueError for no repeats.
    """
    return Option(lambda _: action, lambda _: 0.0, timeout=repeats)


class SelectsOptions(Protocol[AnyState]):
    """A learner that selects options, such as `WatkinsQLambda`; `available` (options,) are those that can start."""

    @property
    def gamma(self) -> float:
        """The discount of one step."""

    def start(self, state: AnyState, u: float, available: BoolArray | None) -> int:
        """Start an episode; return the first option."""

    def step(
        self,
        reward: float,
        state: AnyState,
        terminal: bool,
        u: float,
        steps: int,
        available: BoolArray | None,
    ) -> int:
        """Learn from the option that has ended after some steps; return the next one."""


class OptionLearner(Generic[State]):
    """A learner to call once a step of the world, as if it selected primitive actions."""

    def __init__(self, learner: SelectsOptions[State], options: Sequence[Option[State]]) -> None:
        """Raises ValueError for no option."""
        if not options:
            raise ValueError("a learner needs an option")
        self.learner = learner
        self.options = tuple(options)
        self.option = NO_ACTION
        """The number of the one that is executed"""
        self._steps = 0
        self._reward = 0.0
        self._discount = 1.0

    def start(self, state: State, u: float) -> int:
        """Start an episode with the uniform draw `u`; return the first primitive action.

        Raises ValueError where no option can start.
        """
        return self._begin(self.learner.start(state, u, self._available(state)), state)

    def step(self, reward: float, state: State, terminal: bool, u: float) -> int:
        """Take the last action's `reward` and next `state`; return the next primitive action.

        `u` is a uniform draw, of termination and of selection. After a terminal state the action is NO_ACTION. Raises
        ValueError where the option has ended and no option can start.
        """
        self._reward += self._discount * reward
        self._discount *= self.learner.gamma
        self._steps += 1
        option = self.options[self.option]
        is_late = option.timeout is not None and self._steps >= option.timeout
        beta = 1.0 if terminal or is_late else option.termination(state)
        if u >= beta:
            return option.policy(state)
        available = None if terminal else self._available(state)
        selected = self.learner.step(
            self._reward,
            state,
            terminal,
            u / beta,  # uniform again, where u < beta
            self._steps,
            available,
        )
        return NO_ACTION if terminal else self._begin(selected, state)

    def _begin(self, option: int, state: State) -> int:
        self.option, self._steps, self._reward, self._discount = option, 0, 0.0, 1.0
        return self.options[option].policy(state)

    def _available(self, state: State) -> BoolArray:
        available = np.array([option.can_start(state) for option in self.options])
        if not available.any():
            raise ValueError(f"no option can start in state {state}")
        return available
