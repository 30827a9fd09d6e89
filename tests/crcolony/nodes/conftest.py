"""Fixtures of the tests of nodes."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.lone_robot import LoneRobot


@pytest.fixture
def lone(tmp_path: Path) -> Iterator[LoneRobot]:
    """A robot without a network."""
    robot = LoneRobot(tmp_path)
    yield robot
    robot.store.close()
