"""Perceptrons drive by their weights, and are bred by eq. 4.2."""

import math

import numpy as np
import pytest

from crcolony.experiments.worlds.looping_maze import SENSORS, khepera
from crcolony.experiments.worlds.navigator import (
    INDIVIDUALS,
    INPUTS,
    Navigation,
    live_often,
    navigation_fitness,
    perceptron_schema,
    respond,
)
from crcolony.randomness import Stream, new_streams

BIAS = SENSORS


def stream(seed: int = 1) -> Stream:
    found: Stream = new_streams(seed, (1,), 1)[0]
    return found


def wheels_of(left_bias: float, right_bias: float) -> np.ndarray:
    """Return the genes of a perceptron that senses nothing."""
    genes = np.zeros(2 * INPUTS)
    genes[[BIAS, INPUTS + BIAS]] = left_bias, right_bias
    return genes


@pytest.mark.parametrize(
    ("left", "right", "sense", "fitness"),
    [
        (1.0, 1.0, 0.0, 1.0),
        (-1.0, -1.0, 0.0, 1.0),
        (1.0, 1.0, 0.25, 0.75),
        (0.5, 0.5, 0.0, 0.5),
        (1.0, -1.0, 0.0, 0.0),
        (1.0, 0.0, 0.0, 0.5 * (1.0 - math.sqrt(0.5))),
        (1.0, 1.0, 1.0, 0.0),
    ],
)
def test_fitness_rewards_speed_straight_motion_and_distance_to_walls(
    left: float, right: float, sense: float, fitness: float
) -> None:
    """Equation 4.2 by hand."""
    assert navigation_fitness(left, right, sense) == pytest.approx(fitness)


def test_a_perceptron_weighs_sensors_bias_and_what_it_put_out_before() -> None:
    """Both wheels read the former outputs, not those of this loop."""
    genes = np.zeros(2 * INPUTS)
    genes[[0, BIAS, BIAS + 1, BIAS + 2]] = 2.0, 0.5, 1.0, -4.0
    genes[INPUTS + BIAS + 1] = 3.0
    senses, outputs = np.zeros(SENSORS), np.array([0.5, 0.25])
    senses[0] = 0.75
    respond(genes, senses, outputs)
    totals = (2.0 * 0.75 + 0.5 + 0.5 - 4.0 * 0.25, 3.0 * 0.5)
    assert outputs == pytest.approx([1.0 / (1.0 + math.exp(-total)) for total in totals])


def test_who_turns_on_the_spot_covers_no_lap_and_has_no_fitness() -> None:
    """Who drives blindly ahead is fast, and touches a wall."""
    (turning,) = live_often(khepera(), wheels_of(-20.0, 20.0), 1, 80, stream())
    assert turning.fitness == pytest.approx(0.0, abs=1e-6)
    assert (turning.touched, round(turning.laps, 6)) == (0.0, 0.0)
    (blind,) = live_often(khepera(), wheels_of(20.0, 20.0), 1, 80, stream())
    assert blind.speed == pytest.approx(1.0)
    assert blind.touched > 0.3


def test_laps_are_counted_in_either_direction() -> None:
    """A reflex that turns away from what is ahead gets half way around the maze within two minutes."""
    genes = wheels_of(3.0, 3.0)
    genes[[0, 1, 2]] = 3.0, 3.0, 1.0  # on the left: turn right
    genes[[INPUTS, INPUTS + 1]] = -9.0, -6.0
    laps = [life.laps for life in live_often(khepera(), genes, 8, 400, stream())]
    assert max(laps) > 0.5


def test_evolution_is_the_same_for_the_same_seed_and_improves() -> None:
    """In ten generations the population is far better than random perceptrons."""

    def course() -> list[float]:
        navigation = Navigation(np.random.default_rng(5), stream(5))
        means = []
        for _ in range(10):
            fitness = navigation.evaluate(khepera())
            assert fitness.shape == (INDIVIDUALS,)
            means.append(float(fitness.mean()))
            navigation.breed(fitness)
        return means

    means = course()
    assert means == course()
    assert means[-1] > 1.5 * means[0]


def test_first_weights_are_within_what_is_asked() -> None:
    """A gene for each input of each wheel."""
    schema = perceptron_schema(4.0)
    genes = np.stack([schema.random(np.random.default_rng(k)) for k in range(50)])
    assert genes.shape[1] == 2 * INPUTS
    assert 3.5 < np.abs(genes).max() <= 4.0
