"""Floreano and Mondada's evolution of navigation: fitness of eq. 4.2, a recurrent perceptron, and Algorithm 4.1.

The perceptron has two sigmoid outputs, the wheels' speeds, which read the sensors, a bias and what both outputs were
before. The thesis gives 100 individuals and eq. 4.2; selection, variation and the length of a life are ours.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from crcolony.compiled import FloatArray, compiled
from crcolony.evolution.genetic_algorithm import next_generation
from crcolony.evolution.genotype import Gene, Schema, Uniform
from crcolony.evolution.selection import tournament
from crcolony.evolution.variation import gaussian_mutation, one_point_crossover
from crcolony.experiments.worlds.looping_maze import (
    SENSORS,
    Body,
    Situation,
    angle_around,
    move,
    new_situation,
    start,
)
from crcolony.randomness import Stream

INDIVIDUALS = 100
LIFE_ACTIONS = 80
"""Sensorimotor loops of a life: 24 s, in which a lap can just be driven at full speed"""
CROSSOVER_PROBABILITY = 0.1
MUTATION_PROBABILITY = 0.1
"""Of a gene"""
TOURNAMENT = 3
"""Individuals, of which the fittest is selected"""
FIRST_WEIGHTS = 2.0
"""The weights of the first generation are within plus and minus this"""
_WHEELS = 2
INPUTS = SENSORS + 1 + _WHEELS
"""Of each wheel: the sensors, a bias of 1, and the former outputs"""
_MUTATION_SD = 1.0
FITNESS, SPEED, TOUCHED, TURNED = range(4)
"""What is measured of a life: see `Life`"""
MEASURED = 4


class Navigator(NamedTuple):
    """The arrays that a life needs; one life after another lives in them."""

    situation: Situation
    outputs: FloatArray
    """(2,) of the sigmoids, 0 to 1: full speed backwards to full speed ahead"""


@dataclass(frozen=True)
class Life:
    """What came of a life, per sensorimotor loop."""

    fitness: float
    """Mean of eq. 4.2"""
    speed: float
    """Mean of both wheels, -1 to 1; above 0 is ahead"""
    touched: float
    """Share of the loops in which there was a wall in the way"""
    laps: float
    """Of the whole life, in either direction"""


def perceptron_schema(first_weights: float) -> Schema:
    """Return the genes of a perceptron: its weights, which begin within plus and minus this."""
    initial = Uniform(-first_weights, first_weights)
    return Schema(
        tuple(
            Gene(f"{wheel}.{k}", initial=initial, mutation_sd=_MUTATION_SD)
            for wheel in ("left", "right")
            for k in range(INPUTS)
        )
    )


def new_navigator() -> Navigator:
    """Return the arrays for lives."""
    return Navigator(new_situation(), np.zeros(_WHEELS))


@compiled
def navigation_fitness(left: float, right: float, highest_sense: float) -> float:
    """Return the fitness of a sensorimotor loop at wheel speeds from -1 to 1 (eq. 4.2).

    V is of the speeds whatever their signs: to drive backwards is as good.
    """
    speed = 0.5 * (abs(left) + abs(right))
    return speed * (1.0 - math.sqrt(0.5 * abs(left - right))) * (1.0 - highest_sense)


@compiled
def respond(genes: FloatArray, senses: FloatArray, outputs: FloatArray) -> None:
    """Write the next outputs (2,), by the weights in the genes (2 * INPUTS,)."""
    former_left, former_right = outputs[0], outputs[1]
    for wheel in range(2):
        first = wheel * INPUTS
        total = genes[first + SENSORS]
        total += genes[first + SENSORS + 1] * former_left
        total += genes[first + SENSORS + 2] * former_right
        for k in range(SENSORS):
            total += genes[first + k] * senses[k]
        outputs[wheel] = 1.0 / (1.0 + math.exp(-total))


@compiled
def live(
    navigator: Navigator,
    body: Body,
    genes: FloatArray,
    actions: int,
    stream: Stream,
    found: FloatArray,
) -> None:
    """Drive for so many sensorimotor loops; write what is measured, (MEASURED,)."""
    situation, outputs = navigator
    start(body, situation, stream)
    outputs[0] = 0.5
    outputs[1] = 0.5
    for k in range(MEASURED):
        found[k] = 0.0
    angle = angle_around(body, situation.pose)
    for _ in range(actions):
        respond(genes, situation.senses, outputs)
        left, right = 2.0 * outputs[0] - 1.0, 2.0 * outputs[1] - 1.0
        has_touched = move(body, situation, left, right, stream)
        highest = 0.0
        for k in range(SENSORS):
            highest = max(highest, situation.senses[k])
        found[FITNESS] += navigation_fitness(left, right, highest) / actions
        found[SPEED] += 0.5 * (left + right) / actions
        found[TOUCHED] += (1.0 if has_touched else 0.0) / actions
        following = angle_around(body, situation.pose)
        change = following - angle
        found[TURNED] += change - 2.0 * math.pi * math.floor(change / (2.0 * math.pi) + 0.5)
        angle = following


@compiled
def live_all(
    navigator: Navigator,
    body: Body,
    genotypes: FloatArray,
    actions: int,
    stream: Stream,
    found: FloatArray,
) -> None:
    """Let each genotype (N, genes) live once; write what is measured of each, (N, MEASURED)."""
    for row in range(genotypes.shape[0]):
        live(navigator, body, genotypes[row], actions, stream, found[row])


def live_often(
    body: Body, genes: FloatArray, lives: int, actions: int, stream: Stream
) -> list[Life]:
    """Return what came of so many lives of one genotype."""
    found = np.zeros((lives, MEASURED))
    live_all(new_navigator(), body, np.tile(genes, (lives, 1)), actions, stream, found)
    return [
        Life(fitness, speed, touched, abs(turned) / (2.0 * math.pi))
        for fitness, speed, touched, turned in found.tolist()
    ]


class Navigation:
    """An evolutionary run: `evaluate` lets the present generation live, `breed` makes the next one.

    `rng` draws founders, selection and variation, `stream` is for all within lives.
    """

    def __init__(
        self, rng: np.random.Generator, stream: Stream, first_weights: float = FIRST_WEIGHTS
    ) -> None:
        self._schema = perceptron_schema(first_weights)
        self._rng, self._stream = rng, stream
        self._navigator = new_navigator()
        self.genotypes = np.stack([self._schema.random(rng) for _ in range(INDIVIDUALS)])

    def evaluate(self, body: Body) -> FloatArray:
        """Let each individual live once in a body; return their fitness (individuals,)."""
        found = np.zeros((len(self.genotypes), MEASURED))
        live_all(self._navigator, body, self.genotypes, LIFE_ACTIONS, self._stream, found)
        return found[:, FITNESS]

    def breed(self, fitness: FloatArray) -> None:
        """Make the next generation of the present one, by its fitness (individuals,)."""
        self.genotypes = next_generation(
            self.genotypes,
            fitness,
            lambda fitness, count, rng: tournament(fitness, count, TOURNAMENT, rng),
            one_point_crossover,
            CROSSOVER_PROBABILITY,
            lambda genes, rng: gaussian_mutation(genes, self._schema, MUTATION_PROBABILITY, rng),
            self._rng,
        )
