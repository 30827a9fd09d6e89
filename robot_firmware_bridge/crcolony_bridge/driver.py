"""The interface of all drivers: what a robot is, its states, what it observes, and what it is told.

An author of a driver writes a class with these methods, most easily on top of `ReconnectingDriver`, names it in the
entry-point group `crcolony_bridge.drivers`, and tests it with `crcolony_bridge.driver_contract_test`.
"""

import enum
import math
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from crcolony.body import contract
from crcolony.compiled import FloatArray

_WHEELS = [contract.WHEEL_LEFT, contract.WHEEL_RIGHT]
PROXIMITY_BEARINGS_RAD = tuple(
    np.linspace(-math.pi / 2, math.pi / 2, contract.PROXIMITY_SENSORS).tolist()
)
"""Of the columns of an observation, those of a simulated body: from right to left."""
_AHEAD_RAD = math.radians(5.0)
"""How far from straight ahead something may be for the range sensor ahead."""


class DriverState(enum.Enum):
    """In which state a driver is. Wheels turn in ACTIVE alone, and a robot that was LOST comes back INACTIVE."""

    CLOSED = "closed"
    CONNECTING = "connecting"
    INACTIVE = "inactive"
    ACTIVE = "active"
    LOST = "lost"
    FAULT = "fault"
    """A person has to do something, as when another robot is at its port"""

    @property
    def is_connected(self) -> bool:
        """Whether the robot is there."""
        return self in (DriverState.INACTIVE, DriverState.ACTIVE)


WatchdogPlace = Literal["firmware", "uploaded program", "robot's own base", "none"]
"""Where it is that wheels are stopped when this machine is gone."""
IrMode = Literal["messages", "tokens", "none"]
"""Whether infrared carries whole messages, or single words of 11 bits: enough to prove that two robots are near."""


@dataclass(frozen=True)
class RobotDescription:
    """What a robot is, as far as it is known; all of it after `open`."""

    model: str
    uid: str = ""
    """Of this very robot: calibrations are kept by it"""
    is_uid_unique: bool = True
    """Whether no other robot has it; Aseba's nodes have numbers, and most of them have the same"""
    track_m: float = 0.16
    radius_m: float = 0.11
    max_speed_m_s: float = 0.3
    proximity_bearings_rad: tuple[float, ...] = ()
    proximity_range_m: float = 0.3
    battery_empty_v: float = 0.0
    battery_full_v: float = 0.0
    """0: the robot does not measure its battery"""
    watchdog_s: float = 0.0
    """Wheels stop so long after the last command, if this machine is gone"""
    watchdog: WatchdogPlace = "none"
    ir: IrMode = "none"
    max_ir_bytes: int = 0
    """The longest message; 2 of a robot whose infrared carries words"""
    period_s: float = 0.1
    """Between two readings"""

    def battery_level(self, battery_v: float) -> float:
        """Return how full a battery of this voltage is, from 0 to 1; 0 if the robot does not measure it."""
        span_v = self.battery_full_v - self.battery_empty_v
        return (
            min(max((battery_v - self.battery_empty_v) / span_v, 0.0), 1.0) if span_v > 0.0 else 0.0
        )


@dataclass(frozen=True)
class Reading:
    """What a robot has measured."""

    time_s: float
    """By the robot's own clock, from its start on"""
    row: FloatArray
    """The observation (OBSERVATION_WIDTH,), without encounters"""
    battery_v: float = 0.0
    is_battery_low: bool = False
    is_battery_critical: bool = False
    is_stopped: bool = False
    """Whether the emergency stop is latched in the robot"""
    ir_messages: tuple[bytes, ...] = field(default=())
    """Messages of other robots that have become complete; with `ir` "tokens" the words that were received"""


class Driver(Protocol):
    """A robot that is attached to this machine. All methods but `stop` are called by one thread.

    Only `open` raises: what happens to a robot later is in `state` and `trouble`.
    """

    @property
    def state(self) -> DriverState:
        """The present state."""
        ...

    @property
    def description(self) -> RobotDescription:
        """What the robot is; before `open` what is known of its model."""
        ...

    @property
    def trouble(self) -> str:
        """Why the robot is LOST or in FAULT, or was last; "" if it never was."""
        ...

    def open(self) -> None:
        """Connect, and be INACTIVE then.

        Raises DeviceError where a person has to do something, and DeviceLostError where the robot may come by itself.
        """
        ...

    def activate(self) -> None:
        """Allow motion; does nothing while stopped or without a robot."""
        ...

    def deactivate(self) -> None:
        """Stand still, and allow no motion any more."""
        ...

    def read(self, timeout_s: float) -> Reading | None:
        """Wait for the newest reading for so long; None after a time-out, and while the robot is LOST.

        A driver that has lost its robot tries to connect again here.
        """
        ...

    def write(self, action: FloatArray) -> FloatArray:
        """Command an action (ACTION_WIDTH,) within the limits; return what is applied, without motion unless ACTIVE."""
        ...

    def stop(self) -> bool:
        """Stop at once and latch it; return whether the robot has confirmed that.

        Any thread may call it while another one reads.
        """
        ...

    def clear(self) -> bool:
        """Release the latch, INACTIVE then; return whether the robot has confirmed that."""
        ...

    def send_ir(self, message: bytes) -> bool:
        """Let the beacon repeat a message from now on; return whether the robot has taken it.

        With `ir` "tokens" it is a word, big-endian in two bytes, below 2,048: the robot emits it about every 0.1 s, or
        more often, while the action's beacon is on, until the next one.
        """
        ...

    def close(self) -> None:
        """Stand still and disconnect."""
        ...


def empty_observation(range_m: float) -> FloatArray:
    """Return the observation (OBSERVATION_WIDTH,) of a robot that senses nothing within its range.

    Its battery is full, as that of a simulated body whose battery does not run down.
    """
    row = np.zeros(contract.OBSERVATION_WIDTH)
    row[contract.PROXIMITY : contract.PROXIMITY + contract.PROXIMITY_SENSORS] = range_m
    row[contract.IR_RANGE] = range_m
    row[contract.BATTERY] = 1.0
    row[contract.ENCOUNTER_ROBOT] = -1.0
    return row


def observe_distances(row: FloatArray, bearings_rad: FloatArray, distances_m: FloatArray) -> None:
    """Write what is seen in these directions (n,), at these distances from the hull (n,), to an observation.

    A column has the nearest of all that is nearer to its bearing than to those of others, and the range sensor the
    nearest of all that is straight ahead; both at most what stands there before.
    """
    sector_rad = PROXIMITY_BEARINGS_RAD[1] - PROXIMITY_BEARINGS_RAD[0]
    columns = np.rint((bearings_rad - PROXIMITY_BEARINGS_RAD[0]) / sector_rad).astype(np.int64)
    is_seen = (columns >= 0) & (columns < contract.PROXIMITY_SENSORS)
    np.minimum.at(row, contract.PROXIMITY + columns[is_seen], distances_m[is_seen])
    is_ahead = np.abs(bearings_rad) <= _AHEAD_RAD
    row[contract.IR_RANGE] = distances_m[is_ahead].min(initial=row[contract.IR_RANGE])


def limited_action(
    action: FloatArray, description: RobotDescription, max_ttl_s: float, *, may_move: bool
) -> FloatArray:
    """Return the action (ACTION_WIDTH,) as this robot can carry it out; raises ValueError as `clip_action` does.

    A curve stays the same curve where a wheel would have to be faster than it can.
    """
    applied = contract.clip_action(action)
    wheels = applied[_WHEELS] if may_move else np.zeros(2)
    fastest_m_s = float(np.abs(wheels).max())
    if fastest_m_s > description.max_speed_m_s:
        wheels = wheels * description.max_speed_m_s / fastest_m_s
    applied[_WHEELS] = wheels
    applied[contract.TTL] = min(applied[contract.TTL], max_ttl_s)
    return applied
