"""The optimal values of the mountain car, by dynamic programming on a grid of states, in numpy alone."""

from functools import cache

import numpy as np

from crcolony.compiled import FloatArray

POSITIONS = np.linspace(-1.2, 0.5, 341)
SPEEDS = np.linspace(-0.07, 0.07, 181)


@cache
def optimal_values() -> FloatArray:
    """Return V* (341, 181), minus the steps to the goal, by value iteration with linear interpolation."""
    x, v = np.meshgrid(POSITIONS, SPEEDS, indexing="ij")
    following = []
    for action in (-1, 0, 1):
        speed = np.clip(v + 0.001 * action - 0.0025 * np.cos(3.0 * x), -0.07, 0.07)
        position = x + speed
        speed = np.where(position <= -1.2, np.maximum(speed, 0.0), speed)
        following.append((np.clip(position, -1.2, 0.5), speed, position >= 0.5))
    values = np.zeros_like(x)
    for _ in range(300):
        best = np.max(
            [np.where(goal, 0.0, interpolate(values, p, s)) for p, s, goal in following], axis=0
        )
        if np.abs(best - 1.0 - values).max() < 1e-3:
            break
        values = best - 1.0
    return values


def interpolate(values: FloatArray, position: FloatArray, speed: FloatArray) -> FloatArray:
    """Return values between the states of the grid."""
    at_x = (position - POSITIONS[0]) / (POSITIONS[1] - POSITIONS[0])
    at_v = (speed - SPEEDS[0]) / (SPEEDS[1] - SPEEDS[0])
    i = np.clip(at_x.astype(int), 0, POSITIONS.size - 2)
    k = np.clip(at_v.astype(int), 0, SPEEDS.size - 2)
    along_x, along_v = at_x - i, at_v - k
    low = values[i, k] * (1.0 - along_v) + values[i, k + 1] * along_v
    high = values[i + 1, k] * (1.0 - along_v) + values[i + 1, k + 1] * along_v
    return np.asarray(low * (1.0 - along_x) + high * along_x)
