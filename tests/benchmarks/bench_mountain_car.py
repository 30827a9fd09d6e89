"""Steps a second of Algorithm 2.2 on the mountain car: compiled, called from Python, and dense.

Run with `python -m tests.benchmarks.bench_mountain_car`. A step is one of the car and one of the
learner. Each way runs five times, in turn; printed are medians, and how often faster than dense.
"""

import time
from collections.abc import Callable
from math import cos
from statistics import median
from typing import Protocol

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.experiments.worlds.mountain_car import ACTIONS, random_starts
from crcolony.learning.features import TileCoding, uniform_offsets
from crcolony.learning.sarsa_learner import SarsaLambda
from tests.support.oracles.dense_sarsa_lambda import DenseSarsaLambda
from tests.support.oracles.mountain_car import drive_episodes

REPEATS = 5
CODING = TileCoding(
    np.array([-1.2, -0.07]), np.array([0.5, 0.07]), np.array([8, 8]), uniform_offsets(8, 2)
)


class StepLearner(Protocol):
    """A learner that is called once a step."""

    def start(self, state: FloatArray, u: float) -> int: ...

    def step(self, reward: float, state: FloatArray, terminal: bool, u: float) -> int: ...


def drive_in_python(position: float, velocity: float, action: int) -> tuple[float, float, bool]:
    """The car of `worlds/mountain_car.py`, as one would write it in Python."""
    velocity += (action - 1) * 0.001 - cos(3.0 * position) * 0.0025
    if velocity > 0.07:
        velocity = 0.07
    elif velocity < -0.07:
        velocity = -0.07
    position += velocity
    if position < -1.2:
        return -1.2, 0.0, False
    return position, velocity, position >= 0.5


def run_step_by_step(learner: StepLearner, episodes: int, rng: np.random.Generator) -> int:
    """Learn `episodes`, all in Python but for the learner; the steps taken."""
    steps = 0
    draws = rng.random(997).tolist()
    state = np.zeros(2)
    for position in random_starts(episodes, rng).tolist():
        velocity, terminal = 0.0, False
        state[0], state[1] = position, velocity
        action = learner.start(state, draws[steps % 997])
        while not terminal:
            position, velocity, terminal = drive_in_python(position, velocity, action)
            state[0], state[1] = position, velocity
            action = learner.step(-1.0, state, terminal, draws[steps % 997])
            steps += 1
    return steps


def compiled_loop(rng: np.random.Generator) -> int:
    """Car and learner in one compiled loop."""
    learner = SarsaLambda(CODING, ACTIONS, alpha=0.5, gamma=1.0, lambda_=0.9)
    starts, draws = random_starts(3000, rng), rng.random(997)
    steps = np.zeros(3000, dtype=np.int64)
    return drive_episodes(learner.learner, np.zeros(2), starts, draws, steps)


def step_by_step(rng: np.random.Generator) -> int:
    """The car in Python, a call of the fast learner in each step."""
    learner = SarsaLambda(CODING, ACTIONS, alpha=0.5, gamma=1.0, lambda_=0.9)
    return run_step_by_step(learner, 500, rng)


def dense(rng: np.random.Generator) -> int:
    """The car in Python, numpy over all weights in each step."""
    learner = DenseSarsaLambda(CODING, ACTIONS, alpha=0.5, gamma=1.0, lambda_=0.9)
    return run_step_by_step(learner, 30, rng)


def steps_per_second(way: Callable[[np.random.Generator], int], seed: int) -> float:
    """One timed run."""
    rng = np.random.default_rng(seed)
    begun = time.perf_counter()
    steps = way(rng)
    return steps / (time.perf_counter() - begun)


def main() -> None:
    """Print the table."""
    ways = [compiled_loop, step_by_step, dense]
    for way in ways:
        way(np.random.default_rng(0))  # compile, warm up
    speeds: dict[str, list[float]] = {way.__name__: [] for way in ways}
    for repeat in range(REPEATS):
        for way in ways:
            speeds[way.__name__].append(steps_per_second(way, repeat))
    baseline = median(speeds["dense"])
    for name, found in speeds.items():
        middle = median(found)
        spread = f"{min(found) / 1e6:.3f} to {max(found) / 1e6:.3f}"
        print(
            f"{name:14} {middle / 1e6:7.3f} M steps/s ({spread}), {middle / baseline:6.1f} x dense"
        )


if __name__ == "__main__":
    main()
