"""All there is of a world, as arrays whose first axis is the robot or the pack: saved, restored, compiled over."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray
from crcolony.world.neighbours import Cells
from crcolony.world.physics import Physics


class Rules(NamedTuple):
    """The settings of `settings.Arena` and `settings.CyberRodent` as compiled code reads them."""

    width_m: float
    height_m: float
    period_s: float
    physics_steps: int
    wall_turn_rad: float
    pack_charge: float
    pack_charge_per_step: float
    pack_wall_margin_m: float
    pack_clearance_m: float
    radius_m: float
    track_m: float
    camera: bool
    camera_range_m: float
    camera_cosine: float
    occlusion: bool
    infrared: bool
    ir_range_m: float
    proximity_range_m: float
    inertial: bool
    microphones: bool
    hearing_range_m: float
    jaw_reach_m: float
    jaw_cosine: float
    encounter_range_m: float
    encounter_cosine: float
    battery_drain: float
    noisy: bool


class World(NamedTuple):
    """What changes from tick to tick, and what it is made of. N robots, P packs."""

    colonies: IntArray
    """(N,) which colony the body in this place belongs to; -1: no body there"""
    poses: FloatArray
    """(N, 3) x and y (m) from the middle of the arena, heading (rad)"""
    headings: FloatArray
    """(N, 2) cosine and sine of the heading"""
    velocities: FloatArray
    """(N, 3) m/s, m/s, rad/s"""
    speeds: FloatArray
    """(N,) forward speed (m/s) a control period ago, as the accelerometer remembers it"""
    wheels: FloatArray
    """(N, 2) left and right, m/s, as they turned in the last control period"""
    actions: FloatArray
    """(N, ACTION_WIDTH) in force now"""
    pending: FloatArray
    """(action latency + 1, N, ACTION_WIDTH) commanded, newest first"""
    left_s: FloatArray
    """(N,) time to live left of the last command"""
    packs: FloatArray
    """(P, 2) x, y (m)"""
    pack_colours: FloatArray
    """(P, 3) red, green, blue"""
    pack_charges: FloatArray
    """(P,) energy left"""
    pack_holders: IntArray
    """(P,) the robot whose jaw holds it, or -1"""
    holding: IntArray
    """(N,) the pack in the jaw, or -1"""
    charges: FloatArray
    """(N,) energy taken over in the last control period"""
    batteries: FloatArray
    """(N,) level of the body's own battery"""
    partners: IntArray
    """(N,) who was encountered in this tick, or -1"""
    nonces: FloatArray
    """(N,) what both sides of the encounter were told"""
    observations: FloatArray
    """(observation latency + 1, N, OBSERVATION_WIDTH) newest first; the last is what robots get"""
    stream: NDArray[np.uint64]
    """(2,) the arena's own randomness"""
    walls: FloatArray
    """(W, 4) inner walls: from x, y to x, y"""
    pillars: FloatArray
    """(K, 3) x, y, radius"""
    noise: FloatArray
    """(OBSERVATION_WIDTH,) standard deviation added to every column"""
    near: FloatArray
    """scratch: bodies within sight of one robot"""
    blobs: FloatArray
    """scratch: packs within sight of one robot"""
    contacts: FloatArray
    """scratch: pairs that could make contact"""
    nearest: IntArray
    """scratch: every robot's nearest contact"""
    robot_cells: Cells
    pack_cells: Cells
    physics: Physics
    rules: Rules


SAVED = (
    "poses",
    "headings",
    "velocities",
    "speeds",
    "wheels",
    "actions",
    "pending",
    "left_s",
    "packs",
    "pack_charges",
    "pack_holders",
    "holding",
    "charges",
    "batteries",
    "partners",
    "nonces",
    "observations",
    "stream",
    "colonies",
)
"""The fields that a saved world needs; the rest follows from its settings."""
