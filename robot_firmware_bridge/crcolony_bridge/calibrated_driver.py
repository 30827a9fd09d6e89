"""A driver whose robot was calibrated: what is above it sees the robot as it is, not as its kind is."""

import dataclasses
import math
from pathlib import Path

from crcolony.compiled import FloatArray
from crcolony_bridge.calibration import Calibration
from crcolony_bridge.driver import (
    Driver,
    DriverState,
    Reading,
    RobotDescription,
    limited_action,
)

_NOTHING = Calibration()
"""Of a robot that nobody has calibrated"""


class CalibratedDriver:
    """A `Driver` around another one; the calibration is read when the robot, and so its uid, is known."""

    def __init__(self, driver: Driver, folder: Path) -> None:
        self._driver, self._folder = driver, folder
        self._calibration = Calibration()

    @property
    def state(self) -> DriverState:
        """See `Driver`."""
        return self._driver.state

    @property
    def description(self) -> RobotDescription:
        """See `Driver`."""
        return self._calibration.describe(self._driver.description)

    @property
    def trouble(self) -> str:
        """See `Driver`."""
        return self._driver.trouble

    def open(self) -> None:
        """See `Driver`; raises DeviceError, too, if the robot's calibration cannot be read."""
        self._driver.open()
        try:
            self._calibration = Calibration.load(self._folder, self._driver.description.uid)
        except Exception:
            self._driver.close()
            raise

    def activate(self) -> None:
        """See `Driver`."""
        self._driver.activate()

    def deactivate(self) -> None:
        """See `Driver`."""
        self._driver.deactivate()

    def read(self, timeout_s: float) -> Reading | None:
        """See `Driver`."""
        reading = self._driver.read(timeout_s)
        if reading is None or self._calibration == _NOTHING:
            return reading
        robot = self._driver.description
        row = self._calibration.observe(reading.row, robot, reading.battery_v)
        return dataclasses.replace(reading, row=row)

    def write(self, action: FloatArray) -> FloatArray:
        """See `Driver`."""
        wanted = limited_action(action, self.description, math.inf, may_move=True)
        return self._calibration.applied(self._driver.write(self._calibration.command(wanted)))

    def stop(self) -> bool:
        """See `Driver`."""
        return self._driver.stop()

    def clear(self) -> bool:
        """See `Driver`."""
        return self._driver.clear()

    def send_ir(self, message: bytes) -> bool:
        """See `Driver`."""
        return self._driver.send_ir(message)

    def close(self) -> None:
        """See `Driver`."""
        self._driver.close()
