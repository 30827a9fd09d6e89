"""All there is of the robots, as arrays whose first axis is the robot: a robot process has one row, a colony N.

N robots, A agents in each, G genes, M modules, T tiles, K actions, L tilings.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray


class StepParameters(NamedTuple):
    """What is the same in all robots and never changes: settings and modules as compiled code reads them."""

    targets: IntArray
    """(M,) observation column of the watched blob"""
    successes: IntArray
    """(M,) observation column that tells success"""
    beacons: FloatArray
    """(M,) 1 where the module switches the IR beacon on"""
    refractory_steps: IntArray
    """(M,) refractory steps after a success"""
    lamps: FloatArray
    """(M, 3) face colour"""
    wheels: FloatArray
    """(K, 2) left and right wheel speed of every action (m/s)"""
    low: FloatArray
    """(2,) lowest distance (m) and bearing (rad)"""
    high: FloatArray
    tiles: IntArray
    """(2,) tiles along distance and bearing"""
    offsets: FloatArray
    """(L, 2) displacement of every tiling, in tiles"""
    grid_tiles: int
    """Tiles of all tilings over distance and bearing; two a tiling follow, for a target out of sight"""
    distances: FloatArray
    """Centres of the potential along distance (m)"""
    distance_width_m: float
    bearings: FloatArray
    """Centres of the potential along the bearing's size (rad)"""
    bearing_width_rad: float
    selector_genes: int
    """Where the first module's genes begin"""
    module_genes: int
    initial_weight: float
    energy_per_step: float
    slice_steps: int
    action_ttl_s: float


class Robots(NamedTuple):
    """What changes from step to step."""

    steps: IntArray
    """(N,) control steps lived since the beginning"""
    agent: IntArray
    """(N,) the virtual agent in control"""
    slice_steps_left: IntArray
    """(N,) control steps left in its slice"""
    module: IntArray
    """(N,) the learning module in control, -1 for none yet"""
    action: IntArray
    """(N,) the action taken last"""
    tiles: IntArray
    """(N, L) active tiles of the state it was taken in"""
    potential: FloatArray
    """(N,) potential of that state"""
    sides: IntArray
    """(N, M) where each module's target was seen last: 0 left, 1 right"""
    refractory_left: IntArray
    """(N, M) refractory steps left"""
    events: IntArray
    """(N,) what happened in the last step, as a sum of event bits"""
    streams: NDArray[np.uint64]
    """(N, 2) each robot's randomness"""
    genotypes: FloatArray
    """(N, A, G)"""
    energies: FloatArray
    """(N, A) 0 is dead"""
    used: IntArray
    """(N, A, M) steps each module has been in control"""
    captures: IntArray
    """(N, A) packs captured"""
    matings: IntArray
    """(N, A) encounters that led to a mating"""
    steps_alive: IntArray
    """(N, A) control steps lived"""
    energy_sum: FloatArray
    """(N, A) sum of the energy over them"""
    weights: FloatArray
    """(N, A, M, T, K) what the agents have learnt: Theta of Algorithm 2.2"""
    traces: FloatArray
    """(N, T, 3) see `learning.traces`; they end when module or agent change, so one table serves all"""
    active_tiles: IntArray
    """(N, T)"""
    clock: FloatArray
    """(N, 3)"""
    values: FloatArray
    """scratch (K,)"""
    chances: FloatArray
    """scratch (K,)"""
    next_tiles: IntArray
    """scratch (L,)"""
    scratch_state: FloatArray
    """scratch (2,)"""
    scratch_distance: FloatArray
    """scratch"""
    scratch_bearing: FloatArray
    """scratch"""
    visible: FloatArray
    """scratch (M,)"""


SCRATCH = (
    "values",
    "chances",
    "next_tiles",
    "scratch_state",
    "scratch_distance",
    "scratch_bearing",
    "visible",
)
"""Fields that carry nothing from one step to the next."""

DIED, MET, SLICE_OVER = 1, 2, 4
"""Event bits: the agent starved; it had an encounter; its slice is over."""
