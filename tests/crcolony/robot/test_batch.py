"""The arrays of a batch follow from the settings."""

import numpy as np
import pytest

from crcolony.body.settings import CyberRodent
from crcolony.robot.batch import empty_robots, step_parameters, weight_bytes
from crcolony.robot.settings import Learning, Life


def test_actions_are_all_pairs_of_a_speed_and_a_turn_as_wheel_speeds() -> None:
    """The mean of both wheels is the speed, and their difference over the track is the turning
    rate."""
    learning, rodent = Learning(), CyberRodent()
    wheel_speeds = step_parameters(learning, Life(), rodent).wheel_speeds
    pairs = [(v, w) for v in learning.speeds_m_s for w in learning.turns_rad_s]
    assert wheel_speeds.mean(axis=1) == pytest.approx([v for v, _ in pairs])
    assert (wheel_speeds[:, 1] - wheel_speeds[:, 0]) / rodent.track_m == pytest.approx(
        [w for _, w in pairs]
    )


def test_tilings_and_potential_cover_what_the_camera_sees() -> None:
    """Distances go up to the range of the camera, bearings to half its angle on both sides."""
    rodent = CyberRodent(camera_range_m=2.0, camera_half_angle_rad=1.0)
    parameters = step_parameters(Learning(), Life(), rodent)
    assert parameters.low.tolist() == [0.0, -1.0]
    highest = parameters.low + parameters.tile_counts / parameters.tiles_per_unit
    assert highest == pytest.approx([2.0, 1.0])
    assert parameters.potential_distances_m[[0, -1]].tolist() == [0.0, 2.0]
    assert parameters.potential_bearings_rad[[0, -1]].tolist() == [0.0, 1.0]


def test_only_a_refractory_module_has_a_refractory_time() -> None:
    """Foraging has none, mating has that of the settings."""
    parameters = step_parameters(Learning(), Life(refractory_steps=7), CyberRodent())
    assert parameters.refractory_steps.tolist() == [0, 7]


def test_robots_have_random_streams_of_their_own() -> None:
    """All robots of a colony and of two seeds draw different numbers, and one seed gives the same
    ones."""
    parameters = step_parameters(Learning(), Life(), CyberRodent())
    one, same, other = (empty_robots(50, parameters, 1, 1, seed).streams for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert np.unique(np.concatenate([one, other])[:, 0]).size == 100


def test_the_memory_of_the_weights_is_known_before_they_are_allocated() -> None:
    """It grows with robots, agents and modules."""
    learning, life = Learning(), Life(agents=3)
    parameters = step_parameters(learning, life, CyberRodent())
    robots = empty_robots(2, parameters, life.agents, 1, 1)
    assert robots.weights.nbytes == weight_bytes(2, learning, life)
