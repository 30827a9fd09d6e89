"""Worlds are sampled around the centre of their range."""

from dataclasses import astuple, fields

import numpy as np

from crcolony.experiments.colonies.foraging_lives import foraging_config
from crcolony.experiments.colonies.pseudo_realities import (
    CENTRE,
    EDGE,
    PseudoReality,
    sample_pseudo_reality,
)

BASE = foraging_config(2, True)


def numbers_of(world: PseudoReality) -> list[float]:
    *others, pillars = astuple(world)
    return [*np.hstack(others).tolist(), len(pillars)]


def test_worlds_are_even_on_either_side_of_the_centre() -> None:
    """In each of their numbers, pillars and delays counted; and the same for the same seed."""
    rng = np.random.default_rng(3)
    worlds = np.array([numbers_of(sample_pseudo_reality(rng)) for _ in range(400)])
    centre = np.array(numbers_of(CENTRE))
    assert worlds.shape[1] == len(fields(PseudoReality)) + 1
    error = worlds.std(axis=0) / 20.0
    assert np.all(worlds.std(axis=0) > 0.0)
    assert np.all(np.abs(worlds.mean(axis=0) - centre) < 4.0 * error)
    again = sample_pseudo_reality(np.random.default_rng(3))
    assert numbers_of(again) == worlds[0].tolist()


def test_every_world_has_room_for_a_robot_that_passes_each_pillar() -> None:
    """Between it and the walls; settings are checked as they are made."""
    rng = np.random.default_rng(4)
    for world in [CENTRE, EDGE, *(sample_pseudo_reality(rng) for _ in range(50))]:
        config = world.config_of(BASE)
        half = 0.5 * np.array([world.width_m, world.height_m])
        for x, y, radius_m in config.arena.pillars:
            gap_m = half - np.abs([x, y]) - radius_m
            assert np.all(gap_m > 2.0 * config.body.radius_m)


def test_the_edge_is_exact_and_prompt() -> None:
    """It is the arena in which foraging-transfer evolves, whose settings all worlds but for their own have."""
    edge, centre = EDGE.config_of(BASE), CENTRE.config_of(BASE)
    assert edge.body == BASE.body
    assert edge.arena.pillars == ()
    assert (edge.life, centre.life, centre.learning) == (BASE.life, BASE.life, BASE.learning)
    assert centre.body.action_latency_steps == 1
    assert centre.body.noise.distance_m == CENTRE.distance_noise_m > 0.0
