"""Learners of the mountain car evolve, and the same seed gives the same run."""

import numpy as np

from crcolony.experiments.worlds.mountain_car_evolution import (
    CarEvolution,
    CarSettings,
    Generation,
    live_often,
)
from crcolony.experiments.worlds.mountain_car_genes import TAU, TAU_DECAY, car_schema
from crcolony.experiments.worlds.mountain_car_lives import new_driver
from crcolony.randomness import new_streams


def evolution(seed: int) -> CarEvolution:
    """Return a small run."""
    settings = CarSettings(individuals=12, generations=12, episodes=3)
    stream, rng = new_streams(seed, (1,), 1)[0], np.random.default_rng(seed)
    return CarEvolution(settings, True, new_driver(), rng, stream)


def test_the_same_seed_gives_the_same_run() -> None:
    """In new arrays, with every gene and every step."""
    one, other = evolution(3), evolution(3)
    for _ in range(3):
        first, second = one.advance(), other.advance()
        assert first.genotypes.tolist() == second.genotypes.tolist()
        assert first.steps.tolist() == second.steps.tolist()


def test_learning_becomes_faster() -> None:
    """After a dozen generations the median life has far fewer steps."""
    run = evolution(1)
    generations = [run.advance() for _ in range(12)]
    first, last = (float(np.median(one.mean_steps)) for one in (generations[0], generations[-1]))
    assert last < 0.7 * first


def test_the_best_is_chosen_by_further_lives() -> None:
    """It is one of the last generation, and its mean steps are those of the lives that it was chosen by."""
    run = evolution(2)
    last = run.advance()
    genes, steps = run.choose_best(last)
    assert genes.tolist() in last.genotypes.tolist()
    again = live_often(new_driver(), genes, 20, 3, new_streams(9, (1,), 1)[0])
    assert 0.5 * steps < again.mean() < 2.0 * steps


def test_a_temperature_is_the_mean_of_a_life() -> None:
    """tau / (1 + decay t) over its episodes."""
    genotypes = np.zeros((2, len(car_schema(False))))
    genotypes[1, [TAU, TAU_DECAY]] = 3.0, 1.0
    lived = Generation(genotypes, np.ones((2, 3), dtype=np.int64))
    assert lived.temperatures.tolist() == [0.0, (3.0 + 1.5 + 1.0) / 3.0]
