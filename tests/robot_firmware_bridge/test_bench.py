"""A robot on the bench is probed, driven by hand, and calibrated: what is measured is what the robot is."""

from pathlib import Path

import pytest
from crcolony_bridge.bench import calibrate, drive, probe
from crcolony_bridge.calibrated_driver import CalibratedDriver
from crcolony_bridge.calibration import Calibration
from crcolony_bridge.driver import DriverState
from crcolony_bridge.errors import DeviceError

from tests.robot_firmware_bridge.fake_driver import FakeDriver
from tests.robot_firmware_bridge.skewed_robot import BIAS_RAD_S, SCALES, TRACK_M, SkewedRobot


def test_a_calibration_finds_what_differs(tmp_path: Path) -> None:
    """Wheels, the distance between them, and the gyro's bias; then the robot does what it is told."""
    lines: list[str] = []
    path = calibrate(SkewedRobot(), tmp_path, 0.1, lines.append, needs_watchdog=False)
    assert path == tmp_path / "skewed_1.toml"
    found = Calibration.load(tmp_path, "skewed/1")
    assert found.wheel_left == pytest.approx(SCALES[0], abs=0.01)
    assert found.wheel_right == pytest.approx(SCALES[1], abs=0.01)
    assert found.track_m == pytest.approx(TRACK_M, abs=0.005)
    assert found.gyro_bias_rad_s == pytest.approx(BIAS_RAD_S, abs=0.005)
    lines.clear()
    drive(
        CalibratedDriver(SkewedRobot(), tmp_path), 0.1, 0.1, 1.0, lines.append, needs_watchdog=False
    )


def test_without_a_gyro_the_wheels_are_calibrated_alone(tmp_path: Path) -> None:
    """And it is said what a person has to measure."""
    lines: list[str] = []
    calibrate(SkewedRobot(has_gyro=False), tmp_path, 0.1, lines.append, needs_watchdog=False)
    assert "no gyro: measure the distance" in lines[-1]
    assert Calibration.load(tmp_path, "skewed/1").track_m == 0.0


def test_a_calibration_keeps_what_a_person_has_written(tmp_path: Path) -> None:
    """Such as the voltages of the battery."""
    Calibration(battery_full_v=4.1, proximity_offset_m=0.01).save(tmp_path, "skewed/1")
    calibrate(SkewedRobot(), tmp_path, 0.1, lambda line: None, needs_watchdog=False)
    found = Calibration.load(tmp_path, "skewed/1")
    assert (found.battery_full_v, found.proximity_offset_m) == (4.1, 0.01)


def test_a_probe_says_what_a_robot_is() -> None:
    """Also that nothing stops it when this machine dies."""
    lines: list[str] = []
    probe(SkewedRobot(), lines.append)
    text = "\n".join(lines)
    assert "model       skewed" in text
    assert "watchdog    NONE" in text
    assert "readings" in text


def test_a_robot_that_nothing_stops_is_not_driven_by_hand_either(tmp_path: Path) -> None:
    """Unless a person says that it can do no harm: whoever drives by hand can lose the machine, too."""
    robot = SkewedRobot()
    with pytest.raises(
        DeviceError, match=r"skewed: nothing stops its wheels .* --without-watchdog"
    ):
        drive(robot, 0.1, 0.1, 1.0, lambda line: None)
    with pytest.raises(DeviceError, match="nothing stops its wheels"):
        calibrate(robot, tmp_path, 0.1, lambda line: None)
    assert robot.state is DriverState.CLOSED
    assert not list(tmp_path.iterdir())


def test_a_robot_that_is_not_there_is_said() -> None:
    """In one line."""
    with pytest.raises(DeviceError, match="fake: not plugged in"):
        probe(FakeDriver(is_present=False), lambda line: None)
