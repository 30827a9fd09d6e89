"""Two robots alone in an arena, which are to face each other within infrared range: to mate (Paper I).

The physics and senses are those of the colony. A robot sees the other's face or tail lamp, or nothing; its state is
which of them, at what distance and bearing. When both face each other it is the end of the episode, and both are
rewarded with 1. There is nothing else: no energy, no packs.
"""

import itertools
import math

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import CyberRodent
from crcolony.compiled import FloatArray
from crcolony.robot.settings import Learning
from crcolony.world.arena import Arena
from crcolony.world.settings import ArenaSettings

NOTHING, TAIL, FACE = 0.5, 1.5, 2.5
"""The first number of a state: what is seen of the other robot."""
KINDS = 3
LOW = np.array([0.0, 0.0, -CyberRodent().camera_half_angle_rad])
"""Of the states: what is seen, its distance (m), its bearing (rad)"""
HIGH = np.array([float(KINDS), CyberRodent().camera_range_m, CyberRodent().camera_half_angle_rad])
EPISODE_STEPS = 200
"""An episode in which they have not mated ends after so many steps: 40 s."""
_APART_M = 0.7
"""At the start they are at least so far apart: out of the range of an encounter."""


def primitive_actions() -> FloatArray:
    """Return wheel speeds (actions, 2) in m/s: the actions of the default colony."""
    learning, half_track_m = Learning(), 0.5 * CyberRodent().track_m
    pairs = itertools.product(learning.speeds_m_s, learning.turns_rad_s)
    return np.array(
        [(speed - turn * half_track_m, speed + turn * half_track_m) for speed, turn in pairs]
    )


class MatingPair:
    """The two robots. `start` an episode, then `step` until it is over; both have a state (3,) and an action."""

    def __init__(self, seed: int, rng: np.random.Generator) -> None:
        """The arena's own randomness is of `seed`, places at the start are of `rng`."""
        self._arena = Arena(2, ArenaSettings(packs_per_robot=0.0), CyberRodent(), seed)
        self._rng = rng
        self._wheels = primitive_actions()
        self._action = np.zeros((2, contract.ACTION_WIDTH))
        self._action[:, contract.BEACON] = 1.0
        self._action[:, contract.LED] = 1.0
        self._action[:, contract.TTL] = Learning().action_ttl_s
        self.steps = 0
        """Of this episode"""

    @property
    def actions(self) -> int:
        """The number of primitive actions."""
        return len(self._wheels)

    def start(self) -> FloatArray:
        """Place both at random, apart from each other; return their states (2, 3)."""
        world = self._arena.world
        half_m = 0.5 * world.rules.width_m - world.rules.radius_m - 0.01
        places = self._rng.uniform(-half_m, half_m, (2, 2))
        while math.dist(*places) < _APART_M:
            places = self._rng.uniform(-half_m, half_m, (2, 2))
        world.poses[:, :2] = places
        world.poses[:, 2] = self._rng.uniform(-math.pi, math.pi, 2)
        world.velocities[:] = 0.0
        self._arena.update_cells()
        self.steps = 0
        return self._states(self._arena.observe())

    def step(self, actions: tuple[int, int]) -> tuple[FloatArray, bool, bool]:
        """Do a primitive action each; return the next states (2, 3), whether they have mated, and if it is over."""
        for robot, action in enumerate(actions):
            self._action[robot, contract.WHEEL_LEFT : contract.WHEEL_RIGHT + 1] = self._wheels[
                action
            ]
            self._arena.act(robot, self._action[robot])
        self._arena.integrate()
        rows = self._arena.observe()
        self.steps += 1
        has_mated = bool(rows[0, contract.ENCOUNTER] > 0.0)
        return self._states(rows), has_mated, has_mated or self.steps >= EPISODE_STEPS

    def _states(self, rows: FloatArray) -> FloatArray:
        """Return what both see of the other."""
        states = np.tile([NOTHING, 0.0, 0.0], (2, 1))
        for kind, blob in ((TAIL, contract.TAIL), (FACE, contract.FACE)):
            for robot in np.flatnonzero(rows[:, blob] > 0.0):
                states[robot] = (
                    kind,
                    rows[robot, blob + contract.DISTANCE],
                    rows[robot, blob + contract.BEARING],
                )
        return states
