"""The contract between a robot and its body (thesis 4.6): observations and actions, in SI units.

An observation and an action are rows of float64, one column a quantity. The tables below are the
contract: the arena fulfils it for simulated bodies, a driver for a physical one, and a robot cannot
distinguish them. There is no ground truth in an observation: nothing that a Cyber Rodent could not
sense.
"""

from dataclasses import dataclass
from math import inf, pi
from typing import Protocol

import numpy as np

from crcolony.body.settings import WHEEL_LIMIT_M_S
from crcolony.compiled import FloatArray


@dataclass(frozen=True)
class Quantity:
    """One column of an observation or action: its name (which ends in its unit, if any), range and
    meaning."""

    name: str
    low: float
    high: float
    meaning: str


def _blob(name: str, meaning: str) -> tuple[Quantity, ...]:
    return (
        Quantity(f"{name}_visible", 0.0, 1.0, f"1 if the camera sees {meaning}"),
        Quantity(
            f"{name}_distance_m", 0.0, inf, "from the robot's centre to the nearest such blob"
        ),
        Quantity(f"{name}_bearing_rad", -pi, pi, "left of straight ahead is positive"),
        Quantity(f"{name}_red", 0.0, 1.0, "colour of its lamp"),
        Quantity(f"{name}_green", 0.0, 1.0, "colour of its lamp"),
        Quantity(f"{name}_blue", 0.0, 1.0, "colour of its lamp"),
    )


PROXIMITY_SENSORS = 7
"""Infrared proximity sensors around the front."""

OBSERVATION: tuple[Quantity, ...] = (
    *_blob("pack", "a battery pack"),
    *_blob("face", "another robot's face (from within 90 degrees of its heading)"),
    *_blob("tail", "another robot's tail lamp (from behind)"),
    Quantity(
        "ir_range_m", 0.0, inf, "distance straight ahead to the first surface, at most the range"
    ),
    *(
        Quantity(f"proximity_{k}_m", 0.0, inf, "from the hull outwards; 0 is rightmost, 3 is ahead")
        for k in range(PROXIMITY_SENSORS)
    ),
    Quantity("gyro_rad_s", -inf, inf, "turning rate, left is positive"),
    Quantity("acceleration_ahead_m_s2", -inf, inf, "over the last control period"),
    Quantity("acceleration_left_m_s2", -inf, inf, "over the last control period"),
    Quantity("wheel_left_m_s", -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S, "as the wheel turns"),
    Quantity("wheel_right_m_s", -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S, "as the wheel turns"),
    Quantity("jaw_holds", 0.0, 1.0, "1 while the jaw holds a pack"),
    Quantity("charge", 0.0, 1.0, "energy taken from a pack in the last control period"),
    Quantity("microphone_left", 0.0, 1.0, "loudness"),
    Quantity("microphone_right", 0.0, 1.0, "loudness"),
    Quantity("battery", 0.0, 1.0, "level of the body's own battery"),
    Quantity("encounter", 0.0, 1.0, "1 if an IR contact was made with a robot face to face"),
    Quantity("encounter_robot", -1.0, inf, "slot of that robot in the arena, -1 for none"),
    Quantity(
        "encounter_nonce", 0.0, 2.0**48, "a random number that both sides of this contact observe"
    ),
)
"""The columns of an observation."""

ACTION: tuple[Quantity, ...] = (
    Quantity("wheel_left_m_s", -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S, "speed of the left wheel"),
    Quantity("wheel_right_m_s", -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S, "speed of the right wheel"),
    Quantity("jaw", 0.0, 1.0, "1 closes the jaw (it latches on a pack in reach), 0 opens it"),
    Quantity("led_red", 0.0, 1.0, "face lamp"),
    Quantity("led_green", 0.0, 1.0, "face lamp"),
    Quantity("led_blue", 0.0, 1.0, "face lamp"),
    Quantity("speaker", 0.0, 1.0, "loudness"),
    Quantity("beacon", 0.0, 1.0, "1 switches the IR beacon on: ready to mate"),
    Quantity("ttl_s", 0.0, 10.0, "the body stops when this time has passed without a fresh action"),
)
"""The columns of an action."""


def columns(table: tuple[Quantity, ...]) -> dict[str, int]:
    """Return the column of every quantity of a table by its name."""
    return {quantity.name: column for column, quantity in enumerate(table)}


def limits(table: tuple[Quantity, ...]) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest value of every column of a table."""
    return np.array([q.low for q in table]), np.array([q.high for q in table])


_OBSERVED = columns(OBSERVATION)
_ACTED = columns(ACTION)

OBSERVATION_WIDTH = len(OBSERVATION)
ACTION_WIDTH = len(ACTION)

PACK = _OBSERVED["pack_visible"]
FACE = _OBSERVED["face_visible"]
TAIL = _OBSERVED["tail_visible"]
DISTANCE = 1
"""Column of a blob's distance, counted from its `…_visible` column."""
BEARING = 2
"""Column of a blob's bearing, counted from its `…_visible` column."""
COLOUR = 3
"""Column of a blob's red, before green and blue, counted from its `…_visible` column."""

IR_RANGE = _OBSERVED["ir_range_m"]
PROXIMITY = _OBSERVED["proximity_0_m"]
GYRO = _OBSERVED["gyro_rad_s"]
ACCELERATION = _OBSERVED["acceleration_ahead_m_s2"]
WHEELS = _OBSERVED["wheel_left_m_s"]
JAW_HOLDS = _OBSERVED["jaw_holds"]
CHARGE = _OBSERVED["charge"]
MICROPHONES = _OBSERVED["microphone_left"]
BATTERY = _OBSERVED["battery"]
ENCOUNTER = _OBSERVED["encounter"]
ENCOUNTER_ROBOT = _OBSERVED["encounter_robot"]
ENCOUNTER_NONCE = _OBSERVED["encounter_nonce"]

WHEEL_LEFT = _ACTED["wheel_left_m_s"]
WHEEL_RIGHT = _ACTED["wheel_right_m_s"]
JAW = _ACTED["jaw"]
LED = _ACTED["led_red"]
SPEAKER = _ACTED["speaker"]
BEACON = _ACTED["beacon"]
TTL = _ACTED["ttl_s"]


class Body(Protocol):
    """What a robot drives. Reading the next observation is the robot's only clock.

    `contract_test.BodyContract` tests whether a class fulfils all of this.
    """

    def read(self) -> FloatArray:
        """Wait for the next control period and return its observation, shape (OBSERVATION_WIDTH,).

        Every column is finite and within the limits of the table.
        """
        ...

    def act(self, action: FloatArray) -> FloatArray:
        """Set the action; return what is applied after clipping, shape (ACTION_WIDTH,).

        It is applied until the next action, but for no longer than its own `ttl_s`: then the body
        stops. Raises ValueError if the action has another shape or holds a number that is not
        finite.
        """
        ...

    def close(self) -> None:
        """Stop the body and release it."""
        ...


_LOWEST, _HIGHEST = limits(ACTION)
_LEAST_SENSED, _MOST_SENSED = limits(OBSERVATION)


def clip_action(action: FloatArray) -> FloatArray:
    """Return the action (ACTION_WIDTH,) within the limits of the table; raises ValueError as
    `Body.act` does."""
    if action.shape != (ACTION_WIDTH,):
        raise ValueError(f"an action has shape ({ACTION_WIDTH},), not {action.shape}")
    if not np.isfinite(action).all():
        raise ValueError("an action holds only finite numbers")
    return np.minimum(np.maximum(action, _LOWEST), _HIGHEST)


def check_observation(observation: FloatArray) -> None:
    """Raise ValueError that names a column of an observation (OBSERVATION_WIDTH,) which is beyond the table's limits.

    A number that is not finite is beyond all limits.
    """
    is_within = (observation >= _LEAST_SENSED) & (observation <= _MOST_SENSED)
    is_within &= np.isfinite(observation)
    if not is_within.all():
        column = int(np.argmin(is_within))
        raise ValueError(f"{OBSERVATION[column].name} is {observation[column]}")
