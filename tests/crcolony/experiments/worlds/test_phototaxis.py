"""Robots in a pen drive by four weights, and hand them on by their energy."""

import numpy as np
import pytest

from crcolony.experiments.worlds import phototaxis
from crcolony.experiments.worlds.phototaxis import (
    HAND_DESIGNED,
    HIGHEST_WEIGHT,
    LOWEST_WEIGHT,
    Pen,
    broadcast,
    drive,
    is_left_brighter,
    mutated,
    new_pen,
    random_weights,
    simulate,
    spend_and_gain,
)


def pen_of(*places_m: tuple[float, float], weights: float = 0.0) -> Pen:
    """Return robots at these places that look along x."""
    count = len(places_m)
    return Pen(np.full((count, 4), weights), np.array(places_m), np.zeros(count), np.zeros(count))


def test_a_robot_senses_on_which_side_the_lamp_is() -> None:
    """Before it and behind it."""
    pen = pen_of((-0.5, -0.3), (-0.5, 0.3), (0.5, -0.3))
    assert is_left_brighter(pen).tolist() == [True, False, True]
    pen.headings_rad[:] = np.pi
    assert is_left_brighter(pen).tolist() == [False, True, False]


def test_wheels_follow_input_and_bias() -> None:
    """Alike they drive straight on, at most at full speed; against each other they turn."""
    rng = np.random.default_rng(1)
    pen = pen_of((-0.9, -0.3), (-0.9, -0.3), (-0.9, -0.3))
    pen.weights[:] = [[7, 7, 7, 7], [0, 4, 0, 4], [-4, 0, 4, 0]]  # the lamp is on the left: input 1
    drive(pen, rng)
    assert pen.places_m[:, 0].round(6).tolist() == [-0.88, -0.89, -0.9]
    assert pen.headings_rad.round(6).tolist() == [0.0, 0.0, 0.2]


def test_whoever_reaches_the_lamp_gains_energy_and_is_somewhere_else() -> None:
    """The others pay for the step, and keep what they have, at least nothing."""
    pen = pen_of((0.1, 0.05), (0.8, 0.5))
    has_reached = drive(pen, np.random.default_rng(2))
    spend_and_gain(pen, has_reached)
    assert has_reached.tolist() == [True, False]
    assert np.hypot(*pen.places_m[0]) > phototaxis.LAMP_RADIUS_M
    assert pen.energies.round(6).tolist() == [0.299, 0.0]


def test_genes_go_from_full_robots_to_empty_ones_in_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not to those far away, not to full ones, not from empty ones; one gene at a time."""
    monkeypatch.setattr(phototaxis, "SEND_RATE", 1.0)
    monkeypatch.setattr(phototaxis, "MUTATION_PROBABILITY", 0.0)
    pen = pen_of((0.0, 0.0), (0.3, 0.0), (0.9, 0.0), (0.0, 0.3))
    pen.weights[:] = np.arange(1.0, 5.0)[:, None]
    pen.energies[:] = [1.0, 0.0, 0.0, 1.0]
    broadcast(pen, np.random.default_rng(3))
    assert pen.weights[[0, 2, 3]].tolist() == [[1.0] * 4, [3.0] * 4, [4.0] * 4]
    assert 2 <= np.count_nonzero(pen.weights[1] == 2.0) < 4
    assert set(pen.weights[1]) <= {1.0, 2.0, 4.0}


def test_a_weight_stays_an_integer_within_its_range(monkeypatch: pytest.MonkeyPatch) -> None:
    """However often it mutates."""
    monkeypatch.setattr(phototaxis, "MUTATION_PROBABILITY", 1.0)
    rng = np.random.default_rng(4)
    weight, seen = 5.0, set()
    for _ in range(2000):
        weight = mutated(weight, rng)
        seen.add(weight)
    assert seen == set(range(LOWEST_WEIGHT, HIGHEST_WEIGHT + 1))


def test_weights_evolve_only_if_genes_are_transferred() -> None:
    """A run is repeated by its seed."""
    weights = random_weights(np.random.default_rng(5))
    assert weights.shape == (8, 4)
    assert (weights == weights.round()).all()
    pens = [new_pen(weights, np.random.default_rng(6)) for _ in range(2)]
    assert np.array_equal(pens[0].places_m, pens[1].places_m)
    one, same = (simulate(weights, True, 300, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one, same)


@pytest.mark.parametrize("name", HAND_DESIGNED)
def test_a_hand_designed_controller_reaches_the_lamp_again_and_again(name: str) -> None:
    """Robots that drive anywhere do so rarely."""
    rng = np.random.default_rng(8)
    by_hand = simulate(np.tile(HAND_DESIGNED[name], (8, 1)), False, 600, rng).sum()
    assert by_hand > 30
    assert simulate(random_weights(rng), False, 600, rng).sum() < by_hand / 2
