"""A calibration is kept by uid, checked when it is read, and changes what it should alone."""

from pathlib import Path

import numpy as np
import pytest
from crcolony_bridge.calibration import Calibration, path_of
from crcolony_bridge.driver import RobotDescription
from crcolony_bridge.errors import DeviceError
from hypothesis import given
from hypothesis import strategies as st

from crcolony.body import contract

ROBOT = RobotDescription("robot", "1", proximity_range_m=0.1)


def test_a_robot_without_one_is_as_its_kind(tmp_path: Path) -> None:
    """Nothing changes."""
    found = Calibration.load(tmp_path, "1")
    assert found == Calibration()
    row = np.linspace(0.0, 0.09, contract.OBSERVATION_WIDTH)
    np.testing.assert_array_equal(found.observe(row, ROBOT, 3.7), row)
    assert found.describe(ROBOT) == ROBOT


@given(st.floats(0.5, 2.0), st.floats(0.5, 2.0), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_what_is_commanded_is_what_wheels_do(a: float, b: float, left: float, right: float) -> None:
    """By the scale of each."""
    found = Calibration(wheel_left=a, wheel_right=b)
    action = np.zeros(contract.ACTION_WIDTH)
    action[[contract.WHEEL_LEFT, contract.WHEEL_RIGHT]] = left, right
    np.testing.assert_allclose(found.applied(found.command(action)), action)


def test_it_is_written_and_read_again(tmp_path: Path) -> None:
    """In a folder that is made."""
    made = Calibration(wheel_left=0.97, track_m=0.123, battery_full_v=4.2, battery_empty_v=3.2)
    made.save(tmp_path / "new", "uid")
    assert Calibration.load(tmp_path / "new", "uid") == made
    assert made.describe(ROBOT).track_m == 0.123


@pytest.mark.parametrize(
    "text", ["wheel_left = 9.0", "wheel_lef = 1.0", "wheel_left = ", "\ufeff\x00", "track_m = 'x'"]
)
def test_a_wrong_one_is_refused_with_its_path(tmp_path: Path, text: str) -> None:
    """In one line."""
    path_of(tmp_path, "1").write_text(text, "utf-8")
    with pytest.raises(DeviceError, match=r"1\.toml: "):
        Calibration.load(tmp_path, "1")


def test_no_uid_leads_out_of_the_folder(tmp_path: Path) -> None:
    """It is what a device says."""
    assert path_of(tmp_path, "../../etc/passwd").parent == tmp_path
    assert path_of(tmp_path, "").name == "robot.toml"
