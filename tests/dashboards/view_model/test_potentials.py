"""A drawn potential is the one by which the robot shapes its rewards."""

import numpy as np
import pytest
from crcolony_dashboards.view_model.potentials import potential
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body.settings import CyberRodent
from crcolony.learning.features import NormalizedRBF, grid_axis, grid_rbf_value
from crcolony.robot.settings import Heredity, Learning
from crcolony.telemetry.peer_settings import Mind


def mind(distances: int, bearings: int, range_m: float, half_angle_rad: float) -> Mind:
    body = CyberRodent(camera_range_m=range_m, camera_half_angle_rad=half_angle_rad)
    learning = Learning(potential_distances=distances, potential_bearings=bearings)
    return Mind(body, learning, Heredity())


@given(
    st.integers(1, 6), st.integers(1, 6), st.floats(0.1, 10.0), st.floats(0.1, 3.0),
    st.integers(0, 2**32),
)  # fmt: skip
def test_a_drawn_potential_equals_that_of_the_robot(
    distances: int, bearings: int, range_m: float, half_angle_rad: float, seed: int
) -> None:
    """Over distance and absolute bearing it equals the compiled step's value, and the network's."""
    weights = np.random.default_rng(seed).normal(size=(distances, bearings))
    picture = potential(mind(distances, bearings, range_m, half_angle_rad), weights, 61)
    assert picture.shape == (61, 61)
    assert picture == pytest.approx(picture[:, ::-1])
    axes = (grid_axis(0.0, range_m, distances), grid_axis(0.0, half_angle_rad, bearings))
    (centres_m, width_m), (centres_rad, width_rad) = axes
    scratch = np.empty(distances), np.empty(bearings)
    network = NormalizedRBF.grid(
        np.zeros(2), np.array([range_m, half_angle_rad]), np.array([distances, bearings])
    )
    for row, column in ((0, 0), (0, 30), (60, 60), (17, 41), (44, 5)):
        distance_m, bearing_rad = range_m * row / 60, abs(half_angle_rad * (column - 30) / 30)
        value = grid_rbf_value(
            distance_m, bearing_rad, centres_m, width_m, centres_rad, width_rad,
            weights.ravel(), *scratch,
        )  # fmt: skip
        assert picture[row, column] == pytest.approx(value, abs=1e-9)
        _, features = network(np.array([distance_m, bearing_rad]))
        assert picture[row, column] == pytest.approx(features @ weights.ravel(), abs=1e-9)
