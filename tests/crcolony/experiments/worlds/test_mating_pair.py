"""Two robots mate when they face each other, and then begin again elsewhere."""

import math

import numpy as np

from crcolony.experiments.worlds.mating_pair import (
    EPISODE_STEPS,
    FACE,
    HIGH,
    LOW,
    NOTHING,
    TAIL,
    MatingPair,
    primitive_actions,
)

STOP, STRAIGHT = 1, 7
"""Numbers of the actions: of a speed of 0 and of 0.3 m/s, without turning."""


def pair_at(*poses: tuple[float, float, float]) -> MatingPair:
    """Return a pair at these poses (m, m, rad), in an episode."""
    pair = MatingPair(1, np.random.default_rng(1))
    pair.start()
    pair._arena.world.poses[:] = poses
    pair._arena.update_cells()
    return pair


def test_actions_are_those_of_the_colony() -> None:
    """Nine pairs of a speed and a turning rate, as wheel speeds."""
    wheels = primitive_actions()
    assert wheels.shape == (9, 2)
    assert wheels[STOP].tolist() == [0.0, 0.0]
    assert wheels[STRAIGHT].tolist() == [0.3, 0.3]


def test_they_mate_where_they_face_each_other() -> None:
    """Driving towards each other they see faces, come near, and the episode is over for both."""
    pair = pair_at((-0.5, 0.0, 0.0), (0.5, 0.0, math.pi))
    is_over, distances = False, []
    while not is_over:
        states, has_mated, is_over = pair.step((STRAIGHT, STRAIGHT))
        distances.append(states[0, 1])
        assert states[:, 0].tolist() == [FACE, FACE]
    assert has_mated
    assert distances == sorted(distances, reverse=True)
    assert distances[-1] < 0.45
    assert pair.steps < 10


def test_from_behind_a_tail_lamp_is_seen_and_nobody_mates() -> None:
    """And who looks the other way sees nothing."""
    pair = pair_at((-0.2, 0.0, 0.0), (0.2, 0.0, 0.0))
    states, has_mated, is_over = pair.step((STOP, STOP))
    assert states[:, 0].tolist() == [TAIL, NOTHING]
    assert not has_mated
    assert not is_over


def test_an_episode_without_a_mating_ends_after_a_while() -> None:
    """After 40 s of standing apart it is over, and nobody has mated."""
    pair = pair_at((-0.5, 0.0, math.pi), (0.5, 0.0, 0.0))
    found = [pair.step((STOP, STOP))[1:] for _ in range(EPISODE_STEPS)]
    assert found == [(False, False)] * (EPISODE_STEPS - 1) + [(False, True)]


def test_they_start_apart_and_see_what_is_there() -> None:
    """States are within their bounds; the same seed gives the same places."""
    one, other = (MatingPair(2, np.random.default_rng(3)) for _ in range(2))
    for _ in range(50):
        states = one.start()
        assert states.tolist() == other.start().tolist()
        assert np.all((states >= LOW) & (states <= HIGH))
        assert math.dist(*one._arena.world.poses[:, :2]) >= 0.7
