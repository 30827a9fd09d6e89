"""All there is of the robots, as arrays whose first axis is the robot.

N robots (1 in a robot process), A agents each, G genes, M modules, T tiles, K actions, L tilings.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray, RowArray


class StepParameters(NamedTuple):
    """What is the same in all robots and never changes: settings and modules as compiled code reads
    them."""

    targets: IntArray
    """(M,) observation column of the blob that each module watches"""
    successes: IntArray
    """(M,) observation column that is above 0 when the module has succeeded"""
    beacons: FloatArray
    """(M,) 1 where the module switches the IR beacon on"""
    refractory_steps: IntArray
    """(M,) length of the refractory time after a success, in control steps"""
    jaws: FloatArray
    """(M,) 1 where the module closes the jaw"""
    regarded_colours: FloatArray
    """(M, 3) 1 for each of red, green and blue of which a target has to show one, or 0 for all: it
    may be dark"""
    lamps: FloatArray
    """(M, 3) colour on the robot's face: red, green, blue"""
    wheel_speeds: FloatArray
    """(K, 2) left and right wheel speed of every action (m/s)"""
    low: FloatArray
    """(2,) lowest distance (m) and bearing (rad) that the tilings cover"""
    tiles_per_unit: FloatArray
    """(2,) tiles a metre of distance and a radian of bearing"""
    tile_counts: IntArray
    """(2,) tiles along distance and bearing"""
    tile_offsets: FloatArray
    """(L, 2) displacement of every tiling, in tiles"""
    grid_tiles: int
    """Tiles of all tilings over distance and bearing; two a tiling follow them, for a target out of
    sight"""
    potential_distances_m: FloatArray
    """Centres of the potential along the distance"""
    potential_distance_width_m: float
    """Width of its basis functions along the distance"""
    potential_bearings_rad: FloatArray
    """Centres of the potential along the absolute bearing"""
    potential_bearing_width_rad: float
    """Width of its basis functions along the bearing"""
    selector_genes: int
    """Genes of the selector, which come first in a genotype"""
    module_genes: int
    """Genes of every module, which follow module by module"""
    initial_weight: float
    """Weight of every tile in an agent that has learnt nothing"""
    energy_per_step: float
    """Energy that a control step costs"""
    slice_steps: int
    """Control steps in a slice of time sharing"""
    action_ttl_s: float
    """Time to live of every action"""


class Robots(NamedTuple):
    """What changes from step to step."""

    steps: IntArray
    """(N,) control steps since the robot's first start"""
    agent: IntArray
    """(N,) index of the virtual agent in control"""
    slice_steps_left: IntArray
    """(N,) control steps left in its slice"""
    module: IntArray
    """(N,) index of the learning module in control; -1: none yet"""
    action: IntArray
    """(N,) index of the last action"""
    state_tiles: IntArray
    """(N, L) active tiles of the state in which the last action was selected"""
    potential: FloatArray
    """(N,) potential of that state"""
    sides: IntArray
    """(N, M) the side on which each module's target was seen last; 0: left, 1: right"""
    refractory_left: IntArray
    """(N, M) control steps left of the refractory time"""
    events: IntArray
    """(N,) events of the last step, as a sum of event bits"""
    streams: NDArray[np.uint64]
    """(N, 2) state of each robot's random number generator"""
    genotypes: FloatArray
    """(N, A, G)"""
    energies: FloatArray
    """(N, A) from 0 (dead) to 1"""
    module_steps: IntArray
    """(N, A, M) control steps that each module has been in control"""
    captures: IntArray
    """(N, A) packs captured"""
    matings: IntArray
    """(N, A) encounters that led to a mating"""
    mating_energy_sum: FloatArray
    """(N, A) sum of the agent's energy at its matings: the offspring that it can expect, where
    conception has the probability of the energy"""
    steps_alive: IntArray
    """(N, A) control steps that the agent was alive and in control"""
    energy_sum: FloatArray
    """(N, A) sum of the agent's energy over these steps"""
    weights: NDArray[np.float32]
    """(at least N * A * M * T, K) what the agents have learnt: Theta of Algorithm 2.2; see
    `weight_rows.py`"""
    weight_rows: RowArray
    """(N, A, M, T) the row of each tile among the robot's own; -1: it was never visited"""
    rows_used: IntArray
    """(N,) rows that tiles of the robot have"""
    weight_blocks: IntArray
    """(N, blocks) where in `weights` each block of the robot's own rows begins"""
    free_blocks: IntArray
    """(blocks of all robots,) where blocks begin that no robot has; the next to be taken is the last"""
    free_count: IntArray
    """(1,) how many these are"""
    traces: FloatArray
    """(N, T, 4) see `learning/traces.py`; cleared when module or agent change, so that one table
    serves all"""
    traced_tiles: IntArray
    """(N, T) see `learning/traces.py`: the tiles that have a trace"""
    trace_totals: FloatArray
    """(N, 3) `totals` of `learning/traces.py`"""
    values: FloatArray
    """scratch (K,): action values of the present state"""
    scratch_softmax: FloatArray
    """scratch (K,)"""
    next_tiles: IntArray
    """scratch (L,): active tiles of the present state"""
    next_rows: IntArray
    """scratch (L,): the rows of `weights` that they have"""
    state_rows: IntArray
    """scratch (L,): those that the active tiles of the last state have"""
    scratch_state: FloatArray
    """scratch (2,): distance and bearing of a target"""
    scratch_distance: FloatArray
    """scratch: responses of the potential along the distance"""
    scratch_bearing: FloatArray
    """scratch: responses of the potential along the bearing"""
    visible: FloatArray
    """scratch (N, M): 1 where the target of each module is visible"""


SCRATCH = (
    "values",
    "scratch_softmax",
    "next_tiles",
    "next_rows",
    "state_rows",
    "scratch_state",
    "scratch_distance",
    "scratch_bearing",
    "visible",
)
"""Fields that carry nothing from one step to the next, and are not saved."""

FORMER_NAMES = {
    "left": "slice_steps_left",
    "tiles": "state_tiles",
    "rest": "refractory_left",
    "used": "module_steps",
    "lived": "steps_alive",
    "felt": "energy_sum",
    "live": "traced_tiles",
    "clock": "trace_totals",
}
"""Names under which earlier versions saved a field, and its name now: snapshots of theirs stay
readable."""

ADDED = ("mating_energy_sum",)
"""Fields that earlier versions did not save; they begin at 0."""


def with_present_names(arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Return saved fields under their present names."""
    return {FORMER_NAMES.get(name, name): value for name, value in arrays.items()}


DIED = 1
"""Event bit: the agent in control has starved."""
MET = 2
"""Event bit: the robot had an encounter."""
SLICE_OVER = 4
"""Event bit: the slice of the agent in control is over."""
