"""All there is of a simulated world, as arrays whose first axis is the robot or the pack."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from crcolony.compiled import FloatArray, IntArray
from crcolony.world.neighbours import Cells
from crcolony.world.physics import Physics


class Rules(NamedTuple):
    """The settings of the arena and of the bodies in it, as compiled code reads them."""

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
    """Cosine of half the camera's angle of view"""
    occlusion: bool
    infrared: bool
    ir_range_m: float
    proximity_range_m: float
    inertial: bool
    microphones: bool
    hearing_range_m: float
    jaw_reach_m: float
    jaw_cosine: float
    """Cosine of the largest bearing at which a jaw latches"""
    encounter_range_m: float
    encounter_cosine: float
    """Cosine of the largest bearing of an encounter"""
    battery_drain: float
    """Of the body's own battery, in a control period"""
    is_noisy: bool
    """Whether any deviation of the noise is above 0"""


class World(NamedTuple):
    """What changes from tick to tick, and what it depends on. N slots for robots, P packs."""

    colonies: IntArray
    """(N,) number of the colony that the body in this slot belongs to; -1: no body"""
    poses: FloatArray
    """(N, 3) x and y (m) from the middle of the arena, heading (rad)"""
    headings: FloatArray
    """(N, 2) cosine and sine of the heading"""
    velocities: FloatArray
    """(N, 3) m/s, m/s, rad/s"""
    last_speeds: FloatArray
    """(N,) forward speed (m/s) a control period ago, which the accelerometer compares with"""
    wheel_speeds: FloatArray
    """(N, 2) left and right (m/s) in the last control period"""
    actions: FloatArray
    """(N, ACTION_WIDTH) in force now"""
    pending: FloatArray
    """(action latency + 1, N, ACTION_WIDTH) actions that were set, newest first"""
    ttl_left_s: FloatArray
    """(N,) time to live left of the action that was set last"""
    packs: FloatArray
    """(P, 2) x, y (m)"""
    pack_colours: FloatArray
    """(P, 3) red, green, blue, from 0 to 1"""
    pack_charges: FloatArray
    """(P,) energy left"""
    pack_holders: IntArray
    """(P,) the robot whose jaw holds it, or -1"""
    holding: IntArray
    """(N,) the pack in the jaw, or -1"""
    charges: FloatArray
    """(N,) energy taken from a pack in the last control period"""
    batteries: FloatArray
    """(N,) level of the body's own battery, from 0 to 1"""
    partners: IntArray
    """(N,) slot of the robot encountered in this tick, or -1"""
    nonces: FloatArray
    """(N,) random number that both sides of the encounter observe"""
    observations: FloatArray
    """(observation latency + 1, N, OBSERVATION_WIDTH) newest first; robots observe the last"""
    stream: NDArray[np.uint64]
    """(2,) state of the arena's random number generator"""
    walls: FloatArray
    """(W, 4) inner walls: from x, y to x, y (m)"""
    pillars: FloatArray
    """(K, 3) x, y, radius (m)"""
    noise: FloatArray
    """(OBSERVATION_WIDTH,) standard deviation of the noise of every column"""
    near_bodies: FloatArray
    """scratch (bodies, 6): bodies near one robot, rows as of `collect_near`, with two columns that
    the camera uses"""
    close_bodies: FloatArray
    """scratch (bodies, 2): bodies close to one robot: distance ahead and to the left (m)"""
    near_packs: FloatArray
    """scratch (packs, 4): packs near one robot, rows as of `collect_near`"""
    contacts: FloatArray
    """scratch (pairs, 3): pairs that could have an encounter: squared distance (m^2) and both
    slots"""
    nearest: IntArray
    """scratch (N,): index of every robot's nearest contact"""
    robot_cells: Cells
    """The bodies by the cell in which they are"""
    pack_cells: Cells
    """The packs by the cell in which they are"""
    physics: Physics
    """The rigid bodies of Chipmunk"""
    rules: Rules
    """The settings"""


SAVED = (
    "poses",
    "headings",
    "velocities",
    "last_speeds",
    "wheel_speeds",
    "actions",
    "pending",
    "ttl_left_s",
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
"""The fields that are saved; the others follow from the settings."""

FORMER_NAMES = {
    "speeds": "last_speeds",
    "wheels": "wheel_speeds",
    "left_s": "ttl_left_s",
}
"""Names under which earlier versions saved a field, and its name now: checkpoints of theirs stay
readable."""


def with_present_names(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return saved fields under their present names."""
    return {FORMER_NAMES.get(name, name): value for name, value in arrays.items()}
