"""An emulated Uno for all tests of a file, and a driver of it for each."""

from collections.abc import Iterator

import pytest
from crcolony_bridge.firmata.driver import FirmataRobot

from tests.robot_firmware_bridge.firmata.loose_link import LooseLinks
from tests.robot_firmware_bridge.firmata.uno_robot import UnoRobot


@pytest.fixture(scope="module")
def uno(tmp_path_factory: pytest.TempPathFactory) -> Iterator[UnoRobot]:
    """An Uno that is switched on."""
    with UnoRobot(tmp_path_factory.mktemp("uno")) as robot:
        yield robot


@pytest.fixture
def links() -> LooseLinks:
    """What the driver has opened."""
    return LooseLinks()


@pytest.fixture
def driver(uno: UnoRobot, links: LooseLinks) -> Iterator[FirmataRobot]:
    """A driver that is connected and active."""
    made = FirmataRobot(str(uno.host_link), connect=links.open)
    made.open()
    made.activate()
    yield made
    made.close()
