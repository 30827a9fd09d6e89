"""What the analog channels of a robot with Firmata mean in an observation."""

from collections.abc import Mapping

import numpy as np

from crcolony.body import contract
from crcolony_bridge.driver import Reading, RobotDescription, empty_observation
from crcolony_bridge.firmata.board import Board

_HIGHEST = 1023
"""Of ten bits."""
_COLUMN_AHEAD = 3


def reading_of(
    board: Board,
    robot: RobotDescription,
    values: Mapping[int, int],
    wheels_m_s: tuple[float, float],
    time_s: float,
    *,
    is_stopped: bool,
) -> Reading:
    """Return a reading of what the channels have measured, by their numbers, and how the wheels turn."""
    row = empty_observation(robot.proximity_range_m)
    row[contract.WHEELS : contract.WHEELS + 2] = wheels_m_s
    if board.proximity is not None:
        curve = board.proximity
        for sensor in curve.sensors:
            distance_m = np.interp(_volts(board, values, sensor.analog), curve.volts, curve.metres)
            row[contract.PROXIMITY + sensor.column] = distance_m
        row[contract.IR_RANGE] = row[contract.PROXIMITY + _COLUMN_AHEAD]
    battery, battery_v = board.battery, 0.0
    if battery is not None:
        battery_v = _volts(board, values, battery.analog) * battery.volts_per_volt
        row[contract.BATTERY] = robot.battery_level(battery_v)
    return Reading(
        time_s,
        row,
        battery_v,
        is_battery_low=battery is not None and battery_v < battery.low_v,
        is_stopped=is_stopped,
    )


def _volts(board: Board, values: Mapping[int, int], channel: int) -> float:
    return board.reference_v * min(values[channel], _HIGHEST) / _HIGHEST
