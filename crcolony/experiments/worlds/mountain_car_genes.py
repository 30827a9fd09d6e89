"""The genes of a learner of the mountain car: a potential over its states, and meta-parameters (thesis 3.2, 3.3).

All numbers are ours: those of Paper IV are not known. The potential is a normalised RBF network on an even grid, with a
weight for each centre, in steps: as rewards are -1 a step, that is also the unit of values. What is drawn of it at
first is as large as the values that it competes with, and has no tendency. Temperatures fade hyperbolically over
episodes, tau_t = tau / (1 + tau_decay t). A smaller gamma is left out: potentials are not bounded to be positive, and
with it learners idle for their whole lives (see `learning/shaping.py`).
"""

from functools import cache

import numpy as np

from crcolony.evolution.genotype import Gene, Normal, Schema, Uniform
from crcolony.experiments.worlds.mountain_car import GOAL_POSITION, LARGEST_SPEED, LOWEST_POSITION

CENTRES = (6, 6)
"""Centres of the potential along position and velocity."""
WEIGHTS = CENTRES[0] * CENTRES[1]
ALPHA, GAMMA, LAMBDA, TAU, TAU_DECAY = range(5)
"""Indices of the first genes."""
POTENTIAL = 5
"""Index of the first weight of the potential, which follow them."""
META_PARAMETERS = {
    "alpha": (0.0, 2.0),
    "gamma": (0.98, 1.0),
    "lambda": (0.0, 1.0),
    "tau": (0.0, 5.0),
    "tau_decay": (0.0, 1.0),
}
"""Their ranges, from which they are drawn evenly at first. A mutation has a tenth of a range as its deviation."""
LARGEST_POTENTIAL = 300.0
POTENTIAL_SD = 30.0
POTENTIAL_MUTATION_SD = 15.0
LOW = np.array([LOWEST_POSITION, -LARGEST_SPEED])
HIGH = np.array([GOAL_POSITION, LARGEST_SPEED])
"""Corners of the box of states that the potential and the tilings cover."""


@cache
def car_schema(shaping: bool) -> Schema:
    """Return the genes; without shaping those of the potential are there, and stay 0."""
    weights = [
        Gene(
            f"potential.{k}",
            -LARGEST_POTENTIAL,
            LARGEST_POTENTIAL,
            Normal(0.0, POTENTIAL_SD * shaping),
            POTENTIAL_MUTATION_SD * shaping,
        )
        for k in range(WEIGHTS)
    ]
    meta = [
        Gene(name, low, high, Uniform(low, high), 0.1 * (high - low))
        for name, (low, high) in META_PARAMETERS.items()
    ]
    return Schema((*meta, *weights))
