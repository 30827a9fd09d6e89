"""What a ROS 2 robot's messages mean: a row of our contract from odometry, distances and battery.

A laser scanner is taken to be in the middle of the base, and to see from its height what the base could bump into.
"""

import math
from collections.abc import Iterable

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import WHEEL_LIMIT_M_S, CyberRodent
from crcolony.compiled import FloatArray
from crcolony_bridge.driver import empty_observation, observe_distances
from crcolony_bridge.ros2.address import Base
from crcolony_bridge.ros2.messages import BatteryState, LaserScan, Odometry, Range, Twist

PROXIMITY_RANGE_M = CyberRodent().proximity_range_m
IR_RANGE_M = CyberRodent().ir_range_m
"""How far is observed, though a scanner measures farther: as a simulated body observes."""

Distances = FloatArray
"""Bearings, left is positive (rad), and distances from the hull (m): (n, 2)."""
NO_DISTANCES: Distances = np.empty((0, 2))


def wheel_speeds_m_s(odometry: Odometry, base: Base) -> tuple[float, float]:
    """Return how fast the left and the right wheel turn."""
    twist = odometry.twist.twist
    turn = twist.angular.z * base.track_m / 2.0
    return twist.linear.x - turn, twist.linear.x + turn


def twist_of(left_m_s: float, right_m_s: float, base: Base) -> tuple[float, float]:
    """Return speed ahead (m/s) and turning rate (rad/s) of wheels that turn so fast."""
    return (left_m_s + right_m_s) / 2.0, (right_m_s - left_m_s) / base.track_m


def is_finite(twist: Twist) -> bool:
    """Return whether a base really says how it moves."""
    return math.isfinite(twist.linear.x) and math.isfinite(twist.angular.z)


def observe(
    odometry: Odometry, distances: Distances, battery: float | None, base: Base
) -> FloatArray:
    """Return the observation (OBSERVATION_WIDTH,); `battery` is its level, None if it does not measure it."""
    row = empty_observation(PROXIMITY_RANGE_M)
    row[contract.IR_RANGE] = IR_RANGE_M
    observe_distances(row, *distances.T)
    row[contract.GYRO] = odometry.twist.twist.angular.z
    row[contract.WHEELS : contract.WHEELS + 2] = np.clip(
        wheel_speeds_m_s(odometry, base), -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S
    )
    if battery is not None:
        row[contract.BATTERY] = battery
    return row


def distances_of_scan(scan: LaserScan, base: Base) -> Distances:
    """Return what a laser scanner sees; what it does not see, or what is no measurement (REP 117), is left out."""
    if not (math.isfinite(scan.angle_min) and math.isfinite(scan.angle_increment)):
        return NO_DISTANCES
    ranges_m = np.array(scan.ranges)
    is_measured = (ranges_m >= scan.range_min) & (ranges_m <= scan.range_max)
    rays = np.flatnonzero(is_measured | np.isneginf(ranges_m))
    bearings_rad = scan.angle_min + rays * scan.angle_increment + base.scan_yaw_rad
    bearings_rad = np.remainder(bearings_rad + math.pi, 2.0 * math.pi) - math.pi
    return np.stack([bearings_rad, np.maximum(ranges_m[rays] - base.radius_m, 0.0)], axis=1)


def distances_of_ranges(ranges: Iterable[tuple[float, Range]]) -> Distances:
    """Return what single sensors at the hull measure, each with its bearing (rad)."""
    found = [
        (bearing_rad, max(single.range, 0.0))
        for bearing_rad, single in ranges
        if single.min_range <= single.range <= single.max_range or single.range == -math.inf
    ]
    return np.array(found).reshape(-1, 2)


def battery_level(battery: BatteryState) -> float | None:
    """Return how full a battery is, from 0 to 1; None if the robot does not know."""
    return min(max(battery.percentage, 0.0), 1.0) if math.isfinite(battery.percentage) else None
