"""OMPAC on the mountain car (Elfwing, Uchibe and Doya 2017, arXiv 1702.07490): instances that learn compete.

Every instance learns in one life that goes on. After a fixed number of episodes they are selected by their performance,
with all they have learnt, and noise is added to their meta-parameters (`crcolony/evolution/ompac.py`). What is ours:
performance is by how many steps an instance is better than the worst, since returns are negative; and instances begin
with meta-parameters that are drawn from their whole ranges, as founders of `CarEvolution` are, where the paper has
small differences.
"""

import numpy as np

from crcolony.evolution.ompac import Ompac
from crcolony.experiments.worlds.mountain_car_evolution import CarSettings, Generation, mutate
from crcolony.experiments.worlds.mountain_car_genes import car_schema
from crcolony.experiments.worlds.mountain_car_lives import learn, new_driver
from crcolony.randomness import Stream


class CarCompetition:
    """A run of OMPAC: each `advance` is some episodes of every instance, and a competition.

    A generation of the settings is the time from one competition to the next. `rng` draws meta-parameters, selection
    and noise, `stream` is for all within episodes.
    """

    def __init__(self, settings: CarSettings, rng: np.random.Generator, stream: Stream) -> None:
        schema = car_schema(shaping=False)
        self._settings = settings
        self._rng, self._stream = rng, stream
        self._drivers = [new_driver() for _ in range(settings.individuals)]
        self._competition = Ompac(
            lambda genes, noise: mutate(schema, genes, noise), settings.individuals
        )
        self.genotypes = np.stack([schema.random(rng) for _ in self._drivers])
        """Meta-parameters (instances, genes) with which they go on"""
        self._episode = 0

    def advance(self) -> Generation:
        """Let all instances go on learning and then compete; return what was before the competition."""
        steps = np.zeros((self._settings.individuals, self._settings.episodes), dtype=np.int64)
        for driver, genes, own in zip(self._drivers, self.genotypes, steps, strict=True):
            learn(driver, genes, self._episode, self._stream, own)
        lived = Generation(self.genotypes, steps, self._episode)
        self._episode += self._settings.episodes
        learnt_from, self.genotypes = self._competition.compete(
            lived.genotypes, lived.mean_steps.max() - lived.mean_steps, self._rng
        )
        weights = np.stack([driver.learner.weights for driver in self._drivers])
        for driver, taken_over in zip(self._drivers, weights[learnt_from], strict=True):
            driver.learner.weights[:] = taken_over
        return lived
