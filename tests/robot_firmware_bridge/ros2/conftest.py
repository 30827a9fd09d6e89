"""A router and a base that tests share, and drivers that are closed after each test."""

from collections.abc import Callable, Iterator

import pytest
from crcolony_bridge.ros2.driver import Ros2Robot

from tests.robot_firmware_bridge.ros2.network import Network, network


@pytest.fixture(scope="module")
def shared() -> Iterator[Network]:
    """A network that every test leaves as it was."""
    with network() as made:
        yield made


@pytest.fixture
def new_robot() -> Iterator[Callable[[str], Ros2Robot]]:
    """Drivers that are closed after the test."""
    made: list[Ros2Robot] = []

    def make(address: str) -> Ros2Robot:
        made.append(Ros2Robot(address))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


@pytest.fixture
def driver(shared: Network, new_robot: Callable[[str], Ros2Robot]) -> Ros2Robot:
    """A driver of the shared base that is connected and active."""
    robot = new_robot(f"{shared.address}?ranges=range/left:60")
    robot.open()
    robot.activate()
    return robot
