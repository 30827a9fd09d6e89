"""What a robot with the reference firmware says about itself and its senses, as a description and as readings."""

import json
from typing import Any

import numpy as np

from crcolony.body import contract
from crcolony.body.settings import WHEEL_LIMIT_M_S
from crcolony_bridge.driver import (
    IrMode,
    Reading,
    RobotDescription,
    empty_observation,
    observe_distances,
)
from crcolony_bridge.errors import DeviceError
from crcolony_bridge.infrared.short_beacon import WORD_BYTES
from crcolony_bridge.reference_firmware.messages import (
    UNKNOWN_MM,
    Capability,
    Info,
    Status,
    Telemetry,
)

_MM = 1e-3


def describe_robot(text: bytes, info: Info, period_s: float, address: str) -> RobotDescription:
    """Return what a robot is by the text that it has sent; raises DeviceError if that is no description."""
    try:
        tree: dict[str, Any] = json.loads(text)
        return RobotDescription(
            model=str(tree["model"]),
            uid=info.uid.hex(),
            track_m=float(tree["track_m"]),
            radius_m=float(tree["radius_m"]),
            max_speed_m_s=float(tree["max_speed_m_s"]),
            proximity_bearings_rad=tuple(map(float, tree["proximity_bearings_rad"])),
            proximity_range_m=float(tree["proximity_range_m"]),
            battery_empty_v=float(tree["battery_empty_v"]),
            battery_full_v=float(tree["battery_full_v"]),
            watchdog_s=float(tree["watchdog_s"]),
            watchdog="firmware",
            ir=_ir_mode(info),
            max_ir_bytes=info.max_ir_bytes,
            period_s=period_s,
        )
    except (ValueError, KeyError, TypeError) as error:
        raise DeviceError(f"{address}: its description cannot be read: {error!r}") from None


def _ir_mode(info: Info) -> IrMode:
    if Capability.IR not in info.capabilities:
        return "none"
    return "tokens" if info.max_ir_bytes == WORD_BYTES else "messages"


def reading_of(
    telemetry: Telemetry, robot: RobotDescription, ir_messages: tuple[bytes, ...]
) -> Reading:
    """Return a robot's telemetry as a reading; what it has no sensor for stays 0, or out of range."""
    row = empty_observation(robot.proximity_range_m)
    sensors = zip(robot.proximity_bearings_rad, telemetry.proximity_mm, strict=False)
    seen = [(bearing_rad, mm * _MM) for bearing_rad, mm in sensors if mm != UNKNOWN_MM]
    if seen:
        observe_distances(row, *np.array(seen).T)
    row[contract.GYRO] = telemetry.gyro_mrad_s * _MM
    wheels = np.array([telemetry.left_mm_s, telemetry.right_mm_s]) * _MM
    row[contract.WHEELS : contract.WHEELS + 2] = np.clip(wheels, -WHEEL_LIMIT_M_S, WHEEL_LIMIT_M_S)
    row[contract.JAW_HOLDS] = float(Status.JAW_HOLDS in telemetry.status)
    battery_v = telemetry.battery_mv * _MM
    row[contract.BATTERY] = robot.battery_level(battery_v)
    return Reading(
        telemetry.time_ms * _MM,
        row,
        battery_v,
        Status.BATTERY_LOW in telemetry.status,
        Status.BATTERY_CRITICAL in telemetry.status,
        Status.STOPPED in telemetry.status,
        ir_messages,
    )
