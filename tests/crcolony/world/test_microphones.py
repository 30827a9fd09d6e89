"""Microphones sense the loudness of the speakers around."""

import pytest

from crcolony.body import contract
from tests.support.small_arenas import new_arena, put


def test_loudness_falls_with_distance_and_is_larger_at_the_nearer_microphone() -> None:
    """A silent speaker, and one beyond the range, are not sensed."""
    arena = new_arena(2, body={"microphones": True})

    def sensed(x: float, y: float, loudness: float = 1.0) -> list[float]:
        put(arena, [(0.0, 0.0, 0.0), (x, y, 0.0)])
        arena.world.actions[1, contract.SPEAKER] = loudness
        left, right = arena.observe()[0, contract.MICROPHONES : contract.MICROPHONES + 2]
        return [float(left), float(right)]

    assert sensed(1.0, 0.0, 0.0) == [0.0, 0.0]
    assert sensed(1.6, 0.0) == [0.0, 0.0]
    left, right = sensed(0.0, 0.6)
    assert left > right > 0.0
    assert sensed(0.0, -0.6) == pytest.approx([right, left])
    ahead = sensed(0.6, 0.0)
    assert ahead[0] == ahead[1] > sensed(1.2, 0.0)[0] > 0.0
    assert sensed(0.6, 0.0, 0.5)[0] == pytest.approx(0.5 * ahead[0])


def test_the_loudness_of_several_speakers_adds_up_to_1_at_most() -> None:
    """A microphone saturates."""
    arena = new_arena(4, body={"microphones": True})
    put(arena, [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.3, 0.0)])
    columns = slice(contract.MICROPHONES, contract.MICROPHONES + 2)
    arena.world.actions[1, contract.SPEAKER] = 1.0
    one = arena.observe()[0, columns].copy()
    arena.world.actions[2, contract.SPEAKER] = 1.0
    assert arena.observe()[0, columns] == pytest.approx(2.0 * one)
    put(arena, [(0.0, 0.0, 0.0), (0.22, 0.0, 0.0), (-0.22, 0.0, 0.0), (0.0, 1.3, 0.0)])
    assert arena.observe()[0, columns].tolist() == [1.0, 1.0]


def test_a_robot_with_microphones_that_are_off_senses_nothing() -> None:
    """They are off by default."""
    arena = new_arena(2)
    put(arena, [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0)])
    arena.world.actions[1, contract.SPEAKER] = 1.0
    assert not arena.observe()[0, contract.MICROPHONES : contract.MICROPHONES + 2].any()
