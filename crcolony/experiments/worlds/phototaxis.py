"""PGTA in the task for which it was made: phototaxis by four integer weights (Watson, Ficici and Pollack 2002).

Eight robots in a pen with a lamp in its middle. A robot senses only which of its two light sensors is the brighter
one; two wheels are driven by two linear neurons with this input and a bias. Whoever reaches the lamp gains energy and
is put somewhere else; time costs energy. Genes are broadcast, and accepted by those within reach, as in
`crcolony/evolution/pgta.py`.

The task, the robots' number and net, the range of the weights (-8 to 7) and the relocation are the original's. Sizes,
speeds, rewards and rates are ours, and robots do not collide.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray
from crcolony.evolution.pgta import accept_probability, one_gene, overwrite, send_probability

ROBOTS = 8
LOWEST_WEIGHT, HIGHEST_WEIGHT = -8, 7
HALF_PEN_M = np.array([1.0, 0.65])
"""From the lamp to the walls"""
LAMP_RADIUS_M = 0.15
WHEEL_SPEED_M_S = 0.2
"""At an output of 8 or more, in either direction"""
TRACK_M = 0.1
PERIOD_S = 0.1
RANGE_M = 0.5
"""Within which a broadcast is received"""
REWARD = 0.3
"""Energy for reaching the lamp; 1 is full"""
DECAY = 0.001
"""Energy that a step costs"""
SEND_RATE = 0.05
"""Broadcasts a step, with full energy"""
MUTATION_PROBABILITY = 0.2
"""That a weight is sent with 1 added or subtracted"""

HAND_DESIGNED = {
    "turning": np.array([-5.0, 7.0, 5.0, 2.0]),
    "pivoting": np.array([-7.0, 7.0, 7.0, 0.0]),
}
"""Controllers that people would write: the wheel on the brighter side turns slowly, or not at all"""


@dataclass
class Pen:
    """The robots of a pen: weights (robots, 4) of the left wheel's input and bias, then the right one's."""

    weights: FloatArray
    places_m: FloatArray
    """(robots, 2) from the lamp"""
    headings_rad: FloatArray
    energies: FloatArray
    """0 to 1"""


def new_pen(weights: FloatArray, rng: np.random.Generator) -> Pen:
    """Return robots at random places, without energy."""
    robots = len(weights)
    return Pen(
        weights.copy(),
        rng.uniform(-HALF_PEN_M, HALF_PEN_M, (robots, 2)),
        rng.uniform(-np.pi, np.pi, robots),
        np.zeros(robots),
    )


def random_weights(rng: np.random.Generator) -> FloatArray:
    """Return random integer weights (robots, 4)."""
    return rng.integers(LOWEST_WEIGHT, HIGHEST_WEIGHT + 1, (ROBOTS, 4)).astype(np.float64)


def is_left_brighter(pen: Pen) -> NDArray[np.bool_]:
    """Return which robots have the lamp on their left side, (robots,)."""
    along, across = np.cos(pen.headings_rad), np.sin(pen.headings_rad)
    left: NDArray[np.bool_] = across * pen.places_m[:, 0] > along * pen.places_m[:, 1]
    return left


def drive(pen: Pen, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Move all robots for a step; return which have reached the lamp, and have been put somewhere else."""
    inputs = np.stack([is_left_brighter(pen), np.ones(len(pen.weights))], axis=1)
    outputs = np.einsum("rwi,ri->rw", pen.weights.reshape(-1, 2, 2), inputs)
    left, right = WHEEL_SPEED_M_S * np.clip(outputs / -LOWEST_WEIGHT, -1.0, 1.0).T
    pen.headings_rad += (right - left) / TRACK_M * PERIOD_S
    step_m = 0.5 * (left + right) * PERIOD_S
    pen.places_m[:, 0] += step_m * np.cos(pen.headings_rad)
    pen.places_m[:, 1] += step_m * np.sin(pen.headings_rad)
    np.clip(pen.places_m, -HALF_PEN_M, HALF_PEN_M, out=pen.places_m)
    has_reached: NDArray[np.bool_] = (pen.places_m**2).sum(axis=1) < LAMP_RADIUS_M**2
    arrived = np.flatnonzero(has_reached)
    while arrived.size:
        pen.places_m[arrived] = rng.uniform(-HALF_PEN_M, HALF_PEN_M, (arrived.size, 2))
        pen.headings_rad[arrived] = rng.uniform(-np.pi, np.pi, arrived.size)
        arrived = arrived[(pen.places_m[arrived] ** 2).sum(axis=1) < LAMP_RADIUS_M**2]
    return has_reached


def spend_and_gain(pen: Pen, has_reached: NDArray[np.bool_]) -> None:
    """Change the energies by what a step costs, and by what the lamp gives."""
    np.clip(pen.energies + REWARD * has_reached - DECAY, 0.0, 1.0, out=pen.energies)


def mutated(weight: float, rng: np.random.Generator) -> float:
    """Return a weight as it is sent: now and then 1 more or less, within the range."""
    if rng.random() < MUTATION_PROBABILITY:
        weight += 1.0 if rng.random() < 0.5 else -1.0
    return min(max(weight, float(LOWEST_WEIGHT)), float(HIGHEST_WEIGHT))


def broadcast(pen: Pen, rng: np.random.Generator) -> None:
    """Let robots send a gene each, by their energy, and those within reach accept it, by what they lack."""
    draws = rng.random(len(pen.weights))
    odds = [SEND_RATE * send_probability(energy) for energy in pen.energies.tolist()]
    for sender in np.flatnonzero(draws < odds):
        locus = int(rng.integers(4))
        sent = one_gene(pen.weights[sender], locus)
        sent[locus] = mutated(float(sent[locus]), rng)
        distances_m = np.hypot(*(pen.places_m - pen.places_m[sender]).T)
        for receiver in np.flatnonzero(distances_m <= RANGE_M):
            is_receptive = rng.random() < accept_probability(float(pen.energies[receiver]))
            if receiver != sender and is_receptive:
                overwrite(pen.weights[receiver], sent)


def simulate(
    weights: FloatArray, has_transfer: bool, steps: int, rng: np.random.Generator
) -> IntArray:
    """Return how many robots have reached the lamp in every step, (steps,); with transfer weights evolve."""
    pen = new_pen(weights, rng)
    reached = np.zeros(steps, dtype=np.int64)
    for step in range(steps):
        has_reached = drive(pen, rng)
        reached[step] = np.count_nonzero(has_reached)
        spend_and_gain(pen, has_reached)
        if has_transfer:
            broadcast(pen, rng)
    return reached
