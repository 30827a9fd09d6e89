"""A simulated robot before a wall, and a driver of it."""

from collections.abc import Callable, Iterator

import pytest
from crcolony_bridge.aseba.driver import AsebaRobot
from crcolony_bridge.link import Link, open_link

from tests.robot_firmware_bridge.aseba.driven import NewRobot
from tests.robot_firmware_bridge.playground import PlacedRobot, Playground, free_port, playground

HULL_CM = {"e-puck": 3.7, "thymio2": 8.0}
"""From the middle to the front."""


@pytest.fixture
def placed(request: pytest.FixtureRequest) -> PlacedRobot:
    """A robot that looks to the right; an e-puck, unless a test asks for something else."""
    return PlacedRobot(getattr(request, "param", "e-puck"), 100.0, 100.0, free_port())


@pytest.fixture
def world(placed: PlacedRobot) -> Iterator[Playground]:
    """That robot before a wall, 5 cm from its hull."""
    x_cm = placed.x_cm + HULL_CM[placed.kind] + 5.0 + 1.0
    with playground(
        [placed], f'<wall x="{x_cm}" y="{placed.y_cm}" l1="2" l2="40" h="10"/>'
    ) as made:
        yield made


@pytest.fixture
def new_robot() -> Iterator[NewRobot]:
    """Drivers that are closed after the test."""
    made: list[AsebaRobot] = []

    def make(
        address: str, uid: str = "", connect: Callable[[str, int], Link] = open_link
    ) -> AsebaRobot:
        made.append(AsebaRobot(address, uid, connect=connect))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


@pytest.fixture
def driver(world: Playground, placed: PlacedRobot, new_robot: NewRobot) -> AsebaRobot:
    """A driver that is connected and active."""
    robot = new_robot(placed.address, placed.uid)
    robot.open()
    robot.activate()
    return robot
