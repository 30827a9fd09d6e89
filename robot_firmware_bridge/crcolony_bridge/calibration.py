"""What is measured of one very robot and differs from its kind: a TOML file for each, named by its uid."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Self

import msgspec
import numpy as np
import tomli_w
from msgspec import Meta

from crcolony.body import contract
from crcolony.compiled import FloatArray
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError

Scale = Annotated[float, Meta(ge=0.5, le=2.0)]
_WHEELS = [contract.WHEEL_LEFT, contract.WHEEL_RIGHT]
_PROXIMITY = slice(contract.PROXIMITY, contract.PROXIMITY + contract.PROXIMITY_SENSORS)


class Calibration(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What differs; the defaults change nothing."""

    wheel_left: Scale = 1.0
    """How fast the left wheel turns, of what it is commanded"""
    wheel_right: Scale = 1.0
    """How fast the right wheel turns"""
    track_m: Annotated[float, Meta(ge=0.0, le=2.0)] = 0.0
    """Distance between the wheels; 0: as the robot says"""
    gyro_bias_rad_s: Annotated[float, Meta(ge=-1.0, le=1.0)] = 0.0
    """What the gyro reports while the robot stands still"""
    proximity_offset_m: Annotated[float, Meta(ge=-0.2, le=0.2)] = 0.0
    """What proximity sensors report beyond the real distance"""
    battery_empty_v: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    battery_full_v: Annotated[float, Meta(ge=0.0, le=100.0)] = 0.0
    """0: as the robot says"""

    @classmethod
    def load(cls, folder: Path, uid: str) -> Self:
        """Return the calibration of a robot, the default if it has none; raises DeviceError if it cannot be read."""
        path = path_of(folder, uid)
        try:
            return msgspec.toml.decode(path.read_bytes(), type=cls)
        except FileNotFoundError:
            return cls()
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            raise DeviceError(f"{path}: {error}") from None
        except OSError as error:
            raise DeviceError(f"{path}: {error.strerror}") from None

    def save(self, folder: Path, uid: str) -> Path:
        """Write it, and return where; raises DeviceError if that is impossible."""
        path = path_of(folder, uid)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            path.write_text(tomli_w.dumps(msgspec.structs.asdict(self)), "utf-8")
        except OSError as error:
            raise DeviceError(f"{path}: {error.strerror}") from None
        return path

    def describe(self, robot: RobotDescription) -> RobotDescription:
        """Return what the robot is, as it was measured."""
        return replace(
            robot,
            max_speed_m_s=robot.max_speed_m_s * min(self.wheel_left, self.wheel_right, 1.0),
            track_m=self.track_m or robot.track_m,
            battery_empty_v=self.battery_empty_v or robot.battery_empty_v,
            battery_full_v=self.battery_full_v or robot.battery_full_v,
        )

    def command(self, action: FloatArray) -> FloatArray:
        """Return the action (ACTION_WIDTH,) that makes the wheels turn as they should."""
        commanded = action.copy()
        commanded[_WHEELS] /= self._wheels
        return commanded

    def applied(self, action: FloatArray) -> FloatArray:
        """Return what an action that was commanded really does."""
        applied = action.copy()
        applied[_WHEELS] *= self._wheels
        return applied

    def observe(self, row: FloatArray, robot: RobotDescription, battery_v: float) -> FloatArray:
        """Return the observation (OBSERVATION_WIDTH,) of what the robot has measured."""
        seen = row.copy()
        seen[contract.GYRO] -= self.gyro_bias_rad_s
        if self.proximity_offset_m:
            corrected = seen[_PROXIMITY] - self.proximity_offset_m
            seen[_PROXIMITY] = np.clip(corrected, 0.0, robot.proximity_range_m)
        if self.battery_full_v > 0.0 and battery_v > 0.0:
            seen[contract.BATTERY] = self.describe(robot).battery_level(battery_v)
        return seen

    @property
    def _wheels(self) -> FloatArray:
        return np.array([self.wheel_left, self.wheel_right])


def path_of(folder: Path, uid: str) -> Path:
    """Return where the calibration of a robot is; its uid becomes the name of a file."""
    return folder / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', uid) or 'robot'}.toml"
