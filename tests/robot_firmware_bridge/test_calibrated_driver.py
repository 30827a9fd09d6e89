"""A calibrated robot is a driver like any other."""

from pathlib import Path

import pytest
from crcolony_bridge.calibrated_driver import CalibratedDriver
from crcolony_bridge.calibration import Calibration
from crcolony_bridge.driver import Driver, DriverState
from crcolony_bridge.driver_contract_test import DriverContract
from crcolony_bridge.errors import DeviceError

from tests.robot_firmware_bridge.skewed_robot import BIAS_RAD_S, SCALES, TRACK_M, SkewedRobot


class TestCalibrated(DriverContract):
    """A robot whose wheels are skewed, and whose calibration is known."""

    period_s = 0.05
    wheel_tolerance_m_s = 1e-6

    @pytest.fixture(autouse=True)
    def _calibrated(self, tmp_path: Path) -> None:
        self.folder = tmp_path
        left, right = SCALES
        Calibration(
            wheel_left=left, wheel_right=right, track_m=TRACK_M, gyro_bias_rad_s=BIAS_RAD_S
        ).save(tmp_path, "skewed/1")

    def new_driver(self) -> Driver:
        """Return it."""
        return CalibratedDriver(SkewedRobot(), self.folder)


def test_a_calibration_that_cannot_be_read_leaves_the_robot_closed(tmp_path: Path) -> None:
    """And says which file it is."""
    (tmp_path / "skewed_1.toml").write_text("wheel = 3")
    robot = SkewedRobot()
    with pytest.raises(DeviceError, match=r"skewed_1\.toml"):
        CalibratedDriver(robot, tmp_path).open()
    assert robot.state is DriverState.CLOSED
