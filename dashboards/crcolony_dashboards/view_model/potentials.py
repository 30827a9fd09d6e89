"""The potential Φ of a learning module (thesis 5.3) over what a robot's camera sees."""

import numpy as np

from crcolony.compiled import FloatArray
from crcolony.learning.features import grid_axis
from crcolony.robot.genes import agent_schema
from crcolony.telemetry.peer_settings import Mind


def has_camera(mind: Mind) -> bool:
    """Return whether a robot sees anything that a potential could depend on."""
    return min(mind.body.camera_range_m, mind.body.camera_half_angle_rad) > 1e-6


def number_of_genes(mind: Mind) -> int:
    """Return how many genes an agent with these settings has."""
    return len(agent_schema(mind.learning, mind.heredity))


def potential(mind: Mind, weights: FloatArray, points: int) -> FloatArray:
    """Return a potential over distance (rows, from 0) and bearing (columns, from the left), (points, points).

    `weights` are those of its radial units, (distances, bearings).
    """
    range_m, half_angle_rad = mind.body.camera_range_m, mind.body.camera_half_angle_rad
    distances_m = np.linspace(0.0, range_m, points)
    bearings_rad = np.abs(np.linspace(-half_angle_rad, half_angle_rad, points))
    by_distance = _responses(distances_m, range_m, mind.learning.potential_distances)
    by_bearing = _responses(bearings_rad, half_angle_rad, mind.learning.potential_bearings)
    return np.asarray(by_distance @ weights @ by_bearing.T)


def _responses(inputs: FloatArray, high: float, count: int) -> FloatArray:
    """Return the responses of `count` normalised radial units between 0 and `high`, (inputs, units)."""
    centres, width = grid_axis(0.0, high, count)
    responses = np.exp(-0.5 * ((inputs[:, None] - centres) / width) ** 2)
    return np.asarray(responses / responses.sum(axis=1, keepdims=True))
